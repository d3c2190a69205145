# Copyright 2026 weld_twin contributors
# SPDX-License-Identifier: Apache-2.0
"""
Other sets of effects that explain the recordings: the search, without what it took in early.

An effect that enters early may stand for several, and then keeps them out: a base that moved for
a zero and a spring. No exchange of one effect for another leads away from there. So each effect
found is forbidden in turn, and the set is completed without it, by products of columns alone:
these are computed once, and a set costs a small system of equations.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass, field, replace
from typing import NamedTuple

import numpy as np

from ...arrays import Array
from ..algebra.definite import outside, span_of
from ..algebra.fit import Fit, design, solve_scaled
from ..result import Site
from .library import Library
from .seed_systems import SINGULAR, Choice, SeedSystems, evidence, ranking
from .selection import Workspace, backward, implausible, merged, sites

BEGUN = 6
"""Effects that a set is begun with, in turn; bounds the time."""
COMPLETED = 2
"""Sets of these, the best with one effect more, that are completed; bounds the time."""
LONGEST = 6
"""Effects that a set gains at most: cells have one to six causes."""
AHEAD = 1.0
"""Evidence [nats] by which another set must be ahead to be taken: less is rounding."""
ROUNDS = 4
"""Sets taken one after the other at most; bounds the time."""


class Other(NamedTuple):
    """A set of effects that does without one that was found."""

    instead_of: Site
    """What it does without."""
    fit: Fit
    ahead: float
    """By how much evidence [nats] it is ahead of what was found; less than nothing where
    behind."""


@dataclass(frozen=True, eq=False)
class Sets:
    """Sets of a library's units, to first order, with the frames taken out of all that is compared."""

    library: Library
    systems: SeedSystems
    """The normal equations of all seeds."""
    frames: Array
    """Products of the library's columns with what spans the frames, shape (K, P)."""
    right: Array
    """Products of its columns with the residual, shape (K,)."""
    enter_nats: float
    """Evidence [nats] that a unit must be worth."""
    count: float = 1.0
    """Number of independent rows."""
    _cross: dict[int, Array] = field(default_factory=dict, repr=False)

    @classmethod
    def about(cls, work: Workspace, now: Fit) -> Sets:
        """Return the sets about a fit, of which nothing but the frames stays."""
        bare = work.fitted(now.model.with_found(()))
        span = span_of(design(work.problem, bare.model, work.scale))
        residual = outside(bare.residual, span)
        products = work.library.columns.products(np.concatenate([span, residual[None]]))
        frames, right = products[:, :-1], products[:, -1]
        rss, pull = float(residual @ residual), np.zeros(len(span))
        systems = work.library.systems.given(np.eye(len(span)), pull, rss, products)
        return cls(work.library, systems, frames, right, work.beliefs.enter_nats)

    def worth(self, chosen: Sequence[Choice]) -> float:
        """Return the evidence [nats] of a set against the frames alone; each unit costs its entry."""
        columns = _columns(chosen)
        cost = sum(float(np.log(choice.unit.trials)) + self.enter_nats for choice in chosen)
        normal, pull = self._equations(columns)
        gain = float(pull @ solve_scaled(normal, pull, SINGULAR))
        return evidence(self.systems.rss, gain, float(len(columns)), self.count) - cost

    def beside(self, chosen: Sequence[Choice], least: float = -np.inf) -> list[Choice]:
        """Return what units are worth beside a set, more than the least, most evidence first."""
        columns = _columns(chosen)
        systems = self.systems
        if columns:
            normal, pull = self._equations(columns)
            products = np.column_stack([*(self._cross[c] for c in columns), self.right])
            systems = systems.given(normal, pull, systems.rss, products)
        return ranking(systems, self.library.units, self.count, least)

    def _equations(self, columns: list[int]) -> tuple[Array, Array]:
        """Return the normal equations of some columns."""
        self._know(columns)
        normal = np.array([self._cross[c][columns] for c in columns])
        return normal.reshape(2 * (len(columns),)), self.right[columns]

    def _know(self, columns: Sequence[int]) -> None:
        """Work out the products of some columns with all others, where that was not done."""
        new = sorted(set(columns) - self._cross.keys())
        if new:
            every = self.library.columns
            rows = every.products(every.chosen(np.array(new)).written_out())
            rows -= self.frames @ self.frames[new].T
            self._cross.update(zip(new, rows.T.copy(), strict=True))

    def of(self, wanted: Sequence[Site]) -> list[Choice]:
        """Return some units as a set, each with the seed that serves it best beside the others."""
        chosen: list[Choice] = []
        remaining = set(wanted)
        while best := next((c for c in self.beside(chosen) if c.unit.site in remaining), None):
            chosen.append(best)
            remaining.remove(best.unit.site)
        return chosen

    def without(self, start: list[Choice], never: Site) -> list[Choice]:
        """Return the best set that begins with another and lacks a unit."""
        entering = self._entering(start, never)[:BEGUN]
        self._know(_columns(entering))
        begun = [[*start, first] for first in entering]
        more = {_names(one): one for one in (self._grown(one, never, 1) for one in begun)}
        best = sorted(more.values(), key=self.worth)[-COMPLETED:]
        return max((self._grown(one, never, LONGEST) for one in best), key=self.worth, default=[])

    def _entering(self, chosen: Sequence[Choice], never: Site) -> list[Choice]:
        """Return what earns a place beside a set, most evidence first."""
        taken = {never, *_names(chosen)}
        return [c for c in self.beside(chosen, self.enter_nats) if c.unit.site not in taken]

    def _grown(self, chosen: list[Choice], never: Site, most: int) -> list[Choice]:
        """Return a set with what else earns a place, one unit after the other."""
        for _ in range(most):
            entering = self._entering(chosen, never)
            if not entering:
                break
            chosen = self._pruned([*chosen, entering[0]])
        return chosen

    def _pruned(self, chosen: list[Choice]) -> list[Choice]:
        """Return a set without what is not worth its place, the least first."""
        while chosen:
            less = [chosen[:k] + chosen[k + 1 :] for k in range(len(chosen))]
            best = max(less, key=self.worth)
            if self.worth(chosen) >= self.worth(best):
                break
            chosen = best
        return chosen


