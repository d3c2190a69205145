# Copyright 2026 weld_twin contributors
# SPDX-License-Identifier: Apache-2.0
"""Universal Robots UR5e; `ur_arm` tells which base."""

from math import pi

from .ur_arm import ARTICLE, ur_arm

DATA = ur_arm(
    'ur5e',
    f"{ARTICLE}: geometry, masses and centres, as in UR's ur_description; speed from the user "
    'manual (UR5e 5.8) as in its joint_limits.yaml, range of the elbow that of the manual, not '
    'the half of it that is set there for planners; acceleration is an estimate (full speed in '
    'about 0.2 s)',
    lengths=(0.1625, -0.425, -0.3922, 0.1333, 0.0997, 0.0996),
    speeds=6 * (pi,),
    links=[
        (3.761, [0.0, -0.02561, 0.00193]),
        (8.058, [0.2125, 0.0, 0.11336]),
        (2.846, [0.15, 0.0, 0.0265]),
        (1.37, [0.0, -0.0018, 0.01634]),
        (1.3, [0.0, 0.0018, 0.01634]),
        (0.365, [0.0, 0.0, -0.001159]),
    ],
)
"""The robot file, with the source of its numbers."""
