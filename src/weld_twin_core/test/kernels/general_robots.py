# Copyright 2026 weld_twin contributors
# SPDX-License-Identifier: Apache-2.0
"""Robots without a single zero, one or right angle in their geometry."""

import numpy as np

from weld_twin_core.arm.robot import Robot
from weld_twin_core.arm.rotation import rotation_matrix, transform


def general_robot(
    n: int, convention: str = 'standard', *, beta: bool = True, slides: tuple[int, ...] = ()
) -> Robot:
    rng = np.random.default_rng(n)
    frames = [transform(rotation_matrix(rng.normal(size=3)), rng.normal(size=3)) for _ in 'bt']
    rows = {key: rng.normal(size=n) for key in ('a', 'alpha', 'd', 'theta')}
    wide = np.full(n, 10.0)
    return Robot(
        name='general',
        joint_names=tuple(f'joint{i}' for i in range(n)),
        **rows,
        beta=rng.normal(size=n) * beta,
        prismatic=np.isin(np.arange(n), slides),
        lower=-wide,
        upper=wide,
        max_velocity=wide,
        max_acceleration=wide,
        convention=convention,
        T_world_base=frames[0],
        T_flange_tool=frames[1],
    )


CASES = {
    'six joints': (6, 'standard', ()),
    'seven joints': (7, 'standard', ()),
    'one joint': (1, 'standard', ()),
    'two joints': (2, 'modified', ()),
    'modified rows': (6, 'modified', ()),
    'sliding joints': (6, 'standard', (0, 3)),
    'modified rows that slide': (7, 'modified', (1, 6)),
}
