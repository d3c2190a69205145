# Copyright 2026 weld_twin contributors
# SPDX-License-Identifier: Apache-2.0
"""Robots of general geometry."""

import sys
from collections.abc import Callable
from pathlib import Path

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
