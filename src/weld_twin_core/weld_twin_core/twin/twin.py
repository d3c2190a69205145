# Copyright 2026 weld_twin contributors
# SPDX-License-Identifier: Apache-2.0
"""The twin: a robot and effects in, poses and their derivatives out; in bulk or live."""

from __future__ import annotations

from collections.abc import Callable, Sequence
from dataclasses import dataclass
from functools import cache, partial
from typing import Any

import numpy as np

from ..arm.chain import column, forward
from ..arm.channels import Channel, Shift
from ..arrays import Array
from ..effects.effect import Parameter, Stage, View
from ..recording import Recording
from .poses import Poses
from .stages import EffectStages, Evaluation, Picker, Tangent, indexed, rates, run_all
from .stepping import LiveTwin

__all__ = ['LiveTwin', 'Poses', 'Twin']


@dataclass(frozen=True)
class _Component:
    """One differentiable scalar of one effect."""

    effect: int
    parameter: Parameter
    index: int | None


@dataclass(frozen=True, eq=False)
class Twin(EffectStages):
    """
    A robot with the effects that are believed to act on it.

    Attributes
    ----------
    effects : sequence of Effect
        Stages decide the order; only effects with memory on one joint and of one stage run in
        the order given. Effects with parameter draws give every result a leading draw axis.

    Raises
    ------
    ModelError
        An effect that this robot cannot have, or different numbers of draws.

    Examples
    --------
    A shoulder that is 1 mrad off moves the tool of a stretched UR5 by 0.8 mm.

    >>> import numpy as np
    >>> import weld_twin_core as wt
    >>> robot = wt.load('ur5')
    >>> recording = wt.Recording('still', wt.JointMotion([0.0], np.zeros((1, 6))))
    >>> off = wt.effects.JointOffset('shoulder_pan_joint', offset=1e-3)
    >>> real = wt.Twin(robot, [off]).poses(recording)
    >>> nominal = wt.Twin(robot).poses(recording)
    >>> print(((real.position - nominal.position)[0] * 1e3).round(3), 'mm')
    [ 0.192 -0.817  0.   ] mm

    """

    # Results ---------------------------------------------------------------------------------

    def poses(self, recording: Recording, at: Array | None = None) -> Poses:
        """
        Return tool poses.

        Parameters
        ----------
        recording : Recording
            Its joint stream, and wrench and temperature where effects need them.
        at : array, shape (M,) [s], optional
            Stamps of the measurement clock; left out, the instants of the joint stamps.

        Returns
        -------
        Poses
            Position (..., M, 3) [m] and rotation (..., M, 3, 3), with a leading axis of draws
            where effects carry them.

        """
        if not self.effects:
            motion = recording.joints
            poses = forward(self.robot, motion.q if at is None else motion.at(at)[0])
            return Poses(poses[..., :3, 3], poses[..., :3, :3])
        return self._full(self.evaluate(recording, at))

    def joints(self, recording: Recording, at: Array | None = None) -> Array:
        """Return the joint positions behind `poses`, shape (..., M, n) [rad or m]."""
        view = self.evaluate(recording, at).view
        parts = [
            np.asarray(view.q[..., i] + view.shift.get(('q', i), 0.0)) for i in range(self.robot.n)
        ]
        return np.stack(np.broadcast_arrays(*parts), axis=-1)

    def components(self) -> tuple[_Component, ...]:
        """Return the differentiable scalars, in the order of the columns of `linearise`."""
        return tuple(
            _Component(k, parameter, index)
            for k, effect in enumerate(self.effects)
            for parameter, index in effect.components()
            if parameter.differentiable
        )

    def linearise(self, recording: Recording, at: Array | None = None) -> tuple[Poses, Array]:
        """
        Return the poses and d pose / d components, shape (..., M, 6, P), linear part first.

        Exact for each effect and for effects of different kinds together, but for products of
        two small displacements (a spring's torque on a longer link, the scale of a displaced
        point).

        Parameters
        ----------
        recording, at
            As for `poses`.

        Returns
        -------
        poses : Poses
        derivative : array, shape (..., M, 6, P) [m or rad per unit of the parameter]
            Columns as in `components`.

        """
        run = self.evaluate(recording, at, want=True)
        poses = self._full(run)
        columns = self.columns(run)
        out = np.empty((6, len(run.tangents), *poses.position.shape[:-1]))
        for k, (_, _, shift) in enumerate(run.tangents):
            out[:, k] = self.pose_change(shift, columns, run.chain.position.shape[:-1])
        return poses, np.moveaxis(out, (0, 1), (-2, -1))

    def columns(self, run: Evaluation) -> Callable[[Channel], Array]:
        """Return what gives d pose / d channel (6, ...) at a pass; joints move springs behind them."""
        rigid = cache(partial(column, self.robot, run.chain, shift=run.view.shift))
        yielding = self.yielding(run.view)
        if yielding is None:
            return rigid

        @cache
        def settled(channel: Channel) -> Array:
            name, i = channel
            if name != 'q':
                return rigid(channel)
            return np.asarray(sum(rigid(('q', j)) * yielding[j, i] for j in range(self.robot.n)))

        return settled

    def _full(self, run: Evaluation) -> Poses:
        """Return the poses with every draw written out, whether it moves the tool or not."""
        samples = (*self.draws, run.view.t.shape[-1])
        return Poses(
            np.broadcast_to(run.poses.position, (*samples, 3)),
            np.broadcast_to(run.poses.rotation, (*samples, 3, 3)),
        )

    def pose_change(
        self, shift: Shift, columns: Callable[[Channel], Array], shape: tuple[int, ...]
    ) -> Array:
        """Return what a shift does to poses (6, ...) by columns of channels, at a shape of samples."""
        total = np.zeros((6, *shape))
        for channel, value in shift.items():
            for direct, factor in self.direct(channel):
                total = total + factor * value * columns(direct)
        return total

    def direct(self, channel: Channel) -> list[tuple[Channel, Any]]:
        """Resolve a load torque into the joint motion its springs make of it."""
        if channel[0] != 'tau':
            return [(channel, 1.0)]
        return [
            (('q', channel[1]), effect.number('compliance'))
            for effect in self.of_stage(Stage.ELASTIC)
            if self.robot.index(str(effect.site)) == channel[1] and not effect.twin.by_effort
        ]

    # Evaluation ------------------------------------------------------------------------------

    def evaluate(
        self, recording: Recording, at: Array | None = None, *, want: bool = False
    ) -> Evaluation:
        """Return one pass through the stages, with derivatives if wanted."""
        view, tangents = self._sampled(recording, at, want)
        return self.pointwise(view, tangents if want else None)

    def joint_view(self, recording: Recording) -> View:
        """Return what effects with memory see: the commanded motion on its own stamps."""
        motion = recording.joints
        return self._seen(
            recording, motion.t, motion.q, motion.causal_velocity, recording.sides_at_joints
        )

    def _seen(
        self, recording: Recording, t: Array, q: Array, qd: Array, sides: Sequence[Array | None]
    ) -> View:
        """Return a motion at stamps with wrench, temperature and effort there."""
        motion, (wrench, temperature, effort) = recording.joints, sides
        return View(
            self.robot,
            t,
            t - motion.t[0],
            q,
            qd,
            motion.static,
            wrench,
            recording.wrench_frame,
            temperature,
            effort,
            recording.effort_holds,
            later=recording.later,
        )

    def _sampled(
        self, recording: Recording, at: Array | None, want: bool
    ) -> tuple[View, list[Tangent]]:
        motion = recording.joints
        moved, tangents = run_all(self.effects, self.joint_view(recording), want)
        if at is None:
            t, q, qd = motion.t, motion.q, motion.causal_velocity
            sides = recording.sides_at_joints
            picker = None
        else:
            t = np.asarray(at, dtype=np.float64)
            if self.of_stage(Stage.CLOCK):
                t = t - self.behind(t - motion.t[0], static=motion.static)
            q, qd, *sides = recording.at(t)
            picker = Picker(motion, t) if moved is not None or tangents else None
        if moved is not None:
            q = q + (moved if picker is None else picker.take(moved))
            qd = qd + (rates(motion, moved) if picker is None else picker.rates(moved))
        view = self._seen(recording, t, q, qd, sides)
        if not want:
            return view, []
        picked: list[Tangent] = [
            (k, c, {key: v if picker is None else picker.pick(v) for key, v in shift.items()})
            for k, c, shift in tangents
        ]
        for k, effect in enumerate(self.effects):
            if effect.stage == Stage.CLOCK:
                gradient = effect.gradient(view)
                # The instants of the joint stamps do not move with the measurement clock.
                picked += indexed(k, gradient if at is not None else [{}] * len(gradient))
        return view, picked

    def live(self) -> LiveTwin:
        """Return a stepper that gives the same poses one joint state at a time."""
        return LiveTwin(self)
