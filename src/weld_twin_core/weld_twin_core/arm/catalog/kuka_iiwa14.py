# Copyright 2026 weld_twin contributors
# SPDX-License-Identifier: Apache-2.0
"""KUKA LBR iiwa 14 R820, seven joints."""

from math import pi

from .rows_in_degrees import joints

_ROWS = (
    (0.0, -pi / 2, 0.36, 0.0, -170.0, 170.0, 85.0),
    (0.0, pi / 2, 0.0, 0.0, -120.0, 120.0, 85.0),
    (0.0, pi / 2, 0.42, 0.0, -170.0, 170.0, 100.0),
    (0.0, -pi / 2, 0.0, 0.0, -120.0, 120.0, 75.0),
    (0.0, -pi / 2, 0.4, 0.0, -170.0, 170.0, 130.0),
    (0.0, pi / 2, 0.0, 0.0, -120.0, 120.0, 135.0),
    (0.0, 0.0, 0.126, 0.0, -175.0, 175.0, 135.0),
)
"""a, alpha, d, theta at zero, lower, upper and speed in degrees; else m and rad."""

DATA = {
    'name': 'kuka_iiwa14',
    'source': 'geometry, masses, centres, range and speed from the URDF of lbr_fri_ros2_stack '
    '(lbr_description, iiwa14); acceleration is an estimate (full speed in 0.25 s)',
    'joints': joints('lbr_A', _ROWS),
    'links': [
        {'mass': 5.289529, 'com': [0.0, 0.080096, -0.033795]},
        {'mass': 5.688888, 'com': [0.000136, 0.037548, 0.076322]},
        {'mass': 3.461245, 'com': [0.0, -0.068892, -0.034913]},
        {'mass': 4.122995, 'com': [0.0, -0.029293, 0.086944]},
        {'mass': 1.563756, 'com': [0.0, 0.116233, -0.029824]},
        {'mass': 2.457878, 'com': [0.0, 0.00032, 0.00495]},
        {'mass': 0.265331, 'com': [3e-06, -2e-06, -0.021218]},
    ],
}
"""The robot file, with the source of its numbers."""
