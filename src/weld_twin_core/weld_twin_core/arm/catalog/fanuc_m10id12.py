# Copyright 2026 weld_twin contributors
# SPDX-License-Identifier: Apache-2.0
"""
Fanuc M-10iD/12 (as ARC Mate 100iD).

Joint 3 is measured against joint 2, as in ROS drivers; the teach pendant shows it against the
ground (its J3 is the joint 3 of this model minus J2). The base is at the floor, 0.45 m below the
origin of Fanuc's world.
"""

from math import pi

from .rows_in_degrees import joints

_ROWS = (
    (0.075, -pi / 2, 0.45, 0.0, -170.0, 170.0, 260.0),
    (0.64, pi, 0.0, -pi / 2, -90.0, 145.0, 240.0),
    (0.195, -pi / 2, 0.0, 0.0, -180.0, 267.0, 260.0),
    (0.0, pi / 2, -0.7, 0.0, -190.0, 190.0, 430.0),
    (0.0, -pi / 2, 0.0, 0.0, -180.0, 180.0, 450.0),
    (0.0, pi, -0.075, 0.0, -450.0, 450.0, 720.0),
)
"""a, alpha, d, theta at zero, lower, upper and speed in degrees; else m and rad."""

DATA = {
    'name': 'fanuc_m10id12',
    'source': 'geometry, range and speed, in whole degrees, from the URDF of ROS-Industrial '
    '(fanuc_m10id_support); no source of link masses was opened, so there are none; acceleration '
    'is an estimate (full speed in 0.25 s)',
    'joints': joints('joint_', _ROWS),
}
"""The robot file, with the source of its numbers."""
