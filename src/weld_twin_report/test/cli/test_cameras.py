# Copyright 2026 weld_twin contributors
# SPDX-License-Identifier: Apache-2.0
"""
What cameras measured, from files to causes.

The arm, the lens and the noise are made here, with formulas of their own: homogeneous matrices of
Denavit and Hartenberg, and the distortion of the ROS documentation written out.
"""

import json

import numpy as np
import pytest
import yaml
from scipy.spatial.transform import Rotation

from weld_twin_msgs_py.bags.writer import BagWriter
from weld_twin_msgs_py.messages.to_messages import bag_messages

# theta offset, d, a, alpha of an arm that nobody sells
ROWS = np.array(
    [
        [0.0, 0.42, 0.16, -np.pi / 2],
        [-np.pi / 2, 0.0, 0.58, 0.0],
        [0.0, 0.0, 0.11, -np.pi / 2],
        [0.0, 0.61, 0.0, np.pi / 2],
        [0.0, 0.0, 0.0, -np.pi / 2],
        [0.0, 0.12, 0.0, 0.0],
    ]
)
NAMES = [f'axis_{k}' for k in range(1, 7)]


def flange(q, zeros):
    """Return the flange at joint angles (M, 6), zeros off by so much, (M, 4, 4)."""
    out = np.tile(np.eye(4), (len(q), 1, 1))
    for k, (offset, d, a, alpha) in enumerate(ROWS):
        angle = q[:, k] + offset + zeros[k]
        step = np.zeros_like(out)
        step[:, :3, :3] = (
            Rotation.from_rotvec(angle[:, None] * [0.0, 0.0, 1.0])
            * Rotation.from_rotvec([alpha, 0.0, 0.0])
        ).as_matrix()
        step[:, :3, 3] = np.stack([a * np.cos(angle), a * np.sin(angle), 0 * angle + d], axis=1)
        step[:, 3, 3] = 1.0
        out = out @ step
    return out


def robot_file(folder):
    joints = [
        dict(zip(('theta_offset', 'd', 'a', 'alpha'), map(float, row), strict=True), name=name)
        for name, row in zip(NAMES, ROWS, strict=True)
    ]
    path = folder / 'arm.yaml'
    path.write_text(yaml.safe_dump({'name': 'arm', 'convention': 'standard', 'joints': joints}))
    return path


def board_bag(path, kind, q, poses, covariance):
    """Write joint states and poses of a board, as one or another type of message."""
    make = bag_messages()
    with BagWriter(path, provenance={'static': True}) as bag:
        for k, (row, pose, own) in enumerate(zip(q, poses, covariance, strict=True)):
            ns = (k + 1) * 1_000_000_000
            where = pose[:3, 3], pose[:3, :3]
            state = make.joint_state(ns, tuple(NAMES), row, None)
            seen = (
                make.pose_with_covariance(ns, *where, own, 'camera')
                if kind == 'sure'
                else make.pose(ns, *where, 'camera')
            )
            bag.write('/joint_states', state, ns)
            bag.write('/measured/tool_pose', seen, ns)


def test_a_board_counts_less_along_the_line_of_sight(tmp_path, weld_twin):
    rng = np.random.default_rng(8)
    q = rng.uniform(-0.7, 0.7, (60, 6))
    zeros = np.array([0.0, 0.0, 1.5e-3, 0.0, 0.0, 0.0])
    board = flange(q, zeros)
    sizes = np.array([4e-5, 4e-5, 2.5e-3, 2e-3, 2e-3, 1.5e-4])
    # The board turns with the tool, and so do the directions in which it is seen well.
    sight = Rotation.from_rotvec(rng.normal(0.0, 0.3, (60, 3))).as_matrix()
    turn = np.zeros((60, 6, 6))
    turn[:, :3, :3] = turn[:, 3:, 3:] = sight
    error = np.einsum('mij,mj->mi', turn, sizes * rng.normal(size=(60, 6)))
    covariance = turn @ np.diag(sizes**2) @ np.swapaxes(turn, 1, 2)
    board[:, :3, :3] = Rotation.from_rotvec(error[:, 3:]).as_matrix() @ board[:, :3, :3]
    board[:, :3, 3] += error[:, :3]
    robot, off = robot_file(tmp_path), {}
    for kind in ('plain', 'sure'):
        board_bag(tmp_path / kind, kind, q, board, covariance)
        out = tmp_path / f'{kind} out'
        weld_twin(
            'diagnose', tmp_path / kind, '--robot', robot, '--align', 'base,tool', '--out', out
        )
        found = json.loads((out / 'diagnosis.json').read_text())
        told = {(e['effect'], e['joint']): e for e in found['verdict']['effects']}
        one = told.get(('joint_offset', 'axis_3'))
        off[kind] = 1.0 if one is None else abs(one['parameters']['offset'] - 1.5e-3)
    assert off['sure'] < 1e-4
    assert off['plain'] > 2.0 * off['sure']
