# Copyright 2026 weld_twin contributors
# SPDX-License-Identifier: Apache-2.0
"""A robot and a short seam."""

import pytest

pytest.importorskip('rclpy', reason='needs ROS 2')

from weld_twin_core.arm import catalog
from weld_twin_core.arm.robot import Robot
from weld_twin_core.motion.planned_motion import Plan
from weld_twin_nodes.offline.seam_motion import plan_motion


@pytest.fixture(scope='session')
def robot() -> Robot:
    return catalog.load('ur5')


@pytest.fixture(scope='session')
def plan(robot: Robot) -> Plan:
    """Some two hundred samples with reversals in them."""
    return plan_motion(robot, 'line', 'aggressive', 50.0)
