# Copyright 2026 weld_twin contributors
# SPDX-License-Identifier: Apache-2.0
"""ABB IRB 2600-12/1.65."""

from math import pi

from .rows_in_degrees import joints

_ROWS = (
    (0.15, -pi / 2, 0.445, 0.0, -180.0, 180.0, 175.0),
    (0.7, 0.0, 0.0, -pi / 2, -95.0, 155.0, 175.0),
    (0.115, -pi / 2, 0.0, 0.0, -155.0, 75.0, 175.0),
    (0.0, pi / 2, 0.795, 0.0, -400.0, 400.0, 360.0),
    (0.0, -pi / 2, 0.0, 0.0, -120.0, 120.0, 360.0),
    (0.0, 0.0, 0.085, pi, -400.0, 400.0, 500.0),
)
"""a, alpha, d, theta at zero, lower, upper and speed in degrees; else m and rad."""

DATA = {
    'name': 'abb_irb2600_12_165',
    'source': 'geometry, range and speed from the URDF of ROS-Industrial (abb_irb2600_support, '
    'irb2600_12_165), range of joint 2 from irb2600_12_185 there, as the former has it mirrored; '
    'no source of link masses was opened, so there are none; acceleration is an estimate (full '
    'speed in 0.25 s)',
    'joints': joints('joint_', _ROWS),
}
"""The robot file, with the source of its numbers."""
