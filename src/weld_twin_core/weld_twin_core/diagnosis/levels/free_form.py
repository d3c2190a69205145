# Copyright 2026 weld_twin contributors
# SPDX-License-Identifier: Apache-2.0
"""What explains the gap when no name does: places, dependences, and the curves between them."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
from functools import cached_property
from typing import NamedTuple

import numpy as np

from ...arrays import Array
from ...effects.effect import Effect
from ..algebra.definite import factored
from ..algebra.fit import Fit
from ..algebra.problem import Problem, Scale
from ..beliefs import CAUSES, SHORTLIST, Beliefs
from ..evidence import LIKELIER, NAMED, marginal
from ..negligible import EMPTY, FLAT
from ..unseen.chance import Candidates, chance_gain, may_be_chance
from ..unseen.folds import STRETCHES, steadiness, ways_to_divide
from ..unseen.groups import Group, all_groups
from ..unseen.unseen_stretches import RIDGES, Base, Unseen


@dataclass(frozen=True, eq=False)
class Part:
    """One group that helps to explain the gap."""

    group: Group
    ridge: float
    alternatives: tuple[tuple[Group, float], ...]
    """Each group that could stand in its place and its weight, itself included."""
    share: float = 0.0  # of the squared error that is lost without it on unseen folds

    def weight_of(self, kind: str) -> dict[str, float]:
        """Return the weight of every place ('at') or dependence ('on'), largest first."""
        out = marginal((str(getattr(group, kind)), weight) for group, weight in self.alternatives)
        return dict(sorted(out.items(), key=lambda item: -item[1]))

    @property
    def words(self) -> str:
        """Return the group as people read it, or the places where none stands out."""
        places = self.weight_of('at')
        if len(places) < 2 or max(places.values()) > LIKELIER:
            return str(self.group)
        return ' or '.join(list(places)[:NAMED])


@dataclass(frozen=True, eq=False)
class FreeForm:
    parts: tuple[Part, ...]  # in the order in which they were found
    gain: float = 0.0  # share of the squared error that they take away on unseen folds, together
    steady: float = 0.0  # the same in standard errors between folds

    @property
    def curves(self) -> tuple[Effect, ...]:
        return tuple(curve for part in self.parts for curve in part.group.movable_curves)

    @property
    def precision(self) -> Array:
        """Return the prior precision of the curves' values, in units of noise, shape (K,)."""
        held = [p.group.prior_precision(p.ridge) for p in self.parts if p.group.movable_curves]
        return np.concatenate([np.zeros(0), *held])


SHORT = STRETCHES**2
"""Short stretches of which every eighth is left out together: what wanders is predicted from its
neighbours in time, though not a minute later."""


def free_form(
    problem: Problem, scale: Scale, bare: Fit, beliefs: Beliefs, *, wandering: bool = False
) -> FreeForm:
    """
    Return the few groups that explain what a fit leaves, each with its alternatives.

    wandering: look for what changes as the recording goes on, and ask no more of it than to
    predict short stretches from their neighbours.
    """
    groups = list(all_groups(problem, bare.model, scale, wandering=wandering))
    labels = ways_to_divide(problem)
    if wandering:
        labels = [problem.block_labels(SHORT) % STRETCHES]
    fitted = Unseen.of(problem, scale, bare, np.zeros(bare.coordinates.size))
    work = Choosing(groups, [fitted.by(each) for each in labels])
    members = chosen(work, beliefs)
    parts, (shares, gain, steady) = [], worth(work, members)
    for k, member in enumerate(members):
        weights = alternative_weights(work, members, k, beliefs)
        alternatives = tuple((groups[g], w) for g, w in weights if w > 0.0)
        parts.append(Part(groups[member.group], member.ridge, alternatives, shares[k]))
    return FreeForm(tuple(parts), gain, steady)


class Member(NamedTuple):
    """A group in the model, and the ridge that holds it."""

    group: int
    ridge: float


