# Copyright 2026 weld_twin contributors
# SPDX-License-Identifier: Apache-2.0
"""What explains the gap when no name does: places, dependences, and the curves between them."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass, replace
from functools import cached_property
from itertools import pairwise
from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray

from ...arrays import Array
from ...effects.effect import Effect
from ..algebra.definite import Index, factored
from ..algebra.fit import Fit, design
from ..algebra.problem import Problem, Scale
from ..beliefs import Beliefs
from ..unseen.chance import Candidates, chance_gain, may_be_chance
from ..unseen.folds import steadiness, ways_to_divide
from .groups import Group, all_groups, wandering_groups, whole_arm_groups

STANDS_OUT, NAMED = 0.5, 3
"""Weight from which one place is named alone, and how many are named where none has it."""
RIDGES = (1e-1, 1e1, 1e3)
"""Prior precision of the columns of a group in units of noise: from free to hardly there."""
MOST = 6
"""More groups than this at once say that nothing simple is at work."""
SHORTLIST = 12
"""Groups tried on unseen folds at every step, those that fit best in sample; the right one has
not been seen below the fourth."""


@dataclass(frozen=True, eq=False)
class Part:
    """
    One group that helps to explain the gap.

    Attributes
    ----------
    rivals : tuple of (Group, float)
        Each group that could stand in its place and its weight, itself included.
    share : float
        Of the squared error that is lost without it on unseen folds.

    """

    group: Group
    ridge: float
    rivals: tuple[tuple[Group, float], ...]
    share: float = 0.0

    def weight_of(self, kind: str) -> dict[str, float]:
        """Return the weight of every place ('at') or dependence ('on'), largest first."""
        out: dict[str, float] = {}
        for group, weight in self.rivals:
            name = str(getattr(group, kind))
            out[name] = out.get(name, 0.0) + weight
        return dict(sorted(out.items(), key=lambda item: -item[1]))

    @property
    def words(self) -> str:
        """Return the group as people read it, or the places where none stands out."""
        places = self.weight_of('at')
        if max(places.values(), default=1.0) > STANDS_OUT:
            return str(self.group)
        return ' or '.join(list(places)[:NAMED])


@dataclass(frozen=True, eq=False)
class FreeForm:
    """
    The free-form explanation.

    Attributes
    ----------
    parts : tuple of Part
        In the order in which they were found.
    gain : float
        Share of the squared error that they take away on unseen folds, together.
    steady : float
        The same in standard errors between folds.

    """

    parts: tuple[Part, ...]
    gain: float = 0.0
    steady: float = 0.0

    @property
    def curves(self) -> tuple[Effect, ...]:
        """Return the curves to fit, their values zero."""
        return tuple(curve for part in self.parts for curve in part.group.carried)

    @property
    def precision(self) -> Array:
        """Return the prior precision of the curves' values, in units of noise, shape (K,)."""
        held = [part.group.held(part.ridge) for part in self.parts if part.group.carried]
        return np.concatenate([np.zeros(0), *held])


STRETCHES = 10
"""Stretches of time that take turns in being unseen."""
SHORT = 60
"""Short stretches of which every tenth is left out together: what wanders is told from its
neighbours in time, though not a minute later."""


def free_form(
    problem: Problem,
    scale: Scale,
    bare: Fit,
    precision: Array,
    beliefs: Beliefs,
    *,
    wandering: bool = False,
    whole_arm: bool = False,
) -> FreeForm:
    """
    Return the few groups that explain what a fit leaves, each with its rivals.

    Parameters
    ----------
    bare : Fit
        Frames and the effects that are named beyond doubt.
    precision : array, shape (K,)
        Prior precision of those effects' coordinates.
    wandering : bool
        Look for what changes as the recording goes on, and ask no more of it than to predict
        short stretches from their neighbours.
    whole_arm : bool
        Look also for causes that act at several joints at once, which no curve can carry.

    """
    columns = design(problem, bare.model, scale)
    held = np.zeros(columns.shape[0])
    if precision.size:
        held[-precision.size :] = precision
    groups = all_groups(problem, bare.model, scale)
    if whole_arm:
        groups += whole_arm_groups(problem, bare.model, scale)
    ways = ways_to_divide(problem, STRETCHES)
    if wandering:
        groups += wandering_groups(problem, bare.model, scale)
        ways = [problem.block_labels(SHORT) % STRETCHES]
    work = choosing(groups, columns, held, bare.residual, ways)
    members = chosen(work, beliefs)
    parts, total = [], worth(work, members)
    for k, member in enumerate(members):
        weights = rival_weights(work, members, k, beliefs)
        rivals = tuple((groups[g], w) for g, w in weights if w > 0.0)
        parts.append(Part(groups[member.group], member.ridge, rivals, total.shares[k]))
    return FreeForm(tuple(parts), total.gain, total.steady)


