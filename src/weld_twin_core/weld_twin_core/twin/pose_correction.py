# Copyright 2026 weld_twin contributors
# SPDX-License-Identifier: Apache-2.0
"""
Poses moved so that the real tool goes where they meant, one after the other, at a controller's rate.

The exact solution costs more than a control cycle has. It is therefore worked out now and then, with
its slope; in between it goes on as it did. How far apart that may be is learned from how far it was off.
"""

from __future__ import annotations

from collections.abc import Callable
from math import sqrt
from typing import NamedTuple

import numpy as np

from ..arm.chain import forward, frames
from ..arm.rotation import angle_between, rotation_matrix
from ..arrays import Array
from ..effects.effect import MemoryEffect
from ..errors import DataError
from ..kernels.single_turn import turn_between, turn_matrix
from ..motion.inverse.newton import chain_jacobian, least_step, pose_error
from ..recording import JointMotion
from .goal_correction import GoalLimits, not_corrected, too_large
from .posterior import pose_covariances
from .program_correction import SINGULAR
from .program_model import ProgramModel

ROUNDS = 12
"""Newton rounds; effects are small, each takes away all but some thousandths of what is left."""
CLOSED = 1e-12
"""Error [m, rad] that is rounding."""
OPEN = 1e-9
"""Error [m, rad] that a solution must not have: that of `compensate`."""
SIDES = np.repeat((1e-3, 2e-3), 3)
"""Distances [m, rad] to either side over which a slope is taken: what bends there is below 1e-9."""
TRUSTED = np.array([5e-10, *[2e-8] * 12])
"""Error [m, rad] of a pose, and of those beside it, whose next step need not be looked at: it leaves
some thousandths, rounding of the pose and some millionths of a slope."""
EXACT = 2e-10
"""Largest error [m] that what is told between two looks should have."""
REACH = (2e-5, 5e-4, 1e-2)
"""Least, first and largest distance [m] between two exact looks; a turn counts half a metre a radian."""
ONWARD = 0.97
"""Cosine of the angle between two ways [m, rad] that go on in one direction; another bends otherwise."""
LEVER = 0.5
"""Distance [m] at which a turn of the tool counts as much as its way: between wrist and torch."""


class Looked(NamedTuple):
    """
    An exact correction.

    Attributes
    ----------
    pose : array, shape (4, 4)
        The pose that was wanted, in the robot's base.
    added : array, shape (6,) [m, rad]
        What takes it to where the tool is to be commanded.
    slope : array, shape (6, 6)
        How that changes with the pose.
    q : array, shape (n,)
        Joints of the pose that is commanded.

    """

    pose: Array
    added: Array
    slope: Array
    q: Array


