# Copyright 2026 weld_twin contributors
# SPDX-License-Identifier: Apache-2.0
"""ABB IRB 120-3/0.6."""

from math import pi

from .rows_in_degrees import joints

_ROWS = (
    (0.0, -pi / 2, 0.29, 0.0, -165.0, 165.0, 250.0),
    (0.27, 0.0, 0.0, -pi / 2, -110.0, 110.0, 250.0),
    (0.07, -pi / 2, 0.0, 0.0, -110.0, 70.0, 250.0),
    (0.0, pi / 2, 0.302, 0.0, -160.0, 160.0, 320.0),
    (0.0, -pi / 2, 0.0, 0.0, -120.0, 120.0, 320.0),
    (0.0, 0.0, 0.072, pi, -400.0, 400.0, 420.0),
)
"""a, alpha, d, theta at zero, lower, upper and speed in degrees; else m and rad."""

DATA = {
    'name': 'abb_irb120',
    'source': 'ABB, "Product specification IRB 120", 3HAC035960: geometry, range, speed; masses '
    'and centres from the URDF of ROS-Industrial (abb_irb120_support), where they were taken from '
    'solid models; acceleration is an estimate (full speed in 0.25 s)',
    'joints': joints('joint_', _ROWS),
    'links': [
        {'mass': 3.067, 'com': [9.8e-05, 0.05159, -0.00012]},
        {'mass': 3.909, 'com': [-0.16876, 0.00078, -0.00212]},
        {'mass': 2.944, 'com': [-0.01209, -0.00106, 0.02281]},
        {'mass': 1.328, 'com': [0.00041, -0.0773, 0.00015]},
        {'mass': 0.546, 'com': [6.2e-05, -3.7e-05, -0.00109]},
        {'mass': 0.137, 'com': [0.0, -0.00017, -0.00706]},
    ],
}
"""The robot file, with the source of its numbers."""
