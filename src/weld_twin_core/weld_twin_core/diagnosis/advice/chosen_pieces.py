# Copyright 2026 weld_twin contributors
# SPDX-License-Identifier: Apache-2.0
"""Which pieces of a measurement to make: each adds most to the decision, until it is safe."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass, replace

import numpy as np

from ...arrays import Array
from ...effects.effect import Effect
from ...recording import JointMotion
from ..algebra.problem import Model, Problem, Scale
from .candidates import STAY, Candidate
from .postures import Limits
from .separation import Normals, Pair, Side, normals

DECIDES = 6.0
"""Standard deviations from which a measurement decides between two explanations."""
NOTHING = 3.0
"""Standard deviations below which it changes no verdict."""
MARGIN = 2.5
"""An experiment is made so long that it parts its explanations by this factor more than a decision
needs: how far they will part is foreseen with the effects as they are believed to be, and a diagnosis
counts fewer independent samples than are foreseen. With 1.5, two experiments that were to part theirs
by 9 and 12 standard deviations did not."""
LEAST = 75.0
"""Time [s] of an experiment at least: what nobody thought of shows only where there is room for it."""
NAMED = 3.0
"""Weight of what parts explanations that a verdict names beside each other, against what parts one of
them from others: that question is put to whoever reads the verdict. A judgement."""
AS_IT_WORKS = ('time', 'temperature')
"""Dependences on how long the arm has been at work: a station shows more of them the later it comes."""
GAIN = 0.05
"""A further piece has to add this share to the decision."""


@dataclass(frozen=True, eq=False)
class Plan:
    """
    A measurement with the pieces chosen, in order.

    Attributes
    ----------
    candidate : Candidate
    chosen : tuple of int
    score : float
        Sum over the pairs of what it adds, in standard deviations, no more than decides.
    apart : float
        The same without that bound.
    pair : tuple of int, optional
        The two explanations that it parts most.
    decided : bool
        Whether the data at hand part all explanations already.
    before, after : float
        How far the data at hand part those two, and what is added.

    """

    candidate: Candidate
    chosen: tuple[int, ...]
    score: float = 0.0
    apart: float = 0.0
    pair: Pair | None = None
    before: float = 0.0
    after: float | None = None
    decided: bool = False

    @property
    def robot_minutes(self) -> float:
        """Return how long the arm moves [min]."""
        if self.candidate.static:
            t = self.motion().t
            return float(t[-1] + self._step) / 60.0
        return sum(self.candidate.pieces[k].seconds for k in self.chosen) / 60.0

    @property
    def _step(self) -> float:
        """Return the time from station to station [s]."""
        t = self.candidate.recordings[0].joints.t
        return float(t[1] - t[0]) if t.size > 1 else STAY

    @property
    def minutes(self) -> float:
        """Return how long it takes with what has to be set up [min]."""
        return self.candidate.set_up + self.robot_minutes

    def motion(self) -> JointMotion:
        """Return the pieces one after the other."""
        pieces = [self.candidate.pieces[k] for k in self.chosen]
        if self.candidate.static:
            joints = self.candidate.recordings[0].joints
            rows = [row for piece in pieces for row in piece.rows or ()]
            q = self.candidate.room.linked(joints.q[rows])
            t: Array = self._step * np.arange(len(q), dtype=np.float64)
            return JointMotion(t, q, static=True)
        times: list[Array] = []
        places: list[Array] = []
        start = 0.0
        for piece in pieces:
            joints = self.candidate.recordings[piece.recording].joints
            first = 1 if times else 0
            times.append(start + joints.t[first:])
            places.append(joints.q[first:])
            start += float(joints.t[-1])
        return JointMotion(np.concatenate(times), np.concatenate(places))


def planned(
    problem: Problem,
    model: Model,
    alternatives: Sequence[tuple[Effect, ...]],
    scale: Scale,
    limits: Limits,
    option: Candidate,
    now: Side,
    named: int = 1,
) -> Plan | None:
    """
    Return the best pieces of a measurement; None where none of them fits into the minutes.

    The first arguments are those of `separation.normals`; ``now`` is what the alternatives say of
    the data at hand, and the first ``named`` alternatives are named by the verdict.
    """
    room = 60.0 * min(limits.minutes - option.set_up, limits.moving)
    whole = option.whole and sum(piece.seconds for piece in option.pieces) > room
    if whole or not _open(option, [], room):
        return None
    reported = normals(problem, model, alternatives, scale, option, now)
    before = reported.before()
    # Stations are foreseen one after the other; any other choice of them would come sooner.
    in_turn = option.static and any(e.on in AS_IT_WORKS for each in alternatives for e in each)
    chosen: list[int] = []
    gains: dict[Pair, float] = {}
    score = 0.0
    while True:
        spent = sum(option.pieces[k].seconds for k in chosen)
        more = _open(option, chosen, room - spent)[: 1 if in_turn else None]
        if not more or (spent >= LEAST and _enough(gains)):
            break
        pick, result, gained = _next(reported, before, chosen, more, option, named)
        if spent >= LEAST and gained < (1.0 + GAIN) * score:
            break
        chosen.append(pick)
        gains, score = result, max(score, gained)
    if not chosen:
        return None
    plan = _plan(option, chosen, score, before, gains, named)
    # Stops on the way take time as well.
    while plan.robot_minutes * 60.0 > room and len(plan.chosen) > 1 and not option.whole:
        plan = replace(plan, chosen=plan.chosen[:-1])
    return plan


def _plan(
    option: Candidate,
    chosen: Sequence[int],
    score: float,
    before: Mapping[Pair, float],
    gains: Mapping[Pair, float],
    named: int,
) -> Plan:
    first = {
        pair: gain for pair, gain in gains.items() if _is_named(pair, named) and gain > NOTHING
    }
    best = max(first or gains, key=lambda pair: gains[pair])
    apart = sum(gain for gain in gains.values() if gain > NOTHING)
    known = _mean(before, best)
    decided = known >= MARGIN * DECIDES
    return Plan(option, tuple(chosen), score, apart, best, known, gains[best], decided)


def _open(option: Candidate, chosen: Sequence[int], remaining: float) -> list[int]:
    """Return the pieces that are not in yet and fit into the seconds left."""
    return [
        k
        for k, piece in enumerate(option.pieces)
        if k not in chosen and piece.seconds <= remaining
    ]


def _next(
    reported: Normals,
    before: Mapping[Pair, float],
    chosen: Sequence[int],
    more: Sequence[int],
    option: Candidate,
    named: int,
) -> tuple[int, dict[Pair, float], float]:
    """Return the piece that adds most for its time, what pairs gain with it, and the score."""
    table: dict[Pair, Array] = {}
    pairs = sorted({(min(pair), max(pair)) for pair in before})
    # What the data at hand decide already is no question, unless nothing else is left.
    asked = [pair for pair in pairs if _mean(before, pair) < MARGIN * DECIDES] or pairs
    after = reported.added([way for pair in asked for way in (pair, pair[::-1])], chosen, more)
    for one, other in asked:
        # The mean over which of the two is true: where one contains the other, as play that may be
        # zero, only the truth of the larger one shows.
        ways = [
            np.sqrt(np.maximum(after[pair] ** 2 - before[pair] ** 2, 0.0))
            for pair in ((one, other), (other, one))
        ]
        table[one, other] = 0.5 * (ways[0] + ways[1])
    scores = np.zeros(len(more))
    for pair, values in table.items():
        weight = NAMED if _is_named(pair, named) else 1.0
        scores += weight * np.where(values > NOTHING, np.minimum(values, MARGIN * DECIDES), 0.0)
    # While nothing shows yet, what comes nearest to it.
    nearest = sum((values for values in table.values()), np.zeros(len(more)))
    seconds = np.array([option.pieces[k].seconds for k in more])
    worth = scores + 1e-3 * nearest - 1e-6 * seconds
    best = int(np.argmax(worth))
    return more[best], {pair: float(v[best]) for pair, v in table.items()}, float(scores[best])


def _is_named(pair: Pair, named: int) -> bool:
    return max(pair) < named


def _enough(gains: Mapping[Pair, float]) -> bool:
    """Return whether every pair that shows at all is parted safely."""
    shown = [gain for gain in gains.values() if gain > NOTHING]
    return bool(shown) and min(shown) >= MARGIN * DECIDES


def _mean(before: Mapping[Pair, float], pair: Pair) -> float:
    return 0.5 * (before[pair] + before[pair[1], pair[0]])


def widening(problem: Problem, options: Sequence[Candidate], limits: Limits) -> Plan:
    """Return a measurement that shows more of the arm than the data, whatever is in doubt."""
    still = problem.at_rest
    wanted = ('bidirectional', 'stations') if still else ('path',)
    room = 60.0 * min(limits.minutes, limits.moving)
    for kind in wanted:
        option = next(option for option in options if option.kind == kind)
        chosen: list[int] = []
        spent = 0.0
        for k in _by_turns(len(option.pieces), option.alone):
            seconds = option.pieces[k].seconds
            if spent < 2.0 * LEAST and spent + seconds <= room:
                chosen.append(k)
                spent += seconds
        if chosen:
            return Plan(option, tuple(chosen))
    return Plan(option, (0,))


def _by_turns(count: int, alone: int) -> list[int]:
    """Return pieces so that those of all joints and those of one joint alone take turns."""
    together, single = list(range(count - alone)), list(range(count - alone, count))
    shorter = min(len(together), len(single))
    turns = [k for pair in zip(together, single, strict=False) for k in pair]
    return turns + together[shorter:] + single[shorter:]
