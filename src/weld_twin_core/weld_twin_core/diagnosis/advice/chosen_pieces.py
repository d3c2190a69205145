# Copyright 2026 weld_twin contributors
# SPDX-License-Identifier: Apache-2.0
"""Which pieces of a measurement to make: each adds most to the decision, until it is safe."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass, field, replace

import numpy as np

from ...arrays import Array
from ...recording import JointMotion
from ..algebra.problem import Model, Problem, Scale
from .candidates import STAY, Candidate
from .postures import Limits, joined
from .separation import Explanation, Parting, Side, partings

DECIDES = 6.0
"""Standard deviations from which a measurement decides between two explanations."""
NOTHING = DECIDES / 2.0
"""Standard deviations below which it changes no verdict."""
_MARGIN = 2.5
"""Factor by which an experiment parts explanations more than a decision needs: effects are as large as
they are believed to be, and a diagnosis counts fewer independent samples than foreseen. With 1.5, two
experiments that were to part theirs by 9 and 12 standard deviations did not."""
LEAST = 75.0
"""Time [s] of an experiment at least: what nobody thought of shows only where there is room for it."""
_NAMED = 3.0
"""Weight of what parts explanations that a verdict names beside each other, against what parts one of
them from others: that question is put to whoever reads the verdict. A judgement."""
_AS_IT_WORKS = ('time', 'temperature')
"""Dependences on how long the arm has been at work: a station shows more of them the later it comes."""
_GAIN = 0.05
"""A further piece has to add this share to the decision."""
_NEAREST = 1e-3
"""Weight of what does not show yet against what does; its square is that of a second."""
SAFE = _MARGIN * DECIDES


@dataclass(frozen=True, eq=False)
class Plan:
    """A measurement with the pieces chosen, in order."""

    candidate: Candidate
    chosen: tuple[int, ...]
    score: float = 0.0
    """Sum over the explanations of what it adds, in standard deviations, no more than decides."""
    named: int = 1  # so many explanations, the first ones, are named by the verdict
    others: tuple[int, ...] = ()  # explanations that the first one is to be parted from
    known: Array = field(default_factory=lambda: np.zeros(0))
    gains: Array = field(default_factory=lambda: np.zeros(0))
    """How far the data at hand part it from them, and what is added."""

    @property
    def apart(self) -> float:
        return float(self.gains[self.gains > NOTHING].sum())

    @property
    def _most(self) -> int:
        """Return which explanation it parts most, of those named if one is parted at all."""
        named = (np.array(self.others) < self.named) & (self.gains > NOTHING)
        return int(np.where(named | ~named.any(), self.gains, -np.inf).argmax())

    @property
    def other(self) -> int:
        return self.others[self._most]

    @property
    def before(self) -> float:
        return float(self.known[self._most])

    @property
    def after(self) -> float | None:
        """Return what is added to that; None where nothing is compared."""
        return float(self.gains[self._most]) if self.others else None

    @property
    def decided(self) -> bool:
        return self.before >= SAFE

    @property
    def enough(self) -> bool:
        """Return whether every explanation that shows at all is parted safely."""
        shown = self.gains[self.gains > NOTHING]
        return bool(shown.size and shown.min() >= SAFE)

    @property
    def seconds(self) -> float:
        """Return how long the pieces take [s], without stops on the way."""
        return sum(self.candidate.pieces[k].seconds for k in self.chosen)

    def open(self, room: float) -> list[int]:
        """Return the pieces that are not in yet and fit into so many seconds with the others."""
        pieces, left = self.candidate.pieces, room - self.seconds
        return [k for k, p in enumerate(pieces) if k not in self.chosen and p.seconds <= left]

    @property
    def robot_minutes(self) -> float:
        if self.candidate.static:
            t = self.motion().t
            return float(t[-1] + self._step) / 60.0
        return self.seconds / 60.0

    @property
    def _step(self) -> float:
        t = self.candidate.recordings[0].joints.t
        return float(t[1] - t[0]) if t.size > 1 else STAY

    @property
    def minutes(self) -> float:
        return self.candidate.set_up + self.robot_minutes

    def motion(self) -> JointMotion:
        pieces = [self.candidate.pieces[k] for k in self.chosen]
        if self.candidate.static:
            joints = self.candidate.recordings[0].joints
            rows = [row for piece in pieces for row in piece.rows or ()]
            q = self.candidate.room.linked(joints.q[rows])
            t: Array = self._step * np.arange(len(q), dtype=np.float64)
            return JointMotion(t, q, static=True)
        return joined(*(self.candidate.recordings[piece.recording].joints for piece in pieces))


def planned(
    problem: Problem,
    model: Model,
    alternatives: Sequence[Explanation],
    scale: Scale,
    limits: Limits,
    option: Candidate,
    now: Side,
    named: int = 1,
) -> Plan | None:
    """Return the best pieces of a measurement; None where none of them fits into the minutes."""
    room = 60.0 * min(limits.minutes - option.set_up, limits.moving)
    plan = Plan(option, (), named=named)
    if (option.whole and sum(p.seconds for p in option.pieces) > room) or not plan.open(room):
        return None
    every = partings(problem, model, alternatives, scale, option, now)
    known = np.array([parting.before.mean() for parting in every])
    # What the data at hand decide already is no question, unless nothing else is left.
    asked = np.flatnonzero((known < SAFE) | (known >= SAFE).all())
    others = tuple((asked + 1).tolist())
    plan = replace(plan, others=others, known=known[asked], gains=np.zeros(asked.size))
    # Stations are foreseen one after the other; any other choice of them would come sooner.
    in_turn = option.static and any(e.on in _AS_IT_WORKS for each in alternatives for e in each)
    while more := plan.open(room)[: 1 if in_turn else None]:
        longer = _longer(plan, [every[k] for k in asked], more)
        if plan.seconds >= LEAST and (plan.enough or longer.score < (1.0 + _GAIN) * plan.score):
            break
        plan = replace(longer, score=max(longer.score, plan.score))
    # Stops on the way take time as well.
    while plan.robot_minutes * 60.0 > room and len(plan.chosen) > 1 and not option.whole:
        plan = replace(plan, chosen=plan.chosen[:-1])
    return plan


def _longer(plan: Plan, asked: Sequence[Parting], more: Sequence[int]) -> Plan:
    """Return the plan with the piece that adds most for its time."""
    gains = np.array([parting.gained(plan.chosen, more) for parting in asked])
    weight = np.where(np.array(plan.others) < plan.named, _NAMED, 1.0)
    scores = weight @ np.where(gains > NOTHING, np.minimum(gains, SAFE), 0.0)
    # While nothing shows yet, what comes nearest to it; of what is alike, the shortest.
    seconds = np.array([plan.candidate.pieces[k].seconds for k in more])
    best = int(np.argmax(scores + _NEAREST * gains.sum(axis=0) - _NEAREST**2 * seconds))
    chosen = (*plan.chosen, more[best])
    return replace(plan, chosen=chosen, score=float(scores[best]), gains=gains[:, best])


def widening(problem: Problem, options: Sequence[Candidate], limits: Limits) -> Plan:
    """Return a measurement that shows more of the arm than the data, whatever is in doubt."""
    wanted = ('bidirectional', 'stations') if problem.at_rest else ('path',)
    room = 60.0 * min(limits.minutes, limits.moving)
    for kind in wanted:
        plan = Plan(next(option for option in options if option.kind == kind), ())
        for k in _by_turns(len(plan.candidate.pieces), plan.candidate.alone):
            if plan.seconds < 2.0 * LEAST and k in plan.open(room):
                plan = replace(plan, chosen=(*plan.chosen, k))
        if plan.chosen:
            return plan
    return replace(plan, chosen=(0,))


def _by_turns(count: int, alone: int) -> list[int]:
    """Return pieces so that those of all joints and those of one joint alone take turns."""
    together, single = list(range(count - alone)), list(range(count - alone, count))
    shorter = min(len(together), len(single))
    turns = [k for pair in zip(together, single, strict=False) for k in pair]
    return turns + together[shorter:] + single[shorter:]
