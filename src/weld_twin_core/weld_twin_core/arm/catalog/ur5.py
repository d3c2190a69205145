# Copyright 2026 weld_twin contributors
# SPDX-License-Identifier: Apache-2.0
"""Universal Robots UR5 (CB3); `ur_arm` tells which base."""

from math import pi

from .ur_arm import ARTICLE, ur_arm

DATA = ur_arm(
    'ur5',
    f'{ARTICLE} and UR5 technical specifications: geometry, masses, centres, range and speed; '
    'acceleration is an estimate (full speed in about 0.2 s)',
    lengths=(0.089159, -0.425, -0.39225, 0.10915, 0.09465, 0.0823),
    speeds=6 * (pi,),
    links=[
        (3.7, [0.0, -0.02561, 0.00193]),
        (8.393, [0.2125, 0.0, 0.11336]),
        (2.33, [0.15, 0.0, 0.0265]),
        (1.219, [0.0, -0.0018, 0.01634]),
        (1.219, [0.0, 0.0018, 0.01634]),
        (0.1879, [0.0, 0.0, -0.001159]),
    ],
    accelerations=6 * (15.0,),
)
"""The robot file, with the source of its numbers."""
