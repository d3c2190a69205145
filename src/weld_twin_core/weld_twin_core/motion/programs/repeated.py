# Copyright 2026 weld_twin contributors
# SPDX-License-Identifier: Apache-2.0
"""The motion of a program again, between points that moved a little: same posture, same samples."""

from __future__ import annotations

import numpy as np

from ...arm.chain import forward
from ...arm.robot import Robot
from ...arrays import Array
from ...errors import ReachError
from ...recording import JointMotion
from ..inverse import CarriedArm
from .moves import Move, MoveProgram
from .travel import CLOSED, Piece, tool_way


def repeated(robot: Robot, program: MoveProgram, piece: Piece) -> JointMotion:
    """
    Return the motion of a piece with the same samples between points that moved a little.

    Raises ReachError: a pose is out of reach now.
    """
    q = np.array(piece.motion.q)
    for k, move in enumerate(piece.moves):
        first = 0 if k == 0 else int(piece.ends[k - 1])
        last = int(piece.ends[k])
        way = _way_length(piece, k)
        assert move.end is not None
        arm = robot.with_frames(base=np.eye(4), tool=move.tool)
        carried = CarriedArm(arm, program.external)
        if move.kind == 'joint' or way == 1:
            part = _joint_part(carried, program, move, q, first, way)
        else:
            at = max(int(piece.vias[k]) - first, 0)
            poses, _ = tool_way(arm, program, move, forward(arm, q[first]), way, at)
            part = _closed(carried, piece.motion.q[first : first + way], poses, move)
        q[first : first + way] = part
        q[first + way : last + 1] = part[-1]
    return JointMotion(piece.motion.t, q)


def unrelenting(piece: Piece, motion: JointMotion) -> JointMotion:
    """Return a motion of a piece at full speed from the first to the last place of every move."""
    steps = np.diff(motion.t)
    for k in range(len(piece.moves)):
        first = 0 if k == 0 else int(piece.ends[k - 1])
        way = slice(first, first + _way_length(piece, k) - 1)
        if steps[way].size:
            steps[way] = steps[way].min()
    return JointMotion(motion.t[0] + np.concatenate([[0.0], np.cumsum(steps)]), motion.q)


def _way_length(piece: Piece, k: int) -> int:
    """Return the number of samples of a move from where it begins to where it arrives."""
    first = 0 if k == 0 else int(piece.ends[k - 1])
    q = piece.motion.q[first : int(piece.ends[k]) + 1]
    stays = piece.moves[k].stop or k == len(piece.moves) - 1
    return len(q) - 3 if stays else len(q)


def _joint_part(
    carried: CarriedArm, program: MoveProgram, move: Move, q: Array, first: int, way: int
) -> Array:
    assert move.end is not None
    place = program.place(move.end)
    end = place
    if place.ndim == 2:
        end = _closed(carried, q[first + way - 1][None], place[None], move)[0]
    if way == 1:
        return np.asarray(end[None])
    share = np.linspace(0.0, 1.0, way)[:, None]
    return np.asarray(q[first] + share * (end - q[first]))


def _closed(carried: CarriedArm, q: Array, poses: Array, move: Move) -> Array:
    result, error = carried.polish(q, poses)
    if np.abs(error).max() > CLOSED:
        raise ReachError(f'{move.where}: out of reach, or at a singularity')
    return result
