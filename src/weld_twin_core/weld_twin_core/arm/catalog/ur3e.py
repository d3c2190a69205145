# Copyright 2026 weld_twin contributors
# SPDX-License-Identifier: Apache-2.0
"""Universal Robots UR3e; `ur_arm` tells which base."""

from math import pi

from .ur_arm import ARTICLE, ur_arm

DATA = ur_arm(
    'ur3e',
    f"{ARTICLE}: geometry, masses and centres, as in UR's ur_description; speed from the user "
    'manual (UR3e 5.8) as in its joint_limits.yaml, range of the elbow that of the manual, not '
    'the half of it that is set there for planners; acceleration is an estimate (full speed in '
    'about 0.2 s)',
    lengths=(0.15185, -0.24355, -0.2132, 0.13105, 0.08535, 0.0921),
    speeds=(pi, pi, pi, 2 * pi, 2 * pi, 2 * pi),
    links=[
        (1.98, [0.0, -0.02, 0.0]),
        (3.4445, [0.13, 0.0, 0.1157]),
        (1.437, [0.05, 0.0, 0.0238]),
        (0.871, [0.0, 0.0, 0.01]),
        (0.805, [0.0, 0.0, 0.01]),
        (0.261, [0.0, 0.0, -0.02]),
    ],
)
"""The robot file, with the source of its numbers."""