@dataclass(frozen=True, eq=False)
class Choosing:
    groups: Sequence[Group]
    ways: Sequence[Unseen]
    """What is always fitted, with stretches of time left out in turn, and regions of posture."""

    def beside(self, members: Sequence[Member]) -> list[Base]:
        """Return what is always fitted with some members, for each way to divide."""
        more = [self.groups[m.group].columns / np.sqrt(m.ridge) for m in members]
        ways = [way.along(np.concatenate(more)) for way in self.ways] if more else self.ways
        return [way.base(range(len(way.parts))) for way in ways]

    def errors(self, members: Sequence[Member]) -> list[Array]:
        """Return the squared error of a model on every part left out, for each way to divide."""
        return [base.errors(base.residual) for base in self.beside(members)]

    def entrants(self, members: Sequence[Member]) -> list[tuple[Member, list[Array]]]:
        """Return the groups that fit best beside the members, at their best ridge, and the errors."""
        bases, out = self.beside(members), []
        taken = {m.group for m in members}
        for group in self._shortlist(bases[0].unseen, taken):
            columns = self.groups[group].columns
            ways = [[base.errors(r) for r in base.extended(columns, RIDGES)] for base in bases]
            worst = np.max([np.sum(errors, axis=1) for errors in ways], axis=0)
            best = int(np.argmin(worst))
            out.append((Member(group, RIDGES[best]), [errors[best] for errors in ways]))
        return out

    def _shortlist(self, fitted: Unseen, taken: set[int]) -> list[int]:
        """Return the groups that would fit best in sample beside what is fitted, best first."""
        columns = fitted.columns.written_out()
        normal = columns @ columns.T
        normal[np.diag_indices_from(normal)] = normal.diagonal() * (1.0 + FLAT) + fitted.precision
        solve = factored(normal)
        rest = fitted.residual - solve(columns @ fitted.residual) @ columns
        falls = {}
        for k, group in enumerate(self.groups):
            if k not in taken:
                beside = columns @ group.columns.T
                left = self._alone[k] - beside.T @ solve(beside)
                left[np.diag_indices_from(left)] += RIDGES[1]
                pull = group.columns @ rest
                falls[k] = float(pull @ np.linalg.solve(left, pull))
        return sorted(falls, key=lambda k: -falls[k])[:SHORTLIST]

    @cached_property
    def _alone(self) -> list[Array]:
        return [group.columns @ group.columns.T for group in self.groups]

    def by_chance(self, members: Sequence[Member], gain: float, steady: float) -> bool:
        """Return whether the best that could enter beside some members gains as much of noise."""
        if not may_be_chance(self.ways[0].residual.size, gain):
            return False
        fitted, taken = self.beside(members)[0].unseen, {m.group for m in members}
        groups = (group.columns for k, group in enumerate(self.groups) if k not in taken)
        ways = [way.labels for way in self.ways]
        every = Candidates(fitted.columns.written_out(), fitted.precision, groups, RIDGES, ways)
        return gain < chance_gain(every, steady)


def chosen(work: Choosing, beliefs: Beliefs) -> list[Member]:
    """Return the few groups that predict best together; none where none is worth it."""
    members: list[Member] = []
    now = work.errors(members)
    while len(members) < CAUSES:
        tried = [(_worst_gain(now, errors), m, errors) for m, errors in work.entrants(members)]
        if not tried:
            break
        gain, member, errors = max(tried, key=lambda item: item[0])
        steady = min(steadiness(a, b) for a, b in zip(now, errors, strict=True))
        if gain < beliefs.unexplained or steady < beliefs.steady:
            break
        if work.by_chance(members, gain, beliefs.steady):
            break
        members.append(member)
        now = errors
    return _pruned(work, members, beliefs)


def _worst_gain(before: list[Array], after: list[Array]) -> float:
    """Return the share of the squared error that falls, by the way that shows least."""
    pairs = zip(before, after, strict=True)
    return min(1.0 - float(b.sum() / max(a.sum(), EMPTY)) for a, b in pairs)


def _pruned(work: Choosing, members: list[Member], beliefs: Beliefs) -> list[Member]:
    """Return the members without those that the others have made needless."""
    while len(members) > 1:
        now = work.errors(members)
        less = [work.errors(members[:k] + members[k + 1 :]) for k in range(len(members))]
        losses = [_worst_gain(errors, now) for errors in less]
        weakest = int(np.argmin(losses))
        if losses[weakest] >= beliefs.unexplained:
            break
        members = members[:weakest] + members[weakest + 1 :]
    return members


def worth(work: Choosing, members: list[Member]) -> tuple[tuple[float, ...], float, float]:
    """
    Return what each group chosen loses of what all gain on unseen folds, that gain, how steady it is.

    The gain is a share of the squared error, by the way of dividing that shows least; losses make it
    up.
    """
    none, now = work.errors([]), work.errors(members)
    gain = max(_worst_gain(none, now), 0.0)
    steady = min(steadiness(a, b) for a, b in zip(none, now, strict=True))
    less = [work.errors(members[:k] + members[k + 1 :]) for k in range(len(members))]
    losses = np.array([max(sum(float(e.sum()) for e in errors), 0.0) for errors in less])
    losses = np.maximum(losses - sum(float(e.sum()) for e in now), 0.0)
    whole = max(float(losses.sum()), EMPTY)
    return tuple(float(gain * loss / whole) for loss in losses), gain, steady


def alternative_weights(
    work: Choosing, members: list[Member], k: int, beliefs: Beliefs
) -> list[tuple[int, float]]:
    """
    Return each group with its weight in the place of member k, the weights adding up to one.

    One that leaves r times the squared error on unseen folds weighs r to the power of -rows / 4: the
    likelihood of so many rows, softened by two as real physics is a little richer than any group.
    """
    rest = members[:k] + members[k + 1 :]
    own = (members[k], work.errors(members))
    tried = [own, *(pair for pair in work.entrants(rest) if pair[0].group != own[0].group)]
    totals = np.array([max(float(e.sum()) for e in errors) for _, errors in tried])
    weights = (totals / max(totals.min(), EMPTY)) ** (-beliefs.group_rows / 4)
    # A group that needs fewer columns to do the same is the likelier one: freedom only helps.
    weights /= np.array([len(work.groups[m.group].columns) for m, _ in tried])
    weights /= weights.sum()
    return [(m.group, float(w)) for (m, _), w in zip(tried, weights, strict=True)]
