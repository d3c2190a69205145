# Copyright 2026 weld_twin contributors
# SPDX-License-Identifier: Apache-2.0
"""Franka Emika Panda, seven joints, in modified (Craig) DH form."""

from math import pi

_ROWS = (
    (0.0, 0.0, 0.333, -2.8973, 2.8973, 2.175, 15.0),
    (0.0, -pi / 2, 0.0, -1.7628, 1.7628, 2.175, 7.5),
    (0.0, pi / 2, 0.316, -2.8973, 2.8973, 2.175, 10.0),
    (0.0825, pi / 2, 0.0, -3.0718, -0.0698, 2.175, 12.5),
    (-0.0825, -pi / 2, 0.384, -2.8973, 2.8973, 2.61, 15.0),
    (0.0, pi / 2, 0.0, -0.0175, 3.7525, 2.61, 20.0),
    (0.088, pi / 2, 0.107, -2.8973, 2.8973, 2.61, 20.0),
)
"""a, alpha, d, lower, upper, speed, acceleration: m and rad unless said."""

DATA = {
    'name': 'franka_panda',
    'convention': 'modified',
    'source': 'Franka Emika, "Robot and interface specifications": geometry to the flange, range, '
    'speed and acceleration; masses and centres identified by C. Gaz et al., "Dynamic '
    'identification of the Franka Emika Panda robot", IEEE RA-L 4(4), 2019, as in the published '
    'URDF, without the hand',
    'joints': [
        {
            'name': f'panda_joint{k}',
            'a': a,
            'alpha': alpha,
            'd': d,
            'lower': lower,
            'upper': upper,
            'max_velocity': speed,
            'max_acceleration': acceleration,
        }
        for k, (a, alpha, d, lower, upper, speed, acceleration) in enumerate(_ROWS, 1)
    ],
    'links': [
        {'mass': 4.970684, 'com': [0.003875, 0.002081, -0.04762]},
        {'mass': 0.646926, 'com': [-0.003141, -0.02872, 0.003495]},
        {'mass': 3.228604, 'com': [0.027518, 0.039252, -0.066502]},
        {'mass': 3.587895, 'com': [-0.05317, 0.104419, 0.027454]},
        {'mass': 1.225946, 'com': [-0.011953, 0.041065, -0.038437]},
        {'mass': 1.666555, 'com': [0.060149, -0.014117, -0.010517]},
        # The last row ends at the flange, 0.107 m beyond the frame of the published centre.
        {'mass': 0.735522, 'com': [0.010517, -0.004252, 0.061597 - 0.107]},
    ],
}
"""The robot file, with the source of its numbers."""