@dataclass(frozen=True, eq=False)
class Member:
    """A group in the model, and the ridge that holds it."""

    group: int
    ridge: float


@dataclass(frozen=True, eq=False)
class Folds:
    """
    Normal equations of every fold of one way to divide the rows, as far as they are asked for.

    Of a hundred groups a choice looks at some tens, and at few of them together.

    Attributes
    ----------
    columns : array, shape (P, rows)
        Features, whitened.
    target : array, shape (rows,)
        What they are to explain, whitened.
    labels : array of int, shape (rows,)
        The fold that each row belongs to.
    order : array of int, shape (rows,), or None
        Rows fold by fold; None where they lie so.
    spans : tuple of slice
        The folds, in that order.

    """

    columns: Array
    target: Array
    labels: Array
    order: Index | None
    spans: tuple[slice, ...]

    @classmethod
    def of(cls, columns: Array, target: Array, labels: Array) -> Folds:
        """Divide the rows by folds."""
        together = bool((np.diff(labels) >= 0).all())
        order = None if together else np.argsort(labels, kind='stable')
        ends = np.cumsum(np.unique(labels, return_counts=True)[1]).tolist()
        return cls(
            columns, target, labels, order, tuple(slice(a, b) for a, b in pairwise([0, *ends]))
        )

    def errors(self, index: Index, precision: Array) -> Array:
        """
        Return the squared error on every fold of the columns fitted on the others, (..., B).

        Parameters
        ----------
        index : array of int, shape (p,)
        precision : array, shape (..., p)
            Prior precisions, each tried.

        """
        if not index.size:
            return np.broadcast_to(self.squares, (*precision.shape[:-1], self.squares.size))
        self._ask(index)
        mine = self._normals[:, index[:, None], index]
        pulls = self._rights[:, index]
        held = np.eye(index.size) * precision[..., None, None, :]
        others = mine.sum(axis=0) - mine + held
        x = np.linalg.solve(others, (pulls.sum(axis=0) - pulls)[..., None])[..., 0]
        moved = (mine @ x[..., None])[..., 0]
        explained = np.einsum('...bp,...bp->...b', x, 2.0 * pulls - moved)
        return np.asarray(self.squares - explained)

    def _ask(self, index: Index) -> None:
        """Multiply out what is not there yet of some columns with each other."""
        lacking = ~self._have[np.ix_(index, index)]
        while lacking.any():
            first = int(np.argmax(lacking.sum(axis=1)))
            alike = (lacking == lacking[first]).all(axis=1)
            rows, others = index[alike], index[lacking[first]]
            one, other = self._sorted(rows), self._sorted(others)
            for normal, part in zip(self._normals, self.spans, strict=True):
                block = one[:, part] @ other[:, part].T
                normal[np.ix_(rows, others)] = block
                normal[np.ix_(others, rows)] = block.T
            self._have[np.ix_(rows, others)] = self._have[np.ix_(others, rows)] = True
            lacking = ~self._have[np.ix_(index, index)]

    def _sorted(self, index: Index) -> Array:
        """Return some columns, fold by fold."""
        own = self.columns[index]
        return own if self.order is None else own[:, self.order]

    @cached_property
    def _normals(self) -> Array:
        """Return room for the normal matrices, shape (B, P, P); what is not written costs nothing."""
        return np.empty((len(self.spans), len(self.columns), len(self.columns)))

    @cached_property
    def _have(self) -> NDArray[np.bool_]:
        """Return which entries of the normal matrices are there, shape (P, P)."""
        return np.zeros((len(self.columns), len(self.columns)), dtype=bool)

    @cached_property
    def _rights(self) -> Array:
        """Return the products with what is to be explained in every fold, shape (B, P)."""
        weight = np.zeros((self.target.size, len(self.spans)))
        rows = np.arange(self.target.size) if self.order is None else self.order
        for fold, part in enumerate(self.spans):
            weight[rows[part], fold] = self.target[rows[part]]
        return np.asarray((self.columns @ weight).T)

    @cached_property
    def squares(self) -> Array:
        """Return the square of what is to be explained in every fold, shape (B,)."""
        target = self.target if self.order is None else self.target[self.order]
        return np.array([target[part] @ target[part] for part in self.spans])


