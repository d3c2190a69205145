# Copyright 2026 weld_twin contributors
# SPDX-License-Identifier: Apache-2.0
"""Universal Robots UR16e; `ur_arm` tells which base."""

from math import pi

from .ur_arm import ARTICLE, ur_arm

DATA = ur_arm(
    'ur16e',
    f"{ARTICLE}: geometry, masses and centres, as in UR's ur_description; speed from the user "
    'manual (UR16e 5.8) as in its joint_limits.yaml, range of the elbow that of the manual, not '
    'the half of it that is set there for planners; acceleration is an estimate (full speed in '
    'about 0.2 s)',
    lengths=(0.1807, -0.4784, -0.36, 0.17415, 0.11985, 0.11655),
    speeds=(2 * pi / 3, 2 * pi / 3, pi, pi, pi, pi),
    links=[
        (7.369, [0.0, -0.016, 0.03]),
        (10.45, [0.302, 0.0, 0.16]),
        (4.321, [0.194, 0.0, 0.065]),
        (2.18, [0.0, -0.009, 0.011]),
        (2.033, [0.0, 0.018, 0.012]),
        (0.907, [0.0, 0.0, -0.044]),
    ],
)
"""The robot file, with the source of its numbers."""
