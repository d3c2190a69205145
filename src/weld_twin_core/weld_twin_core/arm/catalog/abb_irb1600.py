# Copyright 2026 weld_twin contributors
# SPDX-License-Identifier: Apache-2.0
"""ABB IRB 1600-6/1.2."""

from math import pi

from .rows_in_degrees import joints

_ROWS = (
    (0.15, -pi / 2, 0.4865, 0.0, -180.0, 180.0, 150.0),
    (0.475, 0.0, 0.0, -pi / 2, -63.0, 110.0, 160.0),
    (0.0, -pi / 2, 0.0, 0.0, -235.0, 55.0, 170.0),
    (0.0, pi / 2, 0.6, 0.0, -200.0, 200.0, 320.0),
    (0.0, -pi / 2, 0.0, 0.0, -115.0, 115.0, 400.0),
    (0.0, 0.0, 0.065, pi, -400.0, 400.0, 450.0),
)
"""a, alpha, d, theta at zero, lower, upper and speed in degrees; else m and rad."""

DATA = {
    'name': 'abb_irb1600',
    'source': 'ABB, "Product specification IRB 1600", 3HAC023604: geometry, range, speed, as in '
    'the URDF of ROS-Industrial (abb_irb1600_support); ABB publishes the mass of the whole arm '
    'only (250 kg), so link masses and centres are an estimate; acceleration is an estimate '
    '(full speed in 0.25 s)',
    'joints': joints('joint_', _ROWS),
    'links': [
        {'mass': 80.0, 'com': [-0.1, 0.1865, 0.0]},
        {'mass': 40.0, 'com': [-0.2415, 0.0, 0.0]},
        {'mass': 40.0, 'com': [0.0, 0.0, 0.07]},
        {'mass': 18.0, 'com': [0.0, -0.2, 0.0]},
        {'mass': 5.0, 'com': [0.0, 0.0, 0.0]},
        {'mass': 1.5, 'com': [0.0, 0.0, -0.015]},
    ],
}
"""The robot file, with the source of its numbers."""
