# Copyright 2026 weld_twin contributors
# SPDX-License-Identifier: Apache-2.0
"""ABB IRB 4600-40/2.55."""

from math import pi

from .rows_in_degrees import joints

_ROWS = (
    (0.175, -pi / 2, 0.495, 0.0, -180.0, 180.0, 175.0),
    (1.095, 0.0, 0.0, -pi / 2, -90.0, 150.0, 175.0),
    (0.175, -pi / 2, 0.0, 0.0, -180.0, 75.0, 175.0),
    (0.0, pi / 2, 1.27, 0.0, -400.0, 400.0, 250.0),
    (0.0, -pi / 2, 0.0, 0.0, -125.0, 120.0, 250.0),
    (0.0, 0.0, 0.135, pi, -400.0, 400.0, 360.0),
)
"""a, alpha, d, theta at zero, lower, upper and speed in degrees; else m and rad."""

DATA = {
    'name': 'abb_irb4600_40_255',
    'source': 'geometry, range and speed from the URDF of ROS-Industrial (abb_irb4600_support, '
    'irb4600_40_255); no source of link masses was opened, so there are none; acceleration is an '
    'estimate (full speed in 0.25 s)',
    'joints': joints('joint_', _ROWS),
}
"""The robot file, with the source of its numbers."""
