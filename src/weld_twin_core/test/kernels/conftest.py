# Copyright 2026 weld_twin contributors
# SPDX-License-Identifier: Apache-2.0
"""Robots of general geometry, and a seam for them."""

from __future__ import annotations

import sys
from collections.abc import Callable
from pathlib import Path

import numpy as np
import pytest

from weld_twin_core.arm.robot import Robot

sys.path.insert(0, str(Path(__file__).parent))

from general_robots import CASES, general_robot


@pytest.fixture(params=CASES, ids=list(CASES))
def any_robot(request: pytest.FixtureRequest) -> Robot:
    n, convention, slides = CASES[request.param]
    return general_robot(n, convention, slides=slides)


@pytest.fixture
def make_robot() -> Callable[..., Robot]:
    return general_robot


@pytest.fixture
def smooth_seam() -> np.ndarray:
    """Joint positions of six joints along a smooth motion, shape (200, 6)."""
    s = np.linspace(0.0, 1.0, 200)[:, None]
    rates, phases = np.array([1.0, 1.3, 0.7, 1.1, 0.9, 1.5]), np.arange(6)
    return 0.3 * phases - 0.8 + 0.3 * np.sin(s * rates + phases)
