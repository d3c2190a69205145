# Copyright 2026 weld_twin contributors
# SPDX-License-Identifier: Apache-2.0
"""Cells of the soundness tests for all folders; bundled robots."""

import sys
from pathlib import Path

import pytest

from weld_twin_core.arm import catalog

sys.path.insert(0, str(Path(__file__).parent / 'soundness'))


@pytest.fixture
def ur5():
    return catalog.load('ur5')