@dataclass(frozen=True, eq=False)
class Choosing:
    """
    What a choice of groups is made on.

    Attributes
    ----------
    fixed : array of int
        Columns of nuisance frames and named effects, always fitted.
    places : list of array of int
        Columns of every group.
    ways : tuple of Folds
        Stretches of time, and regions of posture.

    """

    groups: list[Group]
    fixed: Index
    fixed_precision: Array
    places: list[Index]
    ways: tuple[Folds, ...]

    def shortlist(self, members: Sequence[Member]) -> list[int]:
        """Return the groups that would fit best in sample beside the members, best first."""
        index, precision = self._columns_of(members)
        columns, right = self.ways[0].columns, self._right
        beside = columns @ columns[index].T
        solve = factored(beside[index] + np.diag(precision))
        own, rest = solve(beside.T), right - beside @ solve(right[index])
        taken = {m.group for m in members}
        falls = {}
        for k, place in enumerate(self.places):
            if k in taken:
                continue
            left = self._alone[k] - beside[place] @ own[:, place]
            left[np.diag_indices_from(left)] += RIDGES[1]
            falls[k] = float(rest[place] @ np.linalg.solve(left, rest[place]))
        return sorted(falls, key=lambda k: -falls[k])[:SHORTLIST]

    @cached_property
    def _right(self) -> Array:
        """Return the products of all columns with what is to be explained, shape (P,)."""
        return np.asarray(self.ways[0].columns @ self.ways[0].target)

    @cached_property
    def _alone(self) -> list[Array]:
        """Return the products of every group's columns with each other."""
        each = (self.ways[0].columns[place] for place in self.places)
        return [own @ own.T for own in each]

    def _columns_of(self, members: Sequence[Member]) -> tuple[Index, Array]:
        index = np.concatenate([self.fixed, *(self.places[m.group] for m in members)])
        held = [np.full(self.places[m.group].size, m.ridge) for m in members]
        return index.astype(int), np.concatenate([self.fixed_precision, *held])

    def by_chance(self, members: Sequence[Member], gain: float, steady: float) -> bool:
        """Return whether the best that could enter beside some members gains as much of noise."""
        if not may_be_chance(self.ways[0].target.size, gain):
            return False
        index, precision = self._columns_of(members)
        columns, taken = self.ways[0].columns, {m.group for m in members}
        groups = (columns[place] for k, place in enumerate(self.places) if k not in taken)
        ways = [way.labels for way in self.ways]
        every = Candidates(columns[index], precision, groups, RIDGES, ways)
        return gain < chance_gain(every, steady)

    def errors(self, members: Sequence[Member]) -> list[Array]:
        """Return the squared error of a model on every fold, for each way to divide."""
        index, precision = self._columns_of(members)
        return [way.errors(index, precision) for way in self.ways]

    def ridged(self, members: Sequence[Member], group: int) -> tuple[Member, list[Array]]:
        """Return a group beside the members at its best ridge, and the errors on every fold."""
        index, precision = self._columns_of([*members, Member(group, 0.0)])
        held = np.tile(precision, (len(RIDGES), 1))
        held[:, -self.places[group].size :] = np.array(RIDGES)[:, None]
        ways = [way.errors(index, held) for way in self.ways]
        best = int(np.argmin(np.max([way.sum(axis=1) for way in ways], axis=0)))
        return Member(group, RIDGES[best]), [way[best] for way in ways]


def choosing(
    groups: list[Group],
    fixed: Array,
    fixed_precision: Array,
    target: Array,
    ways: Sequence[Array],
) -> Choosing:
    """
    Return what groups are chosen on.

    Parameters
    ----------
    groups : list of Group
        Their columns become parts of one array here, so that none is held twice.
    fixed : array, shape (F, rows)
        Whitened columns always fitted.
    fixed_precision : array, shape (F,)
    target : array, shape (rows,)
        What is to be explained: the whitened residual without any group.
    ways : sequence of array of int, shape (rows,)
        Each way to divide the rows into folds: stretches of time, regions of posture.

    """
    size = np.sqrt(np.maximum((fixed**2).mean(axis=1), 1e-300))
    columns = np.concatenate([fixed / size[:, None], *(g.columns for g in groups)])
    at, places = fixed.shape[0], []
    for k, group in enumerate(groups):
        end = at + group.columns.shape[0]
        places.append(np.arange(at, end))
        groups[k] = replace(group, columns=columns[at:end])
        at = end
    folds = [Folds.of(columns, target, labels) for labels in ways]
    # Frames that the data hardly show move freely; a trace of ridge keeps the algebra whole.
    held = np.maximum(fixed_precision / size**2, 1e-6 * target.size)
    return Choosing(groups, np.arange(fixed.shape[0]), held, places, tuple(folds))


