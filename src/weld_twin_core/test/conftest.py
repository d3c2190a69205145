# Copyright 2026 weld_twin contributors
# SPDX-License-Identifier: Apache-2.0
"""Cells of the soundness tests and a small arm for all folders; bundled robots."""

import sys
from pathlib import Path

import pytest

from weld_twin_core.arm import catalog

HERE = Path(__file__).parent
sys.path[:0] = [str(HERE), str(HERE / 'soundness')]


@pytest.fixture(scope='session')
def ur5():
    return catalog.load('ur5')
