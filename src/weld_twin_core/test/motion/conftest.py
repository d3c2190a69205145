# Copyright 2026 weld_twin contributors
# SPDX-License-Identifier: Apache-2.0
"""Arms of each build, and joint positions within their limits."""

import sys
from pathlib import Path

import numpy as np
import pytest

from weld_twin_core.arm import catalog

sys.path.insert(0, str(Path(__file__).parent))

BUILDS = ('abb_irb120', 'abb_irb1600', 'kuka_kr6_r900', 'fanuc_m10ia', 'ur5', 'ur10')
BUILDS += ('franka_panda',)


@pytest.fixture(params=BUILDS)
def robot(request):
    """Return an arm of each build in turn."""
    return catalog.load(request.param)


@pytest.fixture
def configurations():
    """Return a function that draws joint positions within the limits, shape (count, n)."""

    def draw(robot, count=20, seed=3):
        rng = np.random.default_rng(seed)
        return rng.uniform(robot.lower, robot.upper, size=(count, robot.n))

    return draw
