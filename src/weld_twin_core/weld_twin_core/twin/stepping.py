# Copyright 2026 weld_twin contributors
# SPDX-License-Identifier: Apache-2.0
"""The twin one joint state at a time."""

from __future__ import annotations

from collections import Counter
from dataclasses import replace
from typing import Any

import numpy as np

from ..arm.chain import displaced_robot
from ..arm.channels import Channel
from ..arm.single_pose import SinglePose
from ..arrays import Array
from ..effects.effect import View
from ..errors import DataError
from .poses import Poses, posed
from .stages import EffectStages, added, in_series

_BESIDE = ('tau', 'pose')
"""Channels that act through the joints and behind the chain, not within it."""


class LiveTwin:
    """
    The twin one joint state at a time, with the memory of its effects carried along.

    Changing `twin` while running keeps the memory of every effect that is still there. The
    poses belong to the joint stamps; a delay of the measurement clock is the caller's to add.

    Examples
    --------
    >>> import numpy as np
    >>> import weld_twin_core as wt
    >>> robot = wt.load('ur5')
    >>> live = wt.Twin(robot, [wt.effects.Backlash('elbow_joint', width=5e-4)]).live()
    >>> for k in range(3):
    ...     q, pose = live.step(0.01 * k, np.array([0.0, 0.0, 0.01 * k, 0.0, 0.0, 0.0]))
    >>> print(f'the elbow trails by {(0.02 - q[2]) * 1e3:.2f} mrad')
    the elbow trails by 0.25 mrad

    """

    def __init__(self, twin: EffectStages) -> None:
        self._twin = twin
        self._single = SinglePose(twin.robot)
        self._others: dict[Channel, float] | None = None
        self._changed: SinglePose | None = None
        self._states: dict[tuple[Any, ...], Any] = {}
        self._start = 0.0
        self._last = -np.inf
        self._command = _Rate()
        self._moved = _Rate()

    @property
    def twin(self) -> EffectStages:
        """Return the robot with its effects."""
        return self._twin

    @twin.setter
    def twin(self, twin: EffectStages) -> None:
        self._twin = twin
        self._others = self._changed = None

    def reset(self) -> None:
        """Forget the motion so far, as after a jump back in time."""
        self._states.clear()
        self._last = -np.inf
        self._command, self._moved = _Rate(), _Rate()

    def step(
        self,
        t: float,
        q: Array,
        qd: Array | None = None,
        wrench: Array | None = None,
        temperature: float | None = None,
        wrench_frame: str = 'tool',
        effort: Array | None = None,
    ) -> tuple[Array, Poses]:
        """
        Return the joint positions, shape (n,), and the pose, shapes (3,) and (3, 3).

        Parameters
        ----------
        t : float [s]
            Stamp; not before the one of the last call.
        q : array, shape (n,) [rad or m]
        qd : array, shape (n,) [rad/s or m/s], optional
            A velocity that is left out is the step since the call before.
        wrench : array, shape (6,) [N, N m], optional
            Force and torque on the tool.
        temperature : float [degC], optional
        wrench_frame : str
            'tool' or 'base'.
        effort : array, shape (n,), optional [N m, or N of a slide]
            As the controller measured it; springs that were learned by it need it.

        Raises
        ------
        DataError
            The stamp goes back, or there is not one position for each joint.

        """
        q = self._checked(t, q)
        if not self._twin.effects:
            self._command.remember(t, q)
            # Without effects a pose costs a tenth of what the stages do.
            if self._single.robot is not self._twin.robot:
                self._single = SinglePose(self._twin.robot)
            pose = self._single(q)
            return q.copy(), Poses(pose[:3, 3], pose[:3, :3])
        if qd is None:
            qd = self._command.since_before(t, q)
        else:
            self._command.remember(t, q)
        pull, warm, measured = (
            None if side is None else np.asarray(side, dtype=np.float64)[None]
            for side in (wrench, temperature, effort)
        )
        now = np.array([t])
        motion = self.twin.robot, now, now - self._start, q[None], qd[None], False
        view = View(*motion, pull, wrench_frame, warm, measured)
        view = self.twin.displaced(self._remembered(t, view))
        joints = view.q[0].copy()
        others = {}
        for (name, i), value in view.shift.items():
            if name == 'q':
                joints[i] += np.ravel(value)[0]
            elif name not in _BESIDE:
                others[name, i] = float(np.ravel(value)[0])
        return joints, self._pose(view, joints, others)

    def _pose(self, view: View, joints: Array, others: dict[Channel, float]) -> Poses:
        """Return the pose; displacements that stay are built into the chain the second time."""
        if others != self._others:
            self._others, self._changed = others, None
            chain = Poses(view.frames.position, view.frames.rotation)
        else:
            if self._changed is None:
                self._changed = SinglePose(displaced_robot(self.twin.robot, others))
            pose = self._changed(joints)[None]
            chain = Poses(pose[:, :3, 3], pose[:, :3, :3])
        poses = posed(view, chain)
        return Poses(poses.position[0], poses.rotation[0])

    def _checked(self, t: float, q: Array) -> Array:
        robot = self._twin.robot
        q = np.asarray(q, dtype=np.float64)
        if q.shape != (robot.n,):
            raise DataError(f'robot {robot.name!r} needs {robot.n} joint positions, got {q.shape}')
        if t < self._last:
            raise DataError(
                f'the joint state at {t:.6f} s is {self._last - t:.6g} s before the one already '
                'seen; reset the twin after a jump back in time'
            )
        if self._last == -np.inf:
            self._start = t
        self._last = t
        return q

    def _remembered(self, t: float, view: View) -> View:
        """Run the effects with memory, each on what the one before left, and keep their states."""
        seen: Counter[tuple[str, ...]] = Counter()
        effects = in_series(self.twin.effects)
        if not effects:
            return view
        q = view.q
        for k, (_, effect) in enumerate(effects):
            key = (seen[effect.key], *effect.key)
            seen[effect.key] += 1
            now = replace(view, q=q) if k else view
            shift, self._states[key] = effect.run(now, self._states.get(key))
            q = added(q, shift)
        moved = self._moved.since_before(t, (q - view.q)[0])
        return replace(view, q=q, qd=view.qd + moved)


class _Rate:
    """How fast values change from one call to the next, as `recording.backward_rates` has it."""

    def __init__(self) -> None:
        self._before: tuple[float, Array] | None = None

    def remember(self, t: float, values: Array) -> None:
        """Take values whose rate is not asked for."""
        self._before = t, values.copy()

    def since_before(self, t: float, values: Array) -> Array:
        """Return the rate since the call before, shape as values [1/s]; zero at the first."""
        before = self._before
        self.remember(t, values)
        if before is None or t <= before[0]:
            return np.zeros_like(values)
        return (values - before[1]) / (t - before[0])
