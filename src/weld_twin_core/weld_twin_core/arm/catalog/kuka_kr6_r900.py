# Copyright 2026 weld_twin contributors
# SPDX-License-Identifier: Apache-2.0
"""
KUKA KR 6 R900 sixx (KR AGILUS), in modified (Craig) DH form.

KUKA turns A1 and A6 clockwise seen from outside, so the last row's z looks into the wrist; the
half turn in ``tool`` makes the tool frame KUKA's $FLANGE. A tool of one's own goes after it.
"""

from math import pi

from .rows_in_degrees import joints

_ROWS = (
    (0.0, pi, -0.4, 0.0, -170.0, 170.0, 360.0),
    (0.025, pi / 2, 0.0, 0.0, -190.0, 45.0, 300.0),
    (0.455, 0.0, 0.0, -pi / 2, -120.0, 156.0, 360.0),
    (0.035, pi / 2, -0.42, 0.0, -185.0, 185.0, 381.0),
    (0.0, -pi / 2, 0.0, 0.0, -120.0, 120.0, 388.0),
    (0.0, pi / 2, -0.08, pi, -350.0, 350.0, 615.0),
)
"""a, alpha, d, theta at zero, lower, upper and speed in degrees; else m and rad."""

DATA = {
    'name': 'kuka_kr6_r900',
    'convention': 'modified',
    'source': 'KUKA, "KR AGILUS sixx specification": geometry, range and speed, '
    'as in the URDF of ROS-Industrial (kuka_kr6_support); KUKA publishes the mass of the whole '
    'arm only (52 kg), so link masses and centres are an estimate; acceleration is an estimate '
    '(full speed in 0.25 s)',
    'tool': {'quat_xyzw': [1.0, 0.0, 0.0, 0.0]},
    'joints': joints('joint_a', _ROWS),
    'links': [
        {'mass': 14.0, 'com': [0.0, 0.0, 0.1]},
        {'mass': 10.0, 'com': [0.215, 0.0, 0.0]},
        {'mass': 7.0, 'com': [0.02, 0.02, 0.0]},
        {'mass': 4.0, 'com': [0.0, 0.0, 0.15]},
        {'mass': 1.5, 'com': [0.0, 0.0, 0.0]},
        {'mass': 0.4, 'com': [0.0, 0.0, 0.01]},
    ],
}
"""The robot file, with the source of its numbers."""