def chosen(work: Choosing, beliefs: Beliefs) -> list[Member]:
    """Return the few groups that predict best together; none where none is worth it."""
    members: list[Member] = []
    now = work.errors(members)
    while len(members) < MOST:
        tried = [(_worst_gain(now, errors), m, errors) for m, errors in _entrants(work, members)]
        if not tried:
            break
        gain, member, errors = max(tried, key=lambda item: item[0])
        steady = min(steadiness(a, b) for a, b in zip(now, errors, strict=True))
        if gain < beliefs.group_share or steady < beliefs.group_steady:
            break
        if work.by_chance(members, gain, beliefs.group_steady):
            break
        members.append(member)
        now = errors
    return _pruned(work, members, beliefs)


def _entrants(work: Choosing, members: list[Member]) -> list[tuple[Member, list[Array]]]:
    """Return the groups that fit best beside the members, at their best ridge, and the errors."""
    return [work.ridged(members, group) for group in work.shortlist(members)]


def _worst_gain(before: list[Array], after: list[Array]) -> float:
    """Return the share of the squared error that falls, by the way that shows least."""
    return min(
        1.0 - float(b.sum() / max(a.sum(), 1e-300)) for a, b in zip(before, after, strict=True)
    )


def _pruned(work: Choosing, members: list[Member], beliefs: Beliefs) -> list[Member]:
    """Return the members without those that the others have made needless."""
    while len(members) > 1:
        now = work.errors(members)
        less = [work.errors(members[:k] + members[k + 1 :]) for k in range(len(members))]
        losses = [_worst_gain(errors, now) for errors in less]
        weakest = int(np.argmin(losses))
        if losses[weakest] >= beliefs.group_share:
            break
        members = members[:weakest] + members[weakest + 1 :]
    return members


class Worth(NamedTuple):
    """
    What the groups chosen take off the squared error on unseen folds.

    Attributes
    ----------
    shares : tuple of float
        Of each, what is lost without it; together they make up ``gain``.
    gain : float
        Share that all of them take away, by the way of dividing that shows least.
    steady : float
        That fall in its standard errors between folds.

    """

    shares: tuple[float, ...]
    gain: float
    steady: float


def worth(work: Choosing, members: list[Member]) -> Worth:
    """Return what the groups chosen are worth on unseen folds."""
    none, now = work.errors([]), work.errors(members)
    gain = max(_worst_gain(none, now), 0.0)
    steady = min(steadiness(a, b) for a, b in zip(none, now, strict=True))
    less = [work.errors(members[:k] + members[k + 1 :]) for k in range(len(members))]
    losses = np.array([max(sum(float(e.sum()) for e in errors), 0.0) for errors in less])
    losses = np.maximum(losses - sum(float(e.sum()) for e in now), 0.0)
    whole = max(float(losses.sum()), 1e-300)
    return Worth(tuple(float(gain * loss / whole) for loss in losses), gain, steady)


def rival_weights(
    work: Choosing, members: list[Member], k: int, beliefs: Beliefs
) -> list[tuple[int, float]]:
    """
    Return each group with its weight in the place of member k, the weights adding up to one.

    A group that leaves as much on unseen folds weighs as much; one that leaves r times the squared
    error weighs r to the power of -rows / 4: the likelihood of so many independent rows, softened
    by two because real physics is a little richer than any group.

    Parameters
    ----------
    work : Choosing
        Groups and their folds.
    members : list of Member
        The groups chosen.
    k : int
        Which of them is held against the others.

    """
    rest = members[:k] + members[k + 1 :]
    own = (members[k], work.errors(members))
    tried = [own, *(pair for pair in _entrants(work, rest) if pair[0].group != own[0].group)]
    totals = np.array([max(float(e.sum()) for e in errors) for _, errors in tried])
    weights = (totals / max(totals.min(), 1e-300)) ** (-beliefs.group_rows / 4.0)
    # A group that needs fewer columns to do the same is the likelier one: freedom only helps.
    weights /= np.array([work.places[m.group].size for m, _ in tried])
    weights /= weights.sum()
    return [(m.group, float(w)) for (m, _), w in zip(tried, weights, strict=True)]
