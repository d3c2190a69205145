# Copyright 2026 weld_twin contributors
# SPDX-License-Identifier: Apache-2.0
"""
Poses moved so that the real tool goes where they meant, one after the other, at a controller's rate.

The exact solution costs more than a control cycle has. It is therefore worked out now and then, with
its slope; in between it goes on as it did. How far apart that may be is learned from how far it was off.
"""

from __future__ import annotations

from math import sqrt
from typing import NamedTuple

import numpy as np

from ..arm import rotation
from ..arm.chain import forward
from ..arm.single_pose import SinglePose, turn_between, turn_matrix
from ..arrays import Array
from ..effects.effect import MemoryEffect
from ..errors import DataError
from ..motion.inverse.newton import least_step
from ..recording import JointMotion
from .goal_correction import GoalLimits, not_corrected
from .posterior import pose_covariances
from .program_correction import too_large
from .program_model import ProgramModel

_ROUNDS = 12
"""Newton rounds; with the real arm's own slope every one squares what is left."""
_SIDE = 1e-4
"""Step [rad or m] of a joint to either side over which slopes are taken: what bends there is below
1e-8, and nearly the same for both arms, whose difference counts; rounding is below 1e-11."""
_SETTLED = 1e-6
"""Step [rad or m] of all joints that is the last one: it leaves its square."""
_SINGULAR = 1e-9
"""Damping of a joint step [m^2]: invisible but within micrometres of a singularity."""
_CLOSED = 1e-11
"""Error [m, rad] that the last step may leave to first order."""
_OPEN = 1e-9
"""Error [m, rad] that a solution must not have: that of `compensate`."""
_EXACT = 2e-10
"""Largest error [m], of way and turn, that the extrapolation between two looks should have."""
_REACH = (2e-5, 5e-4, 1e-2)
"""Least, first and largest distance [m] between two exact looks; a turn counts half a metre a radian."""
_ONWARD = 0.97
"""Cosine of the angle between two ways [m, rad] that go on in one direction; another bends otherwise."""
LEVER = 0.5
"""Distance [m] at which a turn of the tool counts as much as its way: between wrist and torch."""


class Looked(NamedTuple):
    """An exact correction."""

    pose: Array
    """The pose that was wanted, in the robot's base, shape (4, 4)."""
    values: Array
    """What takes it to where the tool is commanded [m, rad], and the joints there, (6 + n,)."""
    slope: Array
    """How those change with the pose, shape (6 + n, 6)."""

    @property
    def added(self) -> Array:
        """Return what takes the pose to where the tool is to be commanded, shape (6,) [m, rad]."""
        return self.values[:6]

    @property
    def q(self) -> Array:
        """Return the joints of the pose that is commanded, shape (n,)."""
        return self.values[6:]


