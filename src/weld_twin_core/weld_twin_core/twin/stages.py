# Copyright 2026 weld_twin contributors
# SPDX-License-Identifier: Apache-2.0
"""
The stages of a twin: what effects do to samples, in bulk and live alike.

Those with memory run over the joint stream, in series: each on what the last one left. What they
displace on the joint clock is looked up at the measurements' stamps.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass, replace
from typing import Any

import numpy as np

from ..arm.chain import Frames
from ..arm.channels import Channel, Shift
from ..arm.dynamics import chain_gravity_torque, torque_slope, wrench_torque
from ..arm.robot import Robot
from ..arrays import Array
from ..effects.effect import Effect, MemoryEffect, Stage, View
from ..errors import ModelError
from ..recording import JointMotion, backward_rates
from .poses import Poses, posed

Tangent = tuple[int, int, Shift]
"""Effect, component, and the derivative of the channels by it."""


def in_series(effects: Sequence[Effect]) -> list[tuple[int, MemoryEffect]]:
    """Return the effects with memory and their place in the list, in the order they act."""
    return [
        (k, effect)
        for stage in (Stage.SERVO, Stage.PLAY)
        for k, effect in enumerate(effects)
        if effect.stage == stage and isinstance(effect, MemoryEffect)
    ]


def run_all(
    effects: Sequence[Effect], view: View, want: bool
) -> tuple[Array | None, list[Tangent]]:
    """Return joints' displacements, shape (..., N, n) or None, and, if wanted, derivatives."""
    moved: Array | None = None
    tangents: list[Tangent] = []
    for k, effect in in_series(effects):
        now = view if moved is None else replace(view, q=view.q + moved)
        shift, _ = effect.run(now)
        if want:
            own = indexed(k, effect.gradient(now))
            tangents = [(a, b, _pushed(effect, now, s)) for a, b, s in tangents] + own
        moved = added(np.zeros(view.q.shape) if moved is None else moved, shift)
    return moved, tangents


def indexed(k: int, gradient: Sequence[Shift | None]) -> list[Tangent]:
    """Return the tangents of effect k: those components that have a derivative."""
    return [(k, c, shift) for c, shift in enumerate(gradient) if shift is not None]


def added(joints: Array, shift: Shift) -> Array:
    """Return joint values (..., N, n) with the ('q', i) displacements (..., N) on top."""
    samples = np.broadcast_shapes(joints.shape[:-1], *(np.shape(v) for v in shift.values()))
    out = np.array(np.broadcast_to(joints, samples + joints.shape[-1:]))
    for (_, i), value in shift.items():
        out[..., i] += value
    return out


def rates(motion: JointMotion, moved: Array) -> Array | float:
    """Return how fast displacements (..., N, n) change since the joint state before [1/s]."""
    return 0.0 if motion.static else backward_rates(motion.t, moved)


def _pushed(effect: MemoryEffect, view: View, shift: Shift) -> dict[Any, Array]:
    own = ('q', view.robot.index(str(effect.site)))
    return {key: effect.push(view, v) if key == own else v for key, v in shift.items()}


