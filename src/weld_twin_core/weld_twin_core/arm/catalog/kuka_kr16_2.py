# Copyright 2026 weld_twin contributors
# SPDX-License-Identifier: Apache-2.0
"""
KUKA KR 16-2, in modified (Craig) DH form.

KUKA turns A1 and A6 clockwise seen from outside, so the last row's z looks into the wrist; the
half turn in ``tool`` makes the tool frame KUKA's $FLANGE. A tool of one's own goes after it.
"""

from math import pi

from .rows_in_degrees import joints

_ROWS = (
    (0.0, pi, -0.675, 0.0, -185.0, 185.0, 156.0),
    (0.26, pi / 2, 0.0, 0.0, -155.0, 35.0, 156.0),
    (0.68, 0.0, 0.0, -pi / 2, -130.0, 154.0, 156.0),
    (-0.035, pi / 2, -0.67, 0.0, -350.0, 350.0, 330.0),
    (0.0, -pi / 2, 0.0, 0.0, -130.0, 130.0, 330.0),
    (0.0, pi / 2, -0.158, pi, -350.0, 350.0, 615.0),
)
"""a, alpha, d, theta at zero, lower, upper and speed in degrees; else m and rad."""

DATA = {
    'name': 'kuka_kr16_2',
    'convention': 'modified',
    'source': 'geometry, range and speed from the URDF of ROS-Industrial (kuka_kr16_support, '
    'kr16_2), whose masses are place-holders; no source of link masses was opened, so there are '
    'none; acceleration is an estimate (full speed in 0.25 s)',
    'tool': {'quat_xyzw': [1.0, 0.0, 0.0, 0.0]},
    'joints': joints('joint_a', _ROWS),
}
"""The robot file, with the source of its numbers."""