class PoseCorrection:
    """
    The correction of poses of a tool that follow each other.

    Parameters
    ----------
    model : ProgramModel
        Its effects without memory are corrected; a stream does not tell where a joint will turn.
    tool : array, shape (4, 4)
        ``T_flange_tool`` that the poses are given for.

    """

    def __init__(self, model: ProgramModel, tool: Array) -> None:
        still = model.without_memory() or model
        self.model = model
        self._arm = model.arm(tool)
        self._twin = still.twin(tool)
        self._back = np.linalg.inv(model.robot.T_world_base)
        self._still = still
        self._at: Looked | None = None
        self._reach, self._bend, self._way = REACH[1], np.zeros((6, 6)), np.zeros(6)

    @property
    def looked(self) -> Looked | None:
        """Return the latest exact correction."""
        return self._at

    @property
    def left_out(self) -> list[str]:
        """Return the names of effects that are not corrected, each once."""
        memory = [e.name for e in self.model.effects if isinstance(e, MemoryEffect)]
        return list(dict.fromkeys([*not_corrected(self.model), *memory]))

    def first(self, pose: Array, near: Array) -> Looked:
        """
        Return the exact correction of a pose, found from joints near it.

        Raises
        ------
        DataError
            It cannot be reached from there.

        """
        start = self._closed(self.arm_poses, pose[None], near[None])
        return self._look(pose, start[0])

    def exact(self, pose: Array, known: Looked) -> Looked:
        """
        Return the exact correction of a pose, found from one near it.

        Raises
        ------
        DataError
            It cannot be reached.

        """
        poses = _around(pose)
        way, size = _away(known, pose)
        told = _told(known, self._bend, way, size) + between(pose[None], poses) @ known.slope.T
        meant = moved(poses, told)
        chain = frames(self._arm, known.q[None])
        away = pose_error(chain, meant)
        q = known.q + least_step(chain_jacobian(self._arm, chain), away, SINGULAR)
        return self._look(pose, self._closed(self.arm_poses, meant, q), TRUSTED)

    def adopt(self, looked: Looked | None) -> None:
        """Go on from an exact correction, and learn how far apart such looks may be; None forgets."""
        before, self._at = self._at, looked
        if before is None or looked is None:
            self._reach, self._bend, self._way = REACH[1], np.zeros((6, 6)), np.zeros(6)
            return
        way, size = _away(before, looked.pose)
        told = _told(before, self._bend, way, size)
        off = float(np.linalg.norm((told - looked.added)[:3]))
        if size > REACH[0]:
            self._bend = (looked.slope - before.slope) / size
            self._way = way
        # The error of what bends evenly grows with the third power of its length.
        best = size * float(np.cbrt(EXACT / max(off, 1e-2 * EXACT)))
        best = min(best, 1.5 * self._reach) if off < EXACT else best
        self._reach = float(np.clip(best, REACH[0], REACH[2]))

    def added(self, pose: Array) -> tuple[Array, float]:
        """
        Return what is to be added to a pose, and how far the latest look is.

        Parameters
        ----------
        pose : array, shape (4, 4)

        Returns
        -------
        added : array, shape (6,) [m, rad]
        far : float
            Distance from the latest exact correction, in units of how far it may be.

        """
        assert self._at is not None
        way, size = _away(self._at, pose)
        onward = _onward(self._way, way)
        reach = self._reach if onward else min(self._reach, REACH[1])
        return _told(self._at, self._bend, way, size), size / reach

    def refusal(self, looked: Looked, limits: GoalLimits) -> str:
        """Return why a pose must not be corrected; empty where it may."""
        length, turn = (float(np.linalg.norm(part)) for part in np.split(looked.added, 2))
        if length > limits.length or turn > limits.turn:
            return too_large(length, turn, limits)
        robot = self.model.robot
        try:
            robot.check_positions(looked.q)
        except DataError as error:
            return str(error)
        posterior = self.model.posterior
        if posterior is None:
            return ''
        pull, warm = self.model.wrench, self.model.temperature
        found = posterior.domain.outside(
            looked.q[None],
            None,
            None if pull is None else pull[None],
            None if warm is None else np.array([warm]),
        )
        return f'outside what was recorded: {found[0].why}' if found else ''

    def doubt(self, looked: Looked) -> float:
        """Return how sure the model is of a pose: standard deviation of its distance [m], 0 unknown."""
        posterior = self.model.posterior
        if posterior is None:
            return 0.0
        recording = self._still.recording(_standing(looked.q[None]))
        spread = pose_covariances(
            posterior, self._twin, recording, recording.joints.t, self.model.setup
        )
        return float(np.sqrt(np.trace(spread[0, :3, :3])))

    def arm_poses(self, q: Array) -> Array:
        """Return where the controller has the tool, ``T_base_tool`` of postures (M, n), (M, 4, 4)."""
        return forward(self._arm, q)

    def _look(self, pose: Array, near: Array, trusted: Array | float = 0.0) -> Looked:
        """Return the solution of a pose and its slope, all seven times two poses at once."""
        poses = _around(pose)
        q = self._closed(
            self._real_poses, poses, np.broadcast_to(near, (13, near.shape[-1])), trusted
        )
        added = between(poses, forward(self._arm, q))
        slope = (added[1:7] - added[7:]) / (2.0 * SIDES[:, None])
        return Looked(pose, added[0], slope.T, q[0])

    def _closed(
        self,
        poses_of: Callable[[Array], Array],
        wanted: Array,
        q: Array,
        trusted: Array | float = 0.0,
    ) -> Array:
        """Return joints that close poses, shape (M, n); below ``trusted`` a step is not looked at."""
        size = np.full(len(q), np.inf)
        for _ in range(ROUNDS):
            error = between(poses_of(q), wanted)
            size = np.abs(error).max(axis=-1)
            if (size < CLOSED).all():
                break
            jacobian = chain_jacobian(self._arm, frames(self._arm, q))
            q = q + least_step(jacobian, error, SINGULAR)
            if (size < trusted).all():
                return np.asarray(q)
        if not size.max() < OPEN:
            raise DataError('the pose cannot be reached from where the arm stands')
        return np.asarray(q)

    def _real_poses(self, q: Array) -> Array:
        position, rotation = self._twin.poses(self._still.recording(_standing(q)))
        out = np.zeros((len(q), 4, 4))
        out[:, :3, :3], out[:, :3, 3], out[:, 3, 3] = rotation, position, 1.0
        return np.asarray(self._back @ out)


def _around(pose: Array) -> Array:
    """Return a pose and those beside it by which its slope is told, shape (13, 4, 4)."""
    return np.concatenate(
        [pose[None], moved(pose, np.concatenate([np.diag(SIDES), -np.diag(SIDES)]))]
    )


def _standing(q: Array) -> JointMotion:
    return JointMotion(np.arange(float(len(q))), q, np.zeros_like(q), True)


def _away(at: Looked, pose: Array) -> tuple[Array, float]:
    """Return the way from a look to a pose, shape (6,), and its size [m]."""
    way = between(at.pose, pose)
    return way, sqrt(way[:3] @ way[:3]) + LEVER * sqrt(way[3:] @ way[3:])


def _told(at: Looked, bend: Array, way: Array, size: float) -> Array:
    """Return what a look tells to add a way (6,) from it, its slope bent onwards with its size [m]."""
    return np.asarray(at.added + (at.slope + 0.5 * size * bend) @ way)


def _onward(before: Array, way: Array) -> bool:
    """Return whether a way goes on in the direction of the one before."""
    return bool(before @ way > ONWARD * sqrt((before @ before) * (way @ way)))


def between(start: Array, end: Array) -> Array:
    """Return what takes poses to others, shape (M, 6) [m, rad], linear part first, in fixed axes."""
    if start.ndim == end.ndim == 2:
        turned = turn_between(end[:3, :3], start[:3, :3])
        return np.array([*(end[:3, 3] - start[:3, 3]).tolist(), *turned])
    turn = angle_between(end[..., :3, :3], start[..., :3, :3])
    return np.concatenate([end[..., :3, 3] - start[..., :3, 3], turn], axis=-1)


def moved(pose: Array, twist: Array) -> Array:
    """Return poses (..., 4, 4) moved by twists (..., 6) [m, rad], shape (..., 4, 4)."""
    if twist.ndim == 1:
        one: Array = pose.copy()
        one[:3, 3] += twist[:3]
        one[:3, :3] = turn_matrix(twist[3:]) @ pose[:3, :3]
        return one
    out: Array = np.broadcast_to(pose, (*twist.shape[:-1], 4, 4)).copy()
    out[..., :3, 3] += twist[..., :3]
    out[..., :3, :3] = rotation_matrix(twist[..., 3:]) @ out[..., :3, :3]
    return out