class Picker:
    """Straight lines from joint stamps to stamps (M,) or (D, M) [s]; at stations the nearest."""

    def __init__(self, motion: JointMotion, t: Array) -> None:
        if motion.static or motion.t.size < 2:
            self._low = motion.nearest(t)
            self._high, self._weight = self._low, np.zeros(t.shape)
            self._rate = np.zeros(t.shape)
            return
        inside = np.clip(t, motion.t[0], motion.t[-1])
        self._low = np.clip(np.searchsorted(motion.t, inside) - 1, 0, motion.t.size - 2)
        self._high = self._low + 1
        span = motion.t[self._high] - motion.t[self._low]
        self._weight = (inside - motion.t[self._low]) / span
        self._rate = np.where(inside == t, 1.0 / span, 0.0)

    def _ends(self, values: Array) -> tuple[Array, Array]:
        """Return values (..., N) before and after every stamp, each (..., M)."""
        if self._low.ndim == 1:
            return values[..., self._low], values[..., self._high]
        shape = np.broadcast_shapes(values.shape[:-1], self._low.shape[:-1])
        wide = np.broadcast_to(values, shape + values.shape[-1:])
        low = np.broadcast_to(self._low, shape + self._low.shape[-1:])
        high = np.broadcast_to(self._high, low.shape)
        return np.take_along_axis(wide, low, -1), np.take_along_axis(wide, high, -1)

    def pick(self, values: Array) -> Array:
        """Return values (..., N) at the new stamps (..., M)."""
        low, high = self._ends(values)
        return low + self._weight * (high - low)

    def take(self, values: Array) -> Array:
        """Return values (..., N, n) at the new stamps (..., M, n)."""
        return np.stack([self.pick(joint) for joint in np.moveaxis(values, -1, 0)], axis=-1)

    def rates(self, values: Array) -> Array:
        """Return the slope of the straight lines through values (..., N, n), (..., M, n) [1/s]."""
        ends = [self._ends(joint) for joint in np.moveaxis(values, -1, 0)]
        return np.stack([self._rate * (high - low) for low, high in ends], axis=-1)


_CLOCK_ROUNDS = 3
"""Rounds that find the stamp of an instant: each leaves a ten-thousandth, the rate of a clock."""
_POINTWISE = (Stage.JOINT, Stage.LOAD, Stage.ELASTIC, Stage.LINK, Stage.POSE)
_SETTLING_ROUNDS = 2
"""Rounds in which springs settle: each leaves a hundredth, how much a sag changes its own load, so
that a millionth of the sag is left."""


@dataclass(frozen=True, eq=False)
class Evaluation:
    """Everything one pass through the stages found out; `Twin` turns it into results."""

    view: View
    chain: Frames
    poses: Poses
    tangents: tuple[Tangent, ...] = ()


