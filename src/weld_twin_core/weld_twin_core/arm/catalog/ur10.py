# Copyright 2026 weld_twin contributors
# SPDX-License-Identifier: Apache-2.0
"""Universal Robots UR10 (CB3); `ur_arm` tells which base."""

from math import pi

from .ur_arm import ARTICLE, ur_arm

DATA = ur_arm(
    'ur10',
    f'{ARTICLE} and UR10 technical specifications: geometry, masses, centres, range and speed; '
    'acceleration is an estimate (full speed in about 0.2 s)',
    lengths=(0.1273, -0.612, -0.5723, 0.163941, 0.1157, 0.0922),
    speeds=(2 * pi / 3, 2 * pi / 3, pi, pi, pi, pi),
    links=[
        (7.1, [0.021, 0.0, 0.027]),
        (12.7, [0.38, 0.0, 0.158]),
        (4.27, [0.24, 0.0, 0.068]),
        (2.0, [0.0, 0.007, 0.018]),
        (2.0, [0.0, 0.007, 0.018]),
        (0.365, [0.0, 0.0, -0.026]),
    ],
)
"""The robot file, with the source of its numbers."""
