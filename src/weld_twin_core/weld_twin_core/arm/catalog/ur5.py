# SPDX-FileCopyrightText: weld_twin contributors
# SPDX-License-Identifier: Apache-2.0
"""Universal Robots UR5 (CB3)."""

from math import pi

_NAMES = (
    'shoulder_pan_joint',
    'shoulder_lift_joint',
    'elbow_joint',
    'wrist_1_joint',
    'wrist_2_joint',
    'wrist_3_joint',
)
_ROWS = (
    (0.0, pi / 2, 0.089159),
    (-0.425, 0.0, 0.0),
    (-0.39225, 0.0, 0.0),
    (0.0, pi / 2, 0.10915),
    (0.0, -pi / 2, 0.09465),
    (0.0, 0.0, 0.0823),
)
"""a, alpha, d: m and rad unless said."""

DATA = {
    'name': 'ur5',
    'source': 'Universal Robots, "DH parameters for calculations of kinematics and dynamics" '
    '(article 45257) and UR5 technical specifications: geometry, masses, centres, range and '
    'speed; acceleration is an estimate (full speed in about 0.2 s)',
    'joints': [
        {
            'name': name,
            'a': a,
            'alpha': alpha,
            'd': d,
            'lower': -2 * pi,
            'upper': 2 * pi,
            'max_velocity': pi,
            'max_acceleration': 15.0,
        }
        for name, (a, alpha, d) in zip(_NAMES, _ROWS, strict=True)
    ],
    'links': [
        {'mass': 3.7, 'com': [0.0, -0.02561, 0.00193]},
        {'mass': 8.393, 'com': [0.2125, 0.0, 0.11336]},
        {'mass': 2.33, 'com': [0.15, 0.0, 0.0265]},
        {'mass': 1.219, 'com': [0.0, -0.0018, 0.01634]},
        {'mass': 1.219, 'com': [0.0, 0.0018, 0.01634]},
        {'mass': 0.1879, 'com': [0.0, 0.0, -0.001159]},
    ],
}
"""The robot file, with the source of its numbers."""
