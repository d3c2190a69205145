# Copyright 2026 weld_twin contributors
# SPDX-License-Identifier: Apache-2.0
"""
Fanuc M-20iD/25 (as ARC Mate 120iD).

Joint 3 is measured against joint 2, as in ROS drivers; the teach pendant shows it against the
ground (its J3 is the joint 3 of this model minus J2). The base is at the floor, 0.425 m below the
origin of Fanuc's world. The x axis of the flange looks down at position zero, as in the source.
"""

from math import pi

from .rows_in_degrees import joints

_ROWS = (
    (0.075, -pi / 2, 0.425, 0.0, -170.0, 170.0, 210.0),
    (0.84, pi, 0.0, -pi / 2, -100.0, 160.0, 210.0),
    (0.215, -pi / 2, 0.0, 0.0, -190.0, 268.4, 265.0),
    (0.0, pi / 2, -0.89, 0.0, -200.0, 200.0, 420.0),
    (0.0, -pi / 2, 0.0, 0.0, -140.0, 140.0, 420.0),
    (0.0, pi, -0.09, pi, -270.0, 270.0, 720.0),
)
"""a, alpha, d, theta at zero, lower, upper and speed in degrees; else m and rad."""

DATA = {
    'name': 'fanuc_m20id25',
    'source': 'geometry, range and speed from the URDF of ROS-Industrial (fanuc_m20id_support); '
    'no source of link masses was opened, so there are none; acceleration is an estimate (full '
    'speed in 0.25 s)',
    'joints': joints('joint_', _ROWS),
}
"""The robot file, with the source of its numbers."""
