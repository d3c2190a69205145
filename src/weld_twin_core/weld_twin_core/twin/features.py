# Copyright 2026 weld_twin contributors
# SPDX-License-Identifier: Apache-2.0
"""
What an effect that is not in the twin would do to the poses, to first order.

One pass of the twin is shared by every effect looked at: its views, its interpolation and the
derivative of the pose by each channel are computed once.
"""

from __future__ import annotations

from collections.abc import Callable, Sequence
from dataclasses import replace
from functools import cached_property

import numpy as np

from ..arm.channels import Channel, Shift
from ..arm.robot import Robot
from ..arrays import Array
from ..effects.effect import Effect, Stage, View
from ..recording import JointSignal, Recording
from .stages import Evaluation, Picker, load_torque
from .twin import Twin

_SLOW = 0.03
"""Half of the time [s] over which a joint's acceleration is taken: a spring that swings at 10 to 50 Hz
follows no faster, and neither a corner of a program nor an encoder's noise is an acceleration."""
_RINGS = 0.1
"""Time [s] after an acceleration in which the tool still swings: one to five times at 10 to 50 Hz."""
Remembered = tuple[bytes, str, bytes]
"""Instants looked at, effect and its parameters to the last digit."""


class Features:
    """
    First-order features of effects, for one recording and one set of stamps.

    They are taken where the effects of a twin act, at stamps (M,) [s]. ``remembered`` keeps what
    effects with memory make of the commanded motion, which no frame and no other effect changes:
    features of one recording at other models may share it.
    """

    def __init__(
        self,
        twin: Twin,
        recording: Recording,
        at: Array,
        remembered: dict[Remembered, list[Shift]] | None = None,
    ) -> None:
        self.twin = twin
        self.recording = recording
        self.at = at
        self._remembered = {} if remembered is None else remembered

    @cached_property
    def run(self) -> Evaluation:
        """Return the twin's own pass."""
        return self.twin.evaluate(self.recording, self.at)

    @cached_property
    def _columns(self) -> Callable[[Channel], Array]:
        return self.twin.columns(self.run)

    @cached_property
    def view(self) -> View:
        """Return what pointwise effects see, with load torques."""
        view = self.run.view
        if any(channel[0] == 'tau' for channel in view.shift):
            return view
        return view.displaced(load_torque(view), keep_frames=True)

    @cached_property
    def reach(self) -> tuple[Array, Array]:
        """Return the least and the most of every joint at the measurements, shape (n,) each."""
        return self.view.q.min(axis=0), self.view.q.max(axis=0)

    @cached_property
    def joint_view(self) -> View:
        """Return what effects with memory see: the joint stream on its own stamps."""
        return self.twin.joint_view(self.recording)

    @cached_property
    def acceleration(self) -> Array:
        """Return how springs see joints accelerated, shape (M, n) [rad/s^2, or m/s^2 of a slide]."""
        return self._accelerated(0.0)

    @cached_property
    def shaken(self) -> Array:
        """Return the largest size of `acceleration` that a spring still rings of, shape (M, n)."""
        lags = np.linspace(0.0, _RINGS, 5)
        return np.asarray(np.max([np.abs(self._accelerated(lag)) for lag in lags], axis=0))

    def _accelerated(self, before: float) -> Array:
        motion, t = self.recording.joints, self.run.view.t - before
        low, high = (np.clip(t + way, *motion.t[[0, -1]]) for way in (-_SLOW, _SLOW))
        span = (high - low)[:, None]
        change = motion.at(high)[1] - motion.at(low)[1]
        return np.divide(change, span, out=np.zeros_like(change), where=span > 0.0)

    def column(self, channel: Channel) -> Array:
        """Return d pose / d channel, shape (6, M)."""
        return self._columns(channel)

    def pose_change(self, shift: Shift) -> Array:
        """Return the change of pose, shape (6, M), that displaced channels make."""
        return self.twin.pose_change(shift, self.column, self.at.shape)

    def shifts(self, effect: Effect, atoms: bool = True) -> list[Shift]:
        """Return the effect's linear features (or fit-coordinate derivatives) at the stamps."""
        if effect.stage not in (Stage.SERVO, Stage.PLAY):
            return effect.atoms(self.view) if atoms else effect.fit.coordinate_shifts(self.view)
        if not atoms:
            return self._picked(effect.fit.coordinate_shifts(self.joint_view))
        key = self._clock, repr(effect), effect.vector().tobytes()
        if key not in self._remembered:
            self._remembered[key] = self._picked(effect.atoms(self.joint_view))
        return self._remembered[key]

    def _picked(self, result: Sequence[Shift]) -> list[Shift]:
        """Return shifts on the joint clock at the stamps of the measurements."""
        pick = self._picker.pick
        return [{key: pick(value) for key, value in shift.items()} for shift in result]

    @cached_property
    def _picker(self) -> Picker:
        return Picker(self.recording.joints, self.run.view.t)

    @cached_property
    def _clock(self) -> bytes:
        """Return the instants of the measurements, as a key: a delay in the twin shifts them."""
        return self.run.view.t.tobytes()

    def columns(self, effect: Effect, atoms: bool = True) -> Array:
        """Return the effect's features as pose changes, shape (K, 6, M)."""
        return self.changes(self.shifts(effect, atoms))

    def changes(self, shifts: Sequence[Shift]) -> Array:
        """Return changes of channels as changes of pose, shape (K, 6, M)."""
        channels = list({channel for shift in shifts for channel in shift})
        if len(channels) == 1 and channels[0][0] != 'tau':
            # One joint's hundred ripple orders share its column.
            sizes = np.zeros((len(shifts), 1, *self.at.shape))
            for size, shift in zip(sizes, shifts, strict=True):
                size[:] = shift.get(channels[0], 0.0)
            return sizes * self.column(channels[0])
        result = [self.pose_change(shift) for shift in shifts]
        return np.stack(result) if result else np.zeros((0, 6, self.at.size))

    def seeds(
        self, kind: type[Effect], joint: str | None, pull: Array | None = None
    ) -> tuple[list[Effect], float]:
        """Return what a search on a joint, or None, starts from by its pull (M,), and among how many."""
        view = self.joint_view if kind.stage in (Stage.SERVO, Stage.PLAY) else self.view
        seeds = list(kind.seeds(view, joint, pull))
        return seeds, kind.search.trials(view, joint) or float(len(seeds))


