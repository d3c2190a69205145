# Copyright 2026 weld_twin contributors
# SPDX-License-Identifier: Apache-2.0
"""
Yaskawa Motoman MA1440.

The base is at the floor, 0.45 m below the frame `base` of Yaskawa's controller. The flange's z
looks outward and its x up at position zero, as that of the AR2010
(the source has no frame of the flange).
"""

from math import pi

from .rows_in_degrees import joints

_ROWS = (
    (0.155, -pi / 2, 0.45, 0.0, -170.0, 170.0, 230.0),
    (0.614, pi, 0.0, -pi / 2, -90.0, 155.0, 200.0),
    (0.2, -pi / 2, 0.0, 0.0, -175.0, 240.0, 230.0),
    (0.0, pi / 2, -0.64, 0.0, -150.0, 150.0, 430.0),
    (0.0, -pi / 2, 0.0, 0.0, -135.0, 86.39, 430.0),
    (0.0, pi, -0.1, 0.0, -210.0, 210.0, 630.0),
)
"""a, alpha, d, theta at zero, lower, upper and speed in degrees; else m and rad."""

DATA = {
    'name': 'yaskawa_ma1440',
    'source': 'geometry, range and speed from the URDF of ROS-Industrial '
    '(motoman_ma1440_support), range of joint U as specified there; the masses there have no '
    'centres and are not taken; no source of link masses was opened, so there are none; '
    'acceleration is an estimate (full speed in 0.25 s)',
    'joints': joints('joint_', _ROWS, 'slurbt'),
}
"""The robot file, with the source of its numbers."""
