# Copyright 2026 weld_twin contributors
# SPDX-License-Identifier: Apache-2.0
"""
Other sets of effects that explain the recordings: the search, without what it took in early.

An effect that enters early may stand for several, and then keeps them out: a base that moved for a
zero and a spring. So each effect found, and each wave of a gear, is forbidden in turn, and the set is
completed without it, by products of columns that are computed once. Several waves are chosen anew
all together, too.
"""

from __future__ import annotations

from collections.abc import Iterable, Sequence
from dataclasses import dataclass, field, replace
from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray

from ...arrays import Array
from ...effects.effect import Effect
from ..algebra.definite import outside, span_of
from ..algebra.fit import Fit, design, solve_scaled
from ..algebra.workspace import (
    Choice,
    Library,
    Part,
    SeedSystems,
    Workspace,
    evidence,
    merged,
    parts,
    ranking,
)
from ..beliefs import CAUSES, SHORTLIST
from ..negligible import REPEATED
from ..result import Site
from .selection import ROUNDS, backward, implausible, sites

COMPLETED = 2
"""Sets of these, the best with one effect more, that are completed; bounds the time."""
AHEAD = 1.0
"""Log Bayes factor by which another set must be ahead to be taken: less is rounding."""


class Other(NamedTuple):
    """A set of effects that does without one that was found."""

    instead_of: Part | None  # what it does without; None where waves were only chosen anew
    fit: Fit
    ahead: float
    """By how large a log Bayes factor it is ahead of what was found; less than nothing where
    behind."""


@dataclass(frozen=True, eq=False)
class Sets:
    """Sets of a library's units, to first order, with the frames taken out of all that is compared."""

    library: Library
    systems: SeedSystems  # the normal equations of all seeds
    frames: Array  # products of the library's columns with what spans the frames, shape (K, P)
    right: Array  # products of its columns with the residual, shape (K,)
    enter_log_bayes: float  # log Bayes factor that a unit must be worth
    count: float = 1.0  # number of independent rows
    _cross: dict[int, Array] = field(default_factory=dict, repr=False)
    _worth: dict[tuple[float, ...], float] = field(default_factory=dict, repr=False)

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
        return cls(work.library, systems, frames, right, work.beliefs.enter_log_bayes)

    def worth(self, chosen: Sequence[Choice]) -> float:
        """Return the log Bayes factor of a set against the frames alone; each unit costs its entry."""
        columns = _columns(chosen)
        # Sets that grow from different beginnings are often the same, and what is pruned was grown.
        asked = self.count, *columns
        if asked not in self._worth:
            cost = sum(one.surprise + self.enter_log_bayes for one in chosen)
            normal, pull = self._equations(columns)
            gain = float(pull @ solve_scaled(normal, pull, REPEATED))
            freedom = float(len(columns))
            self._worth[asked] = evidence(self.systems.rss, gain, freedom, self.count) - cost
        return self._worth[asked]

    def beside(
        self, chosen: Sequence[Choice], open_to: NDArray[np.bool_], least: float = -np.inf
    ) -> list[Choice]:
        """Return what units with seeds open, (S,), are worth beside a set, most evidence first."""
        columns = _columns(chosen)
        systems = self.systems
        if columns:
            normal, pull = self._equations(columns)
            products = np.column_stack([*(self._cross[c] for c in columns), self.right])
            systems = systems.given(normal, pull, systems.rss, products)
        return ranking(systems, self.library.units, self.count, least, open_to=open_to)

    def _open(self, wanted: Iterable[Part]) -> NDArray[np.bool_]:
        """Return which of the library's seeds are of some parts, shape (S,)."""
        out = np.zeros(sum(len(unit.seeds) for unit in self.library.units), dtype=bool)
        for part in wanted:
            out[self.library.seeds_of.get(part, [])] = True
        return out

    def _equations(self, columns: list[int]) -> tuple[Array, Array]:
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

    def of(self, wanted: Iterable[Part]) -> list[Choice]:
        """Return some parts as a set, each with the seed that serves it best beside the others."""
        chosen: list[Choice] = []
        remaining = set(wanted)
        while best := next(iter(self.beside(chosen, self._open(remaining))), None):
            chosen.append(best)
            remaining.remove(best.part)
        return chosen

    def without(self, start: list[Choice], never: Part | None) -> list[Choice]:
        """Return the best set that begins with another and lacks a part, if any."""
        entering = self._entering(start, never)[:SHORTLIST]
        self._know(_columns(entering))
        begun = [[*start, first] for first in entering]
        grown = (self._grown(one, never, 1) for one in begun)
        more = {frozenset(choice.part for choice in one): one for one in grown}
        best = sorted(more.values(), key=self.worth)[-COMPLETED:]
        return max((self._grown(one, never, CAUSES) for one in best), key=self.worth, default=[])

    def _entering(self, chosen: Sequence[Choice], never: Part | None) -> list[Choice]:
        """Return what earns a place beside a set, most evidence first."""
        taken = self._open([*filter(None, [never]), *(choice.part for choice in chosen)])
        return self.beside(chosen, ~taken, self.enter_log_bayes)

    def _grown(self, chosen: list[Choice], never: Part | None, most: int) -> list[Choice]:
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
    """Return the best set that doing without one effect at a time leads to, and others near it."""
    for _ in range(ROUNDS):
        others = _others(work, now, replace(sets, count=work.effective(now)))
        best = max(others, key=lambda other: other.ahead, default=None)
        if best is None or best.ahead < AHEAD:
            return now, others
        now = backward(work, best.fit)
    return now, []


def _others(work: Workspace, now: Fit, sets: Sets) -> list[Other]:
    """Return the best set without each part found, where it is near what was found."""
    found = [parts(effect) for effect in now.model.found]
    chosen, out = sets.of(part for each in found for part in each), []
    least = sets.worth(chosen) - work.beliefs.alternative_log_bayes
    waves = [each for each in found if each[0].order is not None]
    ways: list[tuple[list[Part], Part | None]] = [
        ([Part(place)], Part(place)) for place in sites(now)
    ]
    ways += [([wave], wave) for each in waves for wave in each]
    ways += [(each, None) for each in waves if len(each) > 1]
    for left, never in ways:
        kept = [c for c in chosen if not {c.part, Part(c.unit.site)} & set(left)]
        other = sets.without(kept, never)
        if other and sets.worth(other) > least:
            own = _fitted(work, now, other)
            if own.rss < work.hopeless(now) and not implausible(own.model):
                out.append(Other(never, own, work.ahead(own, now)))
    return out


def _fitted(work: Workspace, now: Fit, chosen: Sequence[Choice]) -> Fit:
    """Return the fit of a set; what was found before starts at its values."""
    found = {Site.of(effect): effect for effect in now.model.found}
    wanted = sorted({c.part: c for c in chosen}.items(), key=lambda item: str(item[0]))
    result = tuple[Effect, ...]()
    for (site, order), choice in wanted:
        own = found.get(site)
        if own is None or (order is not None and order not in own.search.orders()):
            own = choice.effect()
        elif order is not None:
            own = own.search.with_orders(np.array([order]))
        result = merged(result, own)
    return work.fitted(now.model.with_found(result), work.hopeless(now))


def _columns(chosen: Sequence[Choice]) -> list[int]:
    return [int(column) for choice in chosen for column in choice.columns]
