# SPDX-FileCopyrightText: weld_twin contributors
# SPDX-License-Identifier: Apache-2.0
"""Universal Robots UR10 (CB3)."""

from math import pi

_ROWS = (
    ('shoulder_pan_joint', 0.0, pi / 2, 0.1273, 2 * pi / 3),
    ('shoulder_lift_joint', -0.612, 0.0, 0.0, 2 * pi / 3),
    ('elbow_joint', -0.5723, 0.0, 0.0, pi),
    ('wrist_1_joint', 0.0, pi / 2, 0.163941, pi),
    ('wrist_2_joint', 0.0, -pi / 2, 0.1157, pi),
    ('wrist_3_joint', 0.0, 0.0, 0.0922, pi),
)
"""joint, a, alpha, d, speed: m and rad unless said."""

DATA = {
    'name': 'ur10',
    'source': 'Universal Robots, "DH parameters for calculations of kinematics and dynamics" '
    '(article 45257) and UR10 technical specifications: geometry, masses, centres, range and '
    'speed; acceleration is an estimate (full speed in about 0.2 s)',
    'joints': [
        {
            'name': name,
            'a': a,
            'alpha': alpha,
            'd': d,
            'lower': -2 * pi,
            'upper': 2 * pi,
            'max_velocity': speed,
            'max_acceleration': 5.0 * speed,
        }
        for name, a, alpha, d, speed in _ROWS
    ],
    'links': [
        {'mass': 7.1, 'com': [0.021, 0.0, 0.027]},
        {'mass': 12.7, 'com': [0.38, 0.0, 0.158]},
        {'mass': 4.27, 'com': [0.24, 0.0, 0.068]},
        {'mass': 2.0, 'com': [0.0, 0.007, 0.018]},
        {'mass': 2.0, 'com': [0.0, 0.007, 0.018]},
        {'mass': 0.365, 'com': [0.0, 0.0, -0.026]},
    ],
}
"""The robot file, with the source of its numbers."""
