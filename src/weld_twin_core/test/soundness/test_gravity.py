# Copyright 2026 weld_twin contributors
# SPDX-License-Identifier: Apache-2.0
"""Gravity is in the base frame; where it contradicts the way the arm stands, that is warned of."""

from dataclasses import replace

import numpy as np
import pytest
from measured_cells import recorded, stations
from scipy.spatial.transform import Rotation

from weld_twin_core.arm.rotation import transform
from weld_twin_core.diagnosis.soundness.gate import examine
from weld_twin_core.diagnosis.soundness.mending import Given

G = 9.80665
CEILING, WALL = (Rotation.from_euler('x', angle, degrees=True).as_matrix() for angle in (180, 90))


def warned(robot, rng):
    found = examine(Given((recorded(robot, stations(robot, rng), rng),), robot))
    return [c.sentence for c in found.checks if c.name == 'gravity' and c.level == 'warning']


@pytest.mark.parametrize(
    ('stands', 'gravity', 'right'),
    [
        (CEILING, [0.0, 0.0, -G], '(0, 0, 9.807)'),
        (WALL, [0.0, 0.0, -G], '(0, -9.807, 0)'),
        (CEILING, [0.0, 0.0, G], None),
        (WALL, [0.0, -G, 0.0], None),
        (np.eye(3), [0.0, 0.0, -G], None),
        (np.eye(3), [0.0, 0.0, G], None),  # nothing was said of how it stands
    ],
)
def test_gravity_that_does_not_pull_down_is_warned_of(stands, gravity, right, ur5, rng):
    base = transform(stands, np.array([0.3, -0.2, 1.1]))
    told = warned(replace(ur5.with_frames(base=base), gravity=np.array(gravity)), rng)
    assert bool(told) == (right is not None)
    assert right is None or f'gravity is {right}' in told[0]
