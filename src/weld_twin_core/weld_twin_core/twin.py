# SPDX-FileCopyrightText: weld_twin contributors
# SPDX-License-Identifier: Apache-2.0
"""The twin: a robot and effects in, poses and their derivatives out; in bulk or live."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass, replace
from typing import Any, NamedTuple

import numpy as np

from .arrays import Array
from .chain import Channel, Frames, Shift, column
from .dynamics import chain_gravity_torque, wrench_torque
from .effects.base import Effect, MemoryEffect, Parameter, Stage, View
from .recording import JointMotion, Recording
from .robot import Robot
from .rotation import rotation_matrix

POINTWISE = (Stage.JOINT, Stage.LOAD, Stage.ELASTIC, Stage.LINK, Stage.POSE)


class Poses(NamedTuple):
    """Tool poses in the world frame: position (..., M, 3) [m], rotation (..., M, 3, 3)."""

    position: Array
    rotation: Array


class Component(NamedTuple):
    """One differentiable scalar of one effect."""

    effect: int
    parameter: Parameter
    index: int | None


@dataclass(frozen=True, eq=False)
class Evaluation:
    """Everything one pass through the stages found out; `Twin` turns it into results."""

    view: View
    chain: Frames
    poses: Poses
    tangents: tuple[tuple[int, int, Shift], ...] = ()


@dataclass(frozen=True, eq=False)
class Twin:
    """
    A robot with the effects that are believed to act on it.

    Attributes
    ----------
    robot : Robot
    effects : tuple of Effect
        Order does not matter: stages decide.

    """

    robot: Robot
    effects: tuple[Effect, ...] = ()

    def __post_init__(self) -> None:
        ordered: Sequence[Effect] = tuple(self.effects)
        for effect in ordered:
            effect.check(self.robot)
        object.__setattr__(self, 'effects', tuple(ordered))

    # Results ---------------------------------------------------------------------------------

    def poses(self, recording: Recording, at: Array | None = None) -> Poses:
        """
        Return tool poses.

        Parameters
        ----------
        recording : Recording
        at : array, shape (M,) [s], optional
            Stamps of the measurement clock; left out, the instants of the joint stamps.

        """
        return self._evaluate(recording, at, False).poses

    def joints(self, recording: Recording, at: Array | None = None) -> Array:
        """Return the joint positions behind the poses, shape (..., M, n)."""
        view = self._evaluate(recording, at, False).view
        parts = [
            np.asarray(view.q[..., i] + view.shift.get(('q', i), 0.0)) for i in range(self.robot.n)
        ]
        return np.stack(np.broadcast_arrays(*parts), axis=-1)

    def components(self) -> tuple[Component, ...]:
        """Return the differentiable scalars, in the order of the columns of `linearise`."""
        return tuple(
            Component(k, parameter, index)
            for k, effect in enumerate(self.effects)
            for parameter, index in effect.components()
            if parameter.differentiable
        )

    def linearise(self, recording: Recording, at: Array | None = None) -> tuple[Poses, Array]:
        """
        Return the poses and d pose / d components, shape (..., M, 6, P), linear part first.

        Exact for each effect and for effects of different kinds together, but for products of
        two small displacements (a spring's torque at the displaced joint, the scale of a
        displaced point).
        """
        run = self._evaluate(recording, at, True)
        columns = [self.pose_change(run, shift) for _, _, shift in run.tangents]
        if not columns:
            return run.poses, np.zeros(run.poses.position.shape[:-1] + (6, 0))
        stacked = np.stack(np.broadcast_arrays(*columns), axis=1)
        return run.poses, np.moveaxis(stacked, (0, 1), (-2, -1))

    @property
    def delay(self) -> float:
        """Return how late the measurement stamps are, in total [s]."""
        return float(sum(effect.vector()[0] for effect in self._of(Stage.CLOCK)))

    def pose_change(self, run: Evaluation, shift: Shift) -> Array:
        """Return the change of pose, shape (6, ...), that a small change of channels makes."""
        total: Array | float = 0.0
        for channel, value in shift.items():
            for direct, factor in self.direct(channel):
                total = total + factor * value * column(
                    self.robot, run.chain, direct, run.view.shift
                )
        return np.asarray(total)

    def direct(self, channel: Channel) -> list[tuple[Channel, Any]]:
        """Resolve a load torque into the joint motion its springs make of it."""
        if channel[0] != 'tau':
            return [(channel, 1.0)]
        return [
            (('q', channel[1]), effect.number('compliance'))
            for effect in self._of(Stage.ELASTIC)
            if self.robot.index(str(effect.site)) == channel[1]
        ]

    def _of(self, stage: Stage) -> list[Effect]:
        return [effect for effect in self.effects if effect.stage == stage]

    # Evaluation ------------------------------------------------------------------------------

    def evaluate(self, recording: Recording, at: Array | None = None) -> Evaluation:
        """Return one pass through the stages, without derivatives."""
        return self._evaluate(recording, at, False)

    def joint_view(self, recording: Recording) -> View:
        """Return what effects with memory see: the commanded motion on its own stamps."""
        motion = recording.joints
        return _view(self.robot, recording, motion.t, motion.q, motion.velocity)

    def _evaluate(self, recording: Recording, at: Array | None, want: bool) -> Evaluation:
        view, tangents = self._sampled(recording, at, want)
        return self._pointwise(view, tangents, want)

    def _sampled(
        self, recording: Recording, at: Array | None, want: bool
    ) -> tuple[View, list[tuple[int, int, Shift]]]:
        motion = recording.joints
        moved, tangents = self._memory(recording, want)
        if at is None:
            t, q, qd = motion.t, motion.q, motion.velocity
            picker = None
        else:
            t = at
            for effect in self._of(Stage.CLOCK):
                t = t - effect.displace(_clock_view(self.robot, motion))[('clock', 0)][..., :1]
            q, qd = motion.at(t)
            picker = Picker(motion, t)
        if moved is not None:
            q = q + (moved if picker is None else picker.take(moved))
            qd = qd + _rates(motion, moved, picker)
        view = _view(self.robot, recording, t, q, qd)
        if not want:
            return view, []
        picked = [
            (k, c, {key: v if picker is None else picker.pick(v) for key, v in shift.items()})
            for k, c, shift in tangents
        ]
        for k, effect in enumerate(self.effects):
            if effect.stage == Stage.CLOCK and at is not None:
                picked += _indexed(k, effect.gradient(view))
        return view, picked

    def _memory(
        self, recording: Recording, want: bool
    ) -> tuple[Array | None, list[tuple[int, int, Shift]]]:
        """Run the effects with memory on the joint stamps; displacement shape (..., N, n)."""
        motion = recording.joints
        moved: Array | None = None
        tangents: list[tuple[int, int, Shift]] = []
        for stage in (Stage.SERVO, Stage.PLAY):
            for k, effect in enumerate(self.effects):
                if effect.stage != stage:
                    continue
                assert isinstance(effect, MemoryEffect)
                q = motion.q if moved is None else motion.q + moved
                view = _view(self.robot, recording, motion.t, q, motion.velocity)
                shift, _ = effect.run(view)
                if want:
                    own = _indexed(k, effect.gradient(view))
                    tangents = [(a, b, _pushed(effect, view, s)) for a, b, s in tangents] + own
                moved = _added(moved, shift, self.robot.n)
        return moved, tangents

    def _pointwise(
        self, view: View, tangents: list[tuple[int, int, Shift]], want: bool
    ) -> Evaluation:
        slopes: dict[Channel, Any] = {}
        own: list[tuple[int, int, Shift]] = []
        for stage in POINTWISE:
            effects = [(k, e) for k, e in enumerate(self.effects) if e.stage == stage]
            if stage == Stage.LOAD and (effects or self._of(Stage.ELASTIC)):
                view = view.displaced(load_torque(view), keep_frames=True)
            for k, effect in effects:
                if want:
                    own += _indexed(k, effect.gradient(view))
                    for key, value in effect.slope(view).items():
                        slopes[key] = slopes.get(key, 0.0) + value
            for _, effect in effects:
                view = view.displaced(
                    effect.displace(view), keep_frames=stage in (Stage.LOAD, Stage.POSE)
                )
        chain = view.frames
        position, rotation = chain.position, chain.rotation
        error = [view.shift.get(('pose', k)) for k in range(6)]
        if any(e is not None for e in error[:3]):
            position = position + _stack(error[:3])
        if any(e is not None for e in error[3:]):
            rotation = rotation_matrix(_stack(error[3:])) @ rotation
        if slopes:
            tangents = [(k, c, _sloped(shift, slopes)) for k, c, shift in tangents]
        ordered = tuple(sorted(tangents + own, key=lambda item: item[:2]))
        return Evaluation(view, chain, Poses(position, rotation), ordered)

    def live(self) -> LiveTwin:
        """Return a stepper that gives the same poses one joint state at a time."""
        return LiveTwin(self)


def load_torque(view: View) -> Shift:
    """Return the load torque of every joint: links, declared payload and tool wrench."""
    chain = view.frames
    torque = chain_gravity_torque(view.robot, chain)
    if view.wrench is not None:
        torque = torque + wrench_torque(view.robot, chain, view.wrench, view.wrench_frame)
    return {('tau', i): torque[i] for i in range(view.robot.n)}


class LiveTwin:
    """
    The twin one joint state at a time, with the memory of its effects carried along.

    Changing `twin` while running keeps the memory of every effect that is still there.
    """

    def __init__(self, twin: Twin) -> None:
        self.twin = twin
        self._states: dict[tuple[str, ...], Any] = {}
        self._start: float | None = None

    def reset(self) -> None:
        """Forget the motion so far, as after a jump back in time."""
        self._states.clear()
        self._start = None

    def step(
        self,
        t: float,
        q: Array,
        qd: Array | None = None,
        wrench: Array | None = None,
        temperature: float | None = None,
        wrench_frame: str = 'tool',
    ) -> tuple[Array, Poses]:
        """
        Return the joint positions, shape (n,), and the pose, shapes (3,) and (3, 3).

        Parameters
        ----------
        t : float [s]
            Stamp; not before the one of the last call.
        q, qd : array, shape (n,)
        wrench : array, shape (6,), optional
        temperature : float, optional [degC]

        """
        if self._start is None:
            self._start = t
        stamp = np.array([t])
        view = View(
            self.twin.robot, stamp, stamp - self._start, q[None],
            np.zeros_like(q)[None] if qd is None else qd[None], False,
            None if wrench is None else wrench[None], wrench_frame,
            None if temperature is None else np.array([temperature]),
        )  # fmt: skip
        for stage in (Stage.SERVO, Stage.PLAY):
            for effect in self.twin.effects:
                if effect.stage == stage and isinstance(effect, MemoryEffect):
                    shift, self._states[effect.key] = effect.run(
                        view, self._states.get(effect.key)
                    )
                    moved = _added(None, shift, self.twin.robot.n)
                    view = replace(view, q=view.q + moved)
        run = self.twin._pointwise(view, [], False)
        joints = np.array([
            float(np.ravel(run.view.q[..., i] + run.view.shift.get(('q', i), 0.0))[0])
            for i in range(self.twin.robot.n)
        ])
        return joints, Poses(run.poses.position[0], run.poses.rotation[0])


class Picker:
    """Straight-line interpolation from joint stamps to measurement stamps, draws and all."""

    def __init__(self, motion: JointMotion, t: Array) -> None:
        if motion.static or motion.t.size < 2:
            self._low = np.abs(t[..., None] - motion.t).argmin(axis=-1)
            self._high, self._weight = self._low, np.zeros(t.shape)
        else:
            inside = np.clip(t, motion.t[0], motion.t[-1])
            self._low = np.clip(np.searchsorted(motion.t, inside) - 1, 0, motion.t.size - 2)
            self._high = self._low + 1
            span = motion.t[self._high] - motion.t[self._low]
            self._weight = (inside - motion.t[self._low]) / span

    def pick(self, values: Array) -> Array:
        """Return values (..., N) at the new stamps (..., M)."""
        if self._low.ndim == 1:
            low, high = values[..., self._low], values[..., self._high]
        else:
            shape = np.broadcast_shapes(values.shape[:-1], self._low.shape[:-1])
            wide = np.broadcast_to(values, shape + values.shape[-1:])
            index = np.broadcast_to(self._low, shape + self._low.shape[-1:])
            above = np.broadcast_to(self._high, index.shape)
            low, high = np.take_along_axis(wide, index, -1), np.take_along_axis(wide, above, -1)
        return low + self._weight * (high - low)

    def take(self, values: Array) -> Array:
        """Return values (..., N, n) at the new stamps (..., M, n)."""
        return np.moveaxis(self.pick(np.moveaxis(values, -1, -2)), -1, -2)


def _view(robot: Robot, recording: Recording, t: Array, q: Array, qd: Array) -> View:
    when = t if t.ndim == 1 else t.reshape(-1, t.shape[-1]).mean(axis=0)
    return View(
        robot, when, when - recording.joints.t[0], q, qd, recording.joints.static,
        None if recording.wrench is None else recording.wrench.at(when), recording.wrench_frame,
        None if recording.temperature is None else recording.temperature.at(when),
    )  # fmt: skip


def _clock_view(robot: Robot, motion: JointMotion) -> View:
    return View(robot, motion.t[:1], motion.t[:1], motion.q[:1], motion.q[:1])


def _indexed(k: int, gradient: list[Shift | None]) -> list[tuple[int, int, Shift]]:
    return [(k, c, shift) for c, shift in enumerate(gradient) if shift is not None]


def _pushed(effect: MemoryEffect, view: View, shift: Shift) -> Shift:
    own = ('q', view.robot.index(str(effect.site)))
    return {key: effect.push(view, v) if key == own else v for key, v in shift.items()}


def _sloped(shift: Shift, slopes: dict[Channel, Any]) -> Shift:
    return {key: value * (1.0 + slopes.get(key, 0.0)) for key, value in shift.items()}


def _added(moved: Array | None, shift: Shift, n: int) -> Array:
    for (_, i), value in shift.items():
        if moved is None:
            moved = np.zeros(value.shape + (n,))
        elif value.ndim + 1 > moved.ndim:
            moved = np.broadcast_to(moved, value.shape + (n,)).copy()
        moved[..., i] += value
    assert moved is not None
    return moved


def _rates(motion: JointMotion, moved: Array, picker: Picker | None) -> Array:
    if motion.static or motion.t.size < 2:
        return np.zeros(()) if picker is None else np.zeros(moved.shape[-1])
    rates = np.gradient(moved, motion.t, axis=-2)
    return rates if picker is None else picker.take(rates)


def _stack(parts: list[Any]) -> Array:
    filled = [np.asarray(0.0 if part is None else part) for part in parts]
    return np.stack(np.broadcast_arrays(*filled), axis=-1)
