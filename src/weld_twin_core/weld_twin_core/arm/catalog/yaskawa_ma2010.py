# Copyright 2026 weld_twin contributors
# SPDX-License-Identifier: Apache-2.0
"""
Yaskawa Motoman MA2010.

The base is at the floor, 0.505 m below the frame `base` of Yaskawa's controller. The flange's z
looks outward and its x up at position zero, as that of the AR2010
(the source has the axes of the flange parallel to those of the base).
"""

from math import pi

from .rows_in_degrees import joints

_ROWS = (
    (0.15, -pi / 2, 0.505, 0.0, -180.0, 180.0, 197.0),
    (0.76, pi, 0.0, -pi / 2, -105.0, 155.0, 190.0),
    (0.2, -pi / 2, 0.0, 0.0, -86.0, 160.0, 210.0),
    (0.0, pi / 2, -1.082, 0.0, -150.0, 150.0, 410.0),
    (0.0, -pi / 2, 0.0, 0.0, -135.0, 90.0, 410.0),
    (0.0, pi, -0.1, 0.0, -210.0, 210.0, 610.0),
)
"""a, alpha, d, theta at zero, lower, upper and speed in degrees; else m and rad."""

DATA = {
    'name': 'yaskawa_ma2010',
    'source': 'geometry, range and speed from the URDF of ROS-Industrial '
    '(motoman_ma2010_support); no source of link masses was opened, so there are none; '
    'acceleration is an estimate (full speed in 0.25 s)',
    'joints': joints('joint_', _ROWS, 'slurbt'),
}
"""The robot file, with the source of its numbers."""
