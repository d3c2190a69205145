# Copyright 2026 weld_twin contributors
# SPDX-License-Identifier: Apache-2.0
"""The bundled robot and the cells of the core's soundness tests."""

import sys
from pathlib import Path

import pytest

from weld_twin_core.arm import catalog

sys.path.insert(0, str(Path(__file__).parents[2] / 'src/weld_twin_core/test/soundness'))


@pytest.fixture
def ur5():
    return catalog.load('ur5')
