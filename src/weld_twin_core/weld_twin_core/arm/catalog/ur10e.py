# Copyright 2026 weld_twin contributors
# SPDX-License-Identifier: Apache-2.0
"""Universal Robots UR10e; `ur_arm` tells which base."""

from math import pi

from .ur_arm import ARTICLE, ur_arm

DATA = ur_arm(
    'ur10e',
    f"{ARTICLE}: geometry, masses and centres, as in UR's ur_description; speed from the user "
    'manual (UR10e 5.8) as in its joint_limits.yaml, range of the elbow that of the manual, not '
    'the half of it that is set there for planners; acceleration is an estimate (full speed in '
    'about 0.2 s)',
    lengths=(0.1807, -0.6127, -0.57155, 0.17415, 0.11985, 0.11655),
    speeds=(2 * pi / 3, 2 * pi / 3, pi, pi, pi, pi),
    links=[
        (7.369, [0.021, 0.0, 0.027]),
        (13.051, [0.38, 0.0, 0.158]),
        (3.989, [0.24, 0.0, 0.068]),
        (2.1, [0.0, 0.007, 0.018]),
        (1.98, [0.0, 0.007, 0.018]),
        (0.615, [0.0, 0.0, -0.026]),
    ],
)
"""The robot file, with the source of its numbers."""