def reconsidered(work: Workspace, now: Fit, sets: Sets) -> tuple[Fit, list[Other]]:
    """
    Return the best set that doing without one effect at a time leads to, and others near it.

    now: what the search found.
    sets: of the workspace's library.
    """
    for _ in range(ROUNDS):
        others = _others(work, now, replace(sets, count=work.effective(now)))
        best = max(others, key=lambda other: other.ahead, default=None)
        if best is None or best.ahead < AHEAD:
            return now, others
        now = backward(work, best.fit)
    return now, []


def _others(work: Workspace, now: Fit, sets: Sets) -> list[Other]:
    """Return the best set without each effect found, where it is near what was found."""
    chosen, out = sets.of(sites(now)), []
    least = sets.worth(chosen) - work.beliefs.rival_nats
    for place in sites(now):
        other = sets.without([c for c in chosen if c.unit.site != place], place)
        if other and sets.worth(other) > least:
            own = _fitted(work, now, other)
            if own.rss < work.hopeless(now) and not implausible(own.model):
                out.append(Other(place, own, ahead(work, own, now)))
    return out


def _fitted(work: Workspace, now: Fit, chosen: Sequence[Choice]) -> Fit:
    """Return the fit of a set; what was found before starts at its values."""
    known = {Site.of(effect): effect for effect in now.model.found}
    result = tuple(known[place] for place in _names(chosen) if place in known)
    for choice in chosen:
        if choice.unit.site not in known:
            result = merged(result, choice.effect())
    return work.fitted(now.model.with_found(result), 8, work.hopeless(now))


def ahead(work: Workspace, own: Fit, now: Fit) -> float:
    """
    Return by how much evidence [nats] one set is ahead of another.

    An effect more costs what it costs to enter: that two errors happen to be one is seldom.

    own, now: the one and the other, on the workspace's problem and scale.
    """
    trials = {unit.site: float(np.log(unit.trials)) for unit in work.library.units}

    def cost(result: Fit) -> float:
        return sum(trials.get(place, 0.0) + work.beliefs.enter_nats for place in sites(result))

    more = float(own.coordinates.size - now.coordinates.size)
    count = work.independent((now, own))
    return evidence(now.rss, now.rss - own.rss, more, count) - cost(own) + cost(now)


def _columns(chosen: Sequence[Choice]) -> list[int]:
    return [int(column) for choice in chosen for column in choice.columns]


def _names(chosen: Sequence[Choice]) -> tuple[Site, ...]:
    return tuple(sorted((c.unit.site for c in chosen), key=str))