@dataclass(frozen=True, eq=False)
class EffectStages:
    """A robot with effects that act on it stage by stage."""

    robot: Robot
    effects: Sequence[Effect] = ()

    def __post_init__(self) -> None:
        object.__setattr__(self, 'effects', tuple(self.effects))
        for effect in self.effects:
            effect.check(self.robot)
        counts = {effect.draws for effect in self.effects} - {(), (1,)}
        if len(counts) > 1:
            raise ModelError(
                'the effects carry different numbers of draws: '
                f'{sorted(count for (count,) in counts)}; give all the same'
            )

    @property
    def draws(self) -> tuple[int, ...]:
        """Return the draw axis of the effects' parameters: (D,), or () for plain numbers."""
        return np.broadcast_shapes(*(effect.draws for effect in self.effects))

    def late(self, elapsed: Array | float) -> Array:
        """Return how much later instants since the first joint stamp are stamped, as given [s]."""
        instants = np.asarray(elapsed, dtype=np.float64)
        late = np.zeros(instants.shape)
        # What a clock is behind by goes by its own stamps, and these are what is asked for.
        for _ in range(_CLOCK_ROUNDS if self.of_stage(Stage.CLOCK) else 0):
            late = self.behind(np.ravel(instants + late)).reshape(instants.shape)
        return late

    def behind(self, elapsed: Array, *, static: bool = False) -> Array:
        """Return how far before their stamps (N,) measurements show the robot, (..., N) [s]."""
        still = np.zeros((1, self.robot.n))
        view = View(self.robot, elapsed, elapsed, still, still, static)
        each = [effect.displace(view)['clock', 0] for effect in self.of_stage(Stage.CLOCK)]
        return np.asarray(sum(each, start=np.zeros(elapsed.shape)))

    def of_stage(self, stage: Stage) -> list[Effect]:
        """Return the effects of one stage, in the order given."""
        return [effect for effect in self.effects if effect.stage == stage]

    def pointwise(self, view: View, tangents: Sequence[Tangent] | None = None) -> Evaluation:
        """Run the stages without memory; with derivatives behind those of what came before."""
        view, ordered = self._stages(view, tangents)
        return Evaluation(view, view.frames, posed(view), ordered)

    def displaced(self, view: View) -> View:
        """Run the stages without memory and leave the poses to the caller."""
        return self._stages(view, None)[0]

    def _stages(
        self, view: View, tangents: Sequence[Tangent] | None
    ) -> tuple[View, tuple[Tangent, ...]]:
        slopes: dict[Channel, Any] = {}
        own: list[Tangent] = []
        for stage in _POINTWISE:
            effects = [(k, e) for k, e in enumerate(self.effects) if e.stage == stage]
            if stage == Stage.LOAD:
                view = self._settled(view)
            if tangents is not None:
                for k, effect in effects:
                    own += indexed(k, effect.gradient(view))
                    for key, value in effect.twin.slope(view).items():
                        slopes[key] = slopes.get(key, 0.0) + value
            if effects and stage not in (Stage.LOAD, Stage.ELASTIC):
                shifts = [effect.displace(view) for _, effect in effects]
                view = view.displaced(*shifts, keep_frames=stage == Stage.POSE)
        before = [(k, c, _sloped(shift, slopes)) for k, c, shift in tangents or ()]
        return view, tuple(sorted(before + own, key=lambda item: item[:2]))

    def _settled(self, view: View) -> View:
        """Return the view with loads and springs, at rest where they balance: q = theta + C tau(q)."""
        loads, springs = self.of_stage(Stage.LOAD), self.of_stage(Stage.ELASTIC)
        if not loads and not springs:
            return view
        loaded = _loaded(view, loads)
        rigid = [spring.displace(loaded) for spring in springs if not spring.twin.settles]
        settling = [spring for spring in springs if spring.twin.settles]
        give = [*rigid, *(spring.displace(loaded) for spring in settling)]
        for _ in range(_SETTLING_ROUNDS if settling else 0):
            loaded = _loaded(view.displaced(*give), loads)
            give = [*rigid, *(spring.displace(loaded) for spring in settling)]
        torque = {key: value for key, value in loaded.shift.items() if key[0] == 'tau'}
        return view.displaced(torque, keep_frames=True).displaced(*give, keep_frames=not springs)

    def yielding(self, view: View) -> Array | None:
        """Return d q / d theta where springs settle: (1 - C dtau/dq)^-1, (n, n, ...); else None."""
        springs = [spring for spring in self.of_stage(Stage.ELASTIC) if spring.twin.settles]
        if not springs:
            return None
        slope = torque_slope(self.robot, view.frames, view.wrench, view.wrench_frame)
        for effect in self.of_stage(Stage.LOAD):
            slope = slope + effect.twin.load_slope(view)
        gives = -np.moveaxis(slope, (0, 1), (-2, -1))
        soft = np.zeros((*np.broadcast_shapes(gives.shape[:-2], (*self.draws, 1)), self.robot.n))
        for spring in springs:
            soft[..., self.robot.index(str(spring.site))] += spring.number('compliance')
        matrix = np.eye(self.robot.n) + soft[..., None] * gives
        return np.asarray(np.moveaxis(np.linalg.inv(matrix), (-2, -1), (0, 1)))


def load_torque(view: View) -> Shift:
    """Return the load torque of every joint: links, declared payload and tool wrench."""
    chain = view.frames
    torque = chain_gravity_torque(view.robot, chain)
    if view.wrench is not None:
        torque = torque + wrench_torque(view.robot, chain, view.wrench, view.wrench_frame)
    return {('tau', i): torque[i] for i in range(view.robot.n)}


def _loaded(view: View, loads: Sequence[Effect]) -> View:
    """Return the view with the load torques of the posture that it shows."""
    view = view.displaced(load_torque(view), keep_frames=True)
    return view.displaced(*(effect.displace(view) for effect in loads), keep_frames=True)


def _sloped(shift: Shift, slopes: dict[Channel, Any]) -> Shift:
    return {key: value * (1.0 + slopes.get(key, 0.0)) for key, value in shift.items()}
