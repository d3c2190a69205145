# Copyright 2026 weld_twin contributors
# SPDX-License-Identifier: Apache-2.0
"""
Mecademic Meca500 (R3).

The base is on axis 1 at the base plate, as in the controller; the URDF begins 12.498 mm behind.
"""

from math import pi

from .rows_in_degrees import joints

_ROWS = (
    (0.0, -pi / 2, 0.135, 0.0, -175.0, 175.0, 150.0),
    (0.135, 0.0, 0.0, -pi / 2, -70.0, 90.0, 150.0),
    (0.038, -pi / 2, 0.0, 0.0, -135.0, 70.0, 180.0),
    (0.0, pi / 2, 0.12, 0.0, -170.0, 170.0, 300.0),
    (0.0, -pi / 2, 0.0, 0.0, -115.0, 115.0, 300.0),
    (0.0, 0.0, 0.07, pi, -180.0, 180.0, 500.0),
)
"""a, alpha, d, theta at zero, lower, upper and speed in degrees; else m and rad."""

DATA = {
    'name': 'mecademic_meca500',
    'source': 'geometry, range and speed from a published URDF (meca500_ros2 of the Vanderbilt '
    'Applied Robotics Lab), range of joint 6 as limited there; no source of link masses was '
    'opened, so there are none; acceleration is an estimate (full speed in 0.25 s)',
    'joints': joints('joint', _ROWS),
}
"""The robot file, with the source of its numbers."""
