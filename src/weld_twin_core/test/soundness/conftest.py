# SPDX-FileCopyrightText: weld_twin contributors
# SPDX-License-Identifier: Apache-2.0
"""Fixtures of the soundness tests; makes `measured_cells` importable under any import mode."""

import sys
from pathlib import Path

import numpy as np
import pytest

from weld_twin_core.arm import catalog

sys.path.insert(0, str(Path(__file__).parent))


@pytest.fixture
def rng():
    return np.random.default_rng(7)


@pytest.fixture
def ur5():
    return catalog.load('ur5')