class PoseCorrection:
    """
    The correction of poses of a tool, ``T_flange_tool`` (4, 4), that follow each other.

    Effects without memory are corrected; a stream does not tell where a joint will turn.
    """

    def __init__(self, model: ProgramModel, tool: Array) -> None:
        still, robot = model.without_memory() or model, model.robot
        self.model, self.tool = model, tool
        self._arm = model.arm(tool)
        self._single = SinglePose(self._arm)
        self._twin = still.twin(tool)
        self._back = np.linalg.inv(robot.T_world_base)
        self._still = still
        self._at: Looked | None = None
        self._sides = _SIDE * np.concatenate(
            [np.zeros((1, robot.n)), np.eye(robot.n), -np.eye(robot.n)]
        )
        self._begin()

    def _begin(self) -> None:
        """Know nothing yet of how what is added bends."""
        self._reach, self._bend, self._way = _REACH[1], np.zeros((1, 1)), np.zeros(6)

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

        Its joints are those at which the real tool is at the pose: Newton, with the real arm's own
        slope. What is added takes the pose to where the nominal arm has the tool at them. Raises
        DataError: it cannot be reached from there.
        """
        q, size = near, np.inf
        for _ in range(_ROUNDS):
            beside = q + self._sides
            real = np.asarray(
                self._back @ self._twin.poses(self._still.recording(_standing(beside))).matrices
            )
            error, rise = between(real[0], pose), _rise(real)
            size = np.abs(error).max()
            step = least_step(rise, error, _SINGULAR)
            q = q + step
            remaining = np.abs(error - rise @ step).max()
            if remaining < _CLOSED and np.abs(step).max() < _SETTLED:
                break
        else:
            if not size < _OPEN:
                raise DataError('the pose cannot be reached from where the arm stands')
        back = least_step(rise, np.eye(6), _SINGULAR).T
        apart = _rise(forward(self._arm, beside)) - rise
        added = between(pose, self.arm_pose(q))
        return Looked(pose, np.concatenate([added, q]), np.concatenate([apart @ back, back]))

    def exact(self, pose: Array) -> Looked:
        """Return a pose's exact correction from the latest one; DataError out of reach."""
        return self.first(pose, self.joints(pose))

    def adopt(self, looked: Looked | None) -> None:
        """Go on from an exact correction, and learn how far apart such looks may be; None forgets."""
        before, self._at = self._at, looked
        if before is None or looked is None:
            self._begin()
            return
        way, size = _away(before, looked.pose)
        expected = _extrapolated(before, self._bend, way, size)
        off = _size((expected - looked.values)[:6])
        if size > _REACH[0]:
            self._bend = (looked.slope - before.slope) / size
            self._way = way
        # The error of what bends evenly grows with the third power of its length.
        best = size * float(np.cbrt(_EXACT / max(off, 1e-2 * _EXACT)))
        best = min(best, 1.5 * self._reach) if off < _EXACT else best
        self._reach = float(np.clip(best, _REACH[0], _REACH[2]))

    def added(self, pose: Array) -> tuple[Array, float]:
        """Return what is added to a pose (6,) [m, rad], and how far the look is, over its reach."""
        assert self._at is not None
        way, size = _away(self._at, pose)
        onward = bool(self._way @ way > _ONWARD * sqrt((self._way @ self._way) * (way @ way)))
        reach = self._reach if onward else min(self._reach, _REACH[1])
        return _extrapolated(self._at, self._bend, way, size)[:6], size / reach

    def joints(self, pose: Array) -> Array:
        """Return the joints commanded for a pose, shape (n,), extrapolated from the latest look."""
        assert self._at is not None
        return _extrapolated(self._at, self._bend, *_away(self._at, pose))[6:]

    def refusal(self, looked: Looked, limits: GoalLimits) -> str:
        """Return why a pose must not be corrected; empty where it may."""
        length, turn = (float(np.linalg.norm(part)) for part in np.split(looked.added, 2))
        if length > limits.length or turn > limits.turn:
            return too_large(length, turn, limits[:2])
        robot = self.model.robot
        try:
            robot.check_positions(looked.q)
        except DataError as error:
            return str(error)
        result = self.model.postures_outside(looked.q[None])
        return f'outside what was recorded: {result[0].why}' if result else ''

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

    def arm_pose(self, q: Array) -> Array:
        """Return where the controller has the tool, ``T_base_tool`` (4, 4), of a posture (n,)."""
        return self._single(q)


def _rise(poses: Array) -> Array:
    """Return d pose / d joint, shape (6, n), of a pose and those with joints to either side of it."""
    ahead, behind = np.split(poses[1:], 2)
    return np.asarray(between(behind, ahead).T / (2.0 * _SIDE))


def _standing(q: Array) -> JointMotion:
    return JointMotion(np.arange(float(len(q))), q, np.zeros_like(q), True)


def _away(at: Looked, pose: Array) -> tuple[Array, float]:
    """Return the way from a look to a pose, shape (6,), and its size [m]."""
    way = between(at.pose, pose)
    return way, _size(way)


def _size(way: Array) -> float:
    """Return the size of a way and turn (6,) [m]."""
    return sqrt(way[:3] @ way[:3]) + LEVER * sqrt(way[3:] @ way[3:])


def _extrapolated(at: Looked, bend: Array, way: Array, size: float) -> Array:
    """Return a look's value a way (6,) from it, (6 + n,), its slope bent onwards with its size."""
    return np.asarray(at.values + (at.slope + 0.5 * size * bend) @ way)


def between(start: Array, end: Array) -> Array:
    """Return what takes poses to others, shape (M, 6) [m, rad], linear part first, in fixed axes."""
    if start.ndim == end.ndim == 2:
        turned = turn_between(end[:3, :3], start[:3, :3])
        return np.array([*(end[:3, 3] - start[:3, 3]).tolist(), *turned])
    return rotation.missing(end, start)


def moved(pose: Array, twist: Array) -> Array:
    """Return poses (..., 4, 4) moved by twists (..., 6) [m, rad], shape (..., 4, 4)."""
    if twist.ndim == 1:
        one: Array = pose.copy()
        one[:3, 3] += twist[:3]
        one[:3, :3] = turn_matrix(twist[3:]) @ pose[:3, :3]
        return one
    return rotation.moved(pose, twist)