def joints_of(kind: type[Effect], robot: Robot) -> Sequence[str | None]:
    """Return the joints an effect can sit on, or one None for effects of the whole robot."""
    sites = robot.joint_names if kind.of in ('joint', 'link') else (None,)
    return [site for site in sites if kind.search.fits(robot, site)]


def with_expected_effort(recording: Recording, robot: Robot, load_of_effort: float) -> Recording:
    """
    Return a motion to come with the effort that the model's statics expect, where it is measured.

    ``load_of_effort`` is the load torque for each N m, 1 or -1; of 0 the motion stays as it is.
    """
    if not load_of_effort:
        return recording
    load = load_torque(Twin(robot).joint_view(recording))
    each = np.stack([load['tau', i] for i in range(robot.n)], axis=-1)
    effort = JointSignal(recording.joints.t, load_of_effort * each)
    return replace(recording, effort=effort, effort_holds=load_of_effort < 0.0)


def jumps(features: Features) -> Array:
    """Return how far effects jump from sample to sample, (M - 1, 3) [m]; no rows where nothing jumps."""
    # Recordings show the place of a jump to a sample at best, and no derivative says so.
    jumping = [e for e in features.twin.effects if e.traits.jumps]
    if not jumping or features.recording.joints.static or features.at.size < 2:
        return np.zeros((0, 3))
    jumped = [
        {channel: np.append(by, 0.0) for channel, by in e.twin.jump(features.view).items()}
        for e in jumping
    ]
    moved: Array = np.sum([features.pose_change(by)[:3, :-1].T for by in jumped], axis=0)
    return moved


def shown(features: Features, noise: float) -> float:
    """Return how many jumps a recording shows, those below a coordinate's noise [m] for less."""
    power = (jumps(features) ** 2).sum(axis=1) / (3.0 * noise**2)
    return float(np.minimum(power, 1.0).sum())
