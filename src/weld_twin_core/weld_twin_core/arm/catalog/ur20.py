# Copyright 2026 weld_twin contributors
# SPDX-License-Identifier: Apache-2.0
"""Universal Robots UR20; `ur_arm` tells which base."""

from math import pi

from .ur_arm import ARTICLE, ur_arm

DATA = ur_arm(
    'ur20',
    f'{ARTICLE}: geometry, masses and centres, the geometry as in ur_description of '
    'ROS-Industrial; speed from the user manual (UR20 5.14) as in its joint_limits.yaml, range '
    'of the elbow that of the manual, not the half of it that is set there for planners; '
    'acceleration is an estimate (full speed in about 0.2 s)',
    lengths=(0.2363, -0.862, -0.7287, 0.201, 0.1593, 0.1543),
    speeds=(2 * pi / 3, 2 * pi / 3, 5 * pi / 6, 7 * pi / 6, 7 * pi / 6, 7 * pi / 6),
    links=[
        (16.343, [0.0, -0.061, 0.0062]),
        (29.632, [0.5226, 0.0, 0.2098]),
        (7.879, [0.3234, 0.0, 0.0604]),
        (3.054, [0.0, -0.0026, 0.0393]),
        (3.126, [0.0, 0.0024, 0.0379]),
        (0.846, [0.0, -0.0003, -0.0318]),
    ],
)
"""The robot file, with the source of its numbers."""
