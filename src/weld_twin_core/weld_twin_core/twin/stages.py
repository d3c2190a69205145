# Copyright 2026 weld_twin contributors
# SPDX-License-Identifier: Apache-2.0
"""The stages of a twin: what effects without memory do to samples, in bulk and live alike."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
from typing import Any

import numpy as np

from ..arm.chain import Frames
from ..arm.channels import Channel, Shift
from ..arm.dynamics import chain_gravity_torque, torque_slope, wrench_torque
from ..arm.robot import Robot
from ..arrays import Array
from ..effects.effect import Effect, Stage, View
from ..errors import ModelError
from .memory import Tangent, indexed
from .poses import Poses, posed

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
