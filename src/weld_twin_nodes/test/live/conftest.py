# Copyright 2026 weld_twin contributors
# SPDX-License-Identifier: Apache-2.0
"""A robot."""

import pytest

pytest.importorskip('rclpy', reason='needs ROS 2')

from weld_twin_core import Robot, catalog


@pytest.fixture(scope='session')
def robot() -> Robot:
    return catalog.load('ur5')
