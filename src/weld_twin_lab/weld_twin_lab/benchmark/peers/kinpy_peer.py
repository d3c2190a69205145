# Copyright 2026 weld_twin contributors
# SPDX-License-Identifier: Apache-2.0
"""kinpy, in a Python loop over a chain it reads from URDF."""

from __future__ import annotations

import kinpy
import numpy as np
from scipy.spatial.transform import Rotation

from weld_twin_core.arm.robot import Robot
from weld_twin_core.arrays import Array

from ..arms import links
from . import Peer


def make(robot: Robot) -> Peer:
    """Return the peer."""
    chain = kinpy.build_serial_chain_from_urdf(_urdf(robot), 'tool', 'base')

    def single(q: Array) -> Array:
        return np.asarray(chain.forward_kinematics(q).matrix())

    def poses(q: Array) -> Array:
        return np.stack([single(one) for one in q])

    def screws(q: Array) -> tuple[Array, Array]:
        return poses(q), np.stack([chain.jacobian(one) for one in q])

    return Peer(poses, screws, single=single)


def _urdf(robot: Robot) -> str:
    *placements, tool = links(robot)
    names = ['base', *(f'link{i}' for i in range(robot.n)), 'tool']
    parts = [f'<link name="{name}"/>' for name in names]
    for i, placement in enumerate([*placements, tool]):
        kind = 'fixed' if i == robot.n else 'continuous'
        turn = Rotation.from_matrix(placement[:3, :3]).as_euler('xyz')
        xyz, rpy = (
            ' '.join(repr(float(v)) for v in vector) for vector in (placement[:3, 3], turn)
        )
        parts.append(
            f'<joint name="q{i}" type="{kind}"><parent link="{names[i]}"/>'
            f'<child link="{names[i + 1]}"/><origin xyz="{xyz}" rpy="{rpy}"/>'
            '<axis xyz="0 0 1"/></joint>'
        )
    return f'<robot name="arm">{"".join(parts)}</robot>'
