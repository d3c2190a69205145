# Copyright 2026 weld_twin contributors
# SPDX-License-Identifier: Apache-2.0
"""
Staubli TX2-90L.

The base is at the floor, 0.478 m below the world of Staubli's controller.
"""

from math import pi

from .rows_in_degrees import joints

_ROWS = (
    (0.05, -pi / 2, 0.478, 0.0, -180.0, 180.0, 225.0),
    (0.5, 0.0, 0.0, -pi / 2, -130.0, 147.5, 180.0),
    (0.0, pi / 2, 0.05, pi / 2, -145.0, 145.0, 270.0),
    (0.0, -pi / 2, 0.55, 0.0, -270.0, 270.0, 450.0),
    (0.0, pi / 2, 0.0, 0.0, -115.0, 140.0, 370.0),
    (0.0, 0.0, 0.1, 0.0, -270.0, 270.0, 630.0),
)
"""a, alpha, d, theta at zero, lower, upper and speed in degrees; else m and rad."""

DATA = {
    'name': 'staubli_tx2_90l',
    'source': 'geometry, range and nominal speed from the URDF of ROS-Industrial '
    '(staubli_tx2_90_support); no source of link masses was opened, so there are none; '
    'acceleration is an estimate (full speed in 0.25 s)',
    'joints': joints('joint_', _ROWS),
}
"""The robot file, with the source of its numbers."""
