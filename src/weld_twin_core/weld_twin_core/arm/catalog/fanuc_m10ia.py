# Copyright 2026 weld_twin contributors
# SPDX-License-Identifier: Apache-2.0
"""
Fanuc M-10iA (as ARC Mate 100iC).

Joint 3 is measured against joint 2, as in ROS drivers; the teach pendant shows it against the
ground (its J3 is the joint 3 of this model minus J2). The base is at the floor.
"""

from math import pi

from .rows_in_degrees import joints

_ROWS = (
    (0.15, -pi / 2, 0.45, 0.0, -180.0, 180.0, 210.0),
    (0.6, pi, 0.0, -pi / 2, -90.0, 160.0, 190.0),
    (0.2, -pi / 2, 0.0, 0.0, -180.0, 264.0, 210.0),
    (0.0, pi / 2, -0.64, 0.0, -190.0, 190.0, 400.0),
    (0.0, -pi / 2, 0.0, 0.0, -190.0, 190.0, 400.0),
    (0.0, pi, -0.1, 0.0, -360.0, 360.0, 600.0),
)
"""a, alpha, d, theta at zero, lower, upper and speed in degrees; else m and rad."""

DATA = {
    'name': 'fanuc_m10ia',
    'source': 'Fanuc, "M-10iA / ARC Mate 100iC mechanical unit": geometry, range, speed, as in '
    'the URDF of ROS-Industrial (fanuc_m10ia_support); Fanuc publishes the mass of the whole arm '
    'only (130 kg), so link masses and centres are an estimate; acceleration is an estimate '
    '(full speed in 0.25 s)',
    'joints': joints('joint_', _ROWS),
    'links': [
        {'mass': 45.0, 'com': [-0.1, 0.15, 0.0]},
        {'mass': 20.0, 'com': [-0.31, 0.0, 0.0]},
        {'mass': 25.0, 'com': [-0.05, 0.0, -0.05]},
        {'mass': 10.0, 'com': [0.0, 0.24, 0.0]},
        {'mass': 3.0, 'com': [0.0, 0.0, 0.0]},
        {'mass': 1.0, 'com': [0.0, 0.0, -0.02]},
    ],
}
"""The robot file, with the source of its numbers."""
