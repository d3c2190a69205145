# Copyright 2026 weld_twin contributors
# SPDX-License-Identifier: Apache-2.0
"""
What a search works on: the candidates, each with its own normal equations, and fits of sets of them.

A ranking asks what each seed would explain beside the model, never what two seeds would explain
together. So each seed has a small system of its own, and those of one size are one array.
"""

from __future__ import annotations

from collections.abc import Collection, Iterable, Sequence
from dataclasses import dataclass, field
from enum import Enum
from functools import cached_property
from typing import NamedTuple
from weakref import WeakKeyDictionary

import numpy as np
from numpy.typing import NDArray

from ...arrays import Array
from ...effects.effect import Effect
from ..beliefs import Beliefs
from ..negligible import EMPTY, FLAT, REPEATED, ROUNDING
from .columns import Columns, designed
from .definite import Index, unit_diagonal
from .fit import Fit, design, fit, predict_fit
from .independent_rows import FEWEST
from .problem import Model, Problem, Scale, Site
from .starts import started

FAR, FAR_SHARE = 60.0, 1.5
"""Log Bayes factor behind, and times what is left, from which on a fit that a linear step foretells is
not worth doing: others that bend take over some of what is missing, but not a third."""


class Role(Enum):
    """What a unit may do: be found; or only stand beside what was found, as the same on these data."""

    FOUND = 'found'
    ALIKE = 'alike'
    TAKEN_OUT = 'taken out'


class Part(NamedTuple):
    """What a set has or lacks: an effect, or one wave of an effect that has several."""

    site: Site
    order: float | None = None  # of the wave, in cycles per turn; None of the whole effect


def parts(effect: Effect) -> list[Part]:
    """Return what an effect is a set of: its waves, where it is a sum of waves, or itself."""
    site = Site.of(effect)
    return [Part(site, order) for order in effect.search.orders().tolist()] or [Part(site)]


def parts_of(result: Fit) -> list[Part]:
    return [part for effect in result.model.found for part in parts(effect)]


@dataclass(frozen=True, eq=False)
class Unit:
    """One family on one joint: the smallest thing a verdict can name."""

    site: Site
    seeds: tuple[Effect, ...]
    """Instances that span it; more than one where a parameter bends the response."""
    columns: tuple[Index, ...]  # column numbers of every seed
    surprise: tuple[float, ...]  # minus the log probability of every seed, among those of its kind
    role: Role = Role.FOUND


class Alike(NamedTuple):
    """Systems of seeds with the same number of columns."""

    seeds: Index  # which, counted over the units in order, shape (S,)
    columns: Index  # shape (S, K)
    normal: Array  # shape (S, K, K)
    right: Array  # shape (S, K)
    size: Array  # squared norm of every column before anything was projected out, shape (S, K)


@dataclass(frozen=True, eq=False)
class SeedSystems:
    alike: tuple[Alike, ...]  # one entry for every number of columns
    rss: float = 0.0  # sum of squares of the residual

    @classmethod
    def of(cls, columns: Sequence[Index], normals: Sequence[Array]) -> SeedSystems:
        """Sort seeds by number of columns: their column numbers (K,) and products (K, K)."""
        out = []
        for size in sorted({index.size for index in columns}):
            seeds = np.array([k for k, index in enumerate(columns) if index.size == size])
            normal = np.stack([normals[k] for k in seeds])
            each = np.maximum(np.einsum('sii->si', normal), EMPTY)
            index = np.stack([columns[k] for k in seeds])
            out.append(Alike(seeds, index, normal, np.zeros(each.shape), each))
        return cls(tuple(out))

    def given(self, normal: Array, pull: Array, rss: float, products: Array) -> SeedSystems:
        """
        Return the systems for a residual, with the columns of a model projected out.

        normal, pull, rss: products of the model's columns, (P, P), with the residual, (P,), and of
        that.
        products: of all columns with the model's, and with the residual, shape (all columns, P + 1).
        """
        live = np.flatnonzero(normal.diagonal() > EMPTY)
        scaled, size = unit_diagonal(normal[np.ix_(live, live)], ROUNDING)
        cross = products[:, live] / size
        wanted = np.column_stack([cross.T, pull[live] / size])
        solved = np.linalg.solve(scaled, wanted) if live.size else wanted
        right = products[:, -1] - cross @ solved[:, -1]
        rss = max(rss - float(pull[live] / size @ solved[:, -1]), EMPTY)
        taken, alike = solved[:, :-1].T, []
        for each in self.alike:
            both = cross[each.columns] @ np.swapaxes(taken[each.columns], 1, 2)
            alike.append(each._replace(normal=each.normal - both, right=right[each.columns]))
        return SeedSystems(tuple(alike), rss)


def grown(
    alike: Alike, rss: float, effective: float, least: float = -np.inf
) -> tuple[NDArray[np.bool_], Array]:
    """
    Return which columns of every seed are worth it, (S, K), and their log Bayes factor, (S,).

    Columns enter one at a time, the one that explains most first, as long as the evidence
    grows; all together where that is worth more. Up to ``least`` it does not matter which.
    """
    diagonal, eye = np.einsum('sii->si', alike.normal), np.eye(alike.right.shape[1])
    live = diagonal > FLAT * alike.size
    # Ones on the diagonal; what is not live stands by itself.
    unit, both = np.sqrt(np.where(live, diagonal, 1.0)), live[:, :, None] & live[:, None]
    remaining = np.where(both, alike.normal / (unit[:, :, None] * unit[:, None]), eye)
    remaining, pull = remaining + REPEATED * eye, np.where(live, alike.right / unit, 0.0)
    count, together = live.sum(axis=1, dtype=np.float64), np.full(len(live), -np.inf)
    hopeful = np.ones(len(live), bool)
    if (several := count > 1).any():
        all_at_once = np.linalg.solve(remaining[several], pull[several, :, None])[..., 0]
        gains = (pull[several] * all_at_once).sum(axis=1)
        together[several] = evidences(rss, gains, count[several], effective)
        # No choice of columns explains more than all of them, nor costs less than one.
        hopeful[several] = evidences(rss, gains, 1.0, effective) > least
    rest, chosen, growing = live.copy(), np.zeros(live.shape, bool), np.flatnonzero(hopeful)
    remaining, pull = remaining[growing], pull[growing]
    worth, gain = np.full(len(live), -np.inf), np.zeros(len(live))
    for step in range(live.shape[1]):
        falls = np.where(rest[growing], pull**2 / np.einsum('sii->si', remaining), -1.0)
        k = falls.argmax(axis=1)
        more = falls[np.arange(k.size), k]
        now = evidences(rss, gain[growing] + more, step + 1.0, effective)
        better = (more >= 0.0) & (now > worth[growing])
        growing, k = growing[better], k[better]
        if not growing.size:
            break
        chosen[growing, k], rest[growing, k] = True, False
        worth[growing] = now[better]
        gain[growing] += more[better]
        remaining, pull = _projected(remaining[better], pull[better], k)
    all_of_them = together > worth
    return np.where(all_of_them[:, None], live, chosen), np.maximum(together, worth)


def _projected(remaining: Array, pull: Array, k: Index) -> tuple[Array, Array]:
    """Return systems with one column each, k (S,), fitted and projected out."""
    each = np.arange(k.size)
    row = remaining[each, k]
    share = row / row[each, k][:, None]
    pull = pull - share * pull[each, k][:, None]
    remaining = remaining - share[:, :, None] * row[:, None]
    diagonal = np.einsum('sii->si', remaining)
    diagonal[:] = np.maximum(diagonal, REPEATED)
    return remaining, pull


def evidence(rss: float, gain: float, freedom: float, effective: float) -> float:
    r"""
    Return the log Bayes factor of a fall of the sum of squares, noise level unknown.

    .. math:: \tfrac{n}{2} \log\frac{RSS}{RSS - gain} - \tfrac{p}{2} \log n

    freedom: coordinates that the fall took.
    effective: number of independent rows [1]_: autocorrelated residuals carry less than their count.

    References
    ----------
    .. [1] G. Schwarz, "Estimating the dimension of a model", Ann. Statist. 6, 1978.

    """
    return float(evidences(rss, np.asarray(gain), freedom, effective))


def evidences(rss: float, gain: Array, freedom: Array | float, effective: float) -> Array:
    """Return the `evidence` of many falls at once, ``gain`` and ``freedom`` of shape (S,)."""
    # Where nothing was left before, nothing can fall.
    remaining = np.maximum(rss - gain, ROUNDING * rss) / rss if rss > 0.0 else np.ones_like(gain)
    count = max(effective, FEWEST)
    return np.asarray(-(count * np.log(remaining) + freedom * np.log(count)) / 2.0)


def lead(own: Fit, now: Fit, freedom: float, effective: float) -> float:
    """
    Return the log Bayes factor by which one fit is ahead of another, with how often its sizes come.

    freedom: coordinates that it has more.
    effective: see `evidence`.
    """
    return evidence(now.rss, now.rss - own.rss, freedom, effective) + own.sized - now.sized


@dataclass(frozen=True, eq=False)
class Choice:
    """A unit with the seed and columns that serve it best."""

    unit: Unit
    seed: int
    log_bayes: float
    """Log of the evidence ratio against leaving the unit out (Schwarz's approximation)."""
    alike: Alike  # the systems that the seed's is among
    row: int  # which of them
    chosen: Index  # of the seed's columns, those that earn their place

    @cached_property
    def part(self) -> Part:
        return parts(self.unit.seeds[self.seed])[0]

    @cached_property
    def columns(self) -> Index:
        return np.asarray(self.alike.columns[self.row][self.chosen])

    @property
    def surprise(self) -> float:
        return self.unit.surprise[self.seed]

    def effect(self) -> Effect:
        normal = self.alike.normal[self.row][np.ix_(self.chosen, self.chosen)]
        scaled, size = unit_diagonal(normal, REPEATED)
        right = self.alike.right[self.row][self.chosen]
        coefficients = np.zeros(self.alike.columns.shape[1])
        coefficients[self.chosen] = np.linalg.solve(scaled, right / size) / size
        return self.unit.seeds[self.seed].from_atoms(coefficients)


def ranking(
    systems: SeedSystems,
    units: Sequence[Unit],
    effective: float,
    least: float = -np.inf,
    roles: Collection[Role] = (Role.FOUND,),
    open_to: NDArray[np.bool_] | None = None,
) -> list[Choice]:
    """
    Return every unit's best choice worth more than ``least``, most evidence first.

    systems: normal equations of all seeds, with the model projected out, of some independent rows.
    open_to: which seeds may be chosen, counted over the units in order, shape (S,); all by default.
    """
    each = [grown(alike, systems.rss, effective, least) for alike in systems.alike]
    first = np.cumsum([0, *(len(unit.seeds) for unit in units)])
    log_bayes_factor, group = np.full(first[-1], -np.inf), np.zeros(first[-1], int)
    row = np.zeros(first[-1], int)
    for k, (alike, (_, own)) in enumerate(zip(systems.alike, each, strict=True)):
        log_bayes_factor[alike.seeds], group[alike.seeds] = own, k
        row[alike.seeds] = np.arange(alike.seeds.size)
    log_bayes_factor -= np.concatenate([np.zeros(0), *(unit.surprise for unit in units)])
    if open_to is not None:
        log_bayes_factor[~open_to] = -np.inf
    worth = np.maximum.reduceat(log_bayes_factor, first[:-1]) if units else log_bayes_factor
    result = []
    asked = np.array([unit.role in roles for unit in units], dtype=bool)
    for u in np.flatnonzero(asked & (worth > least)).tolist():
        seed = int(np.argmax(log_bayes_factor[first[u] : first[u + 1]]))
        k, r = group[first[u] + seed], row[first[u] + seed]
        chosen = np.flatnonzero(each[k][0][r])
        result.append(Choice(units[u], seed, float(worth[u]), systems.alike[k], int(r), chosen))
    return sorted(result, key=lambda choice: -choice.log_bayes)


@dataclass(frozen=True, eq=False)
class Library:
    columns: Columns  # all of them, in the order of their numbers
    systems: SeedSystems  # the normal matrix of every seed
    units: tuple[Unit, ...]
    absent: dict[str, str]  # why a family is not considered, by name

    @cached_property
    def seeds_of(self) -> dict[Part, list[int]]:
        """Return the seeds, counted over the units, of every part and of every effect as a whole."""
        out: dict[Part, list[int]] = {}
        for k, seed in enumerate(seed for unit in self.units for seed in unit.seeds):
            for part in {*parts(seed), Part(Site.of(seed))}:
                out.setdefault(part, []).append(k)
        return out


@dataclass(frozen=True, eq=False)
class Workspace:
    """What selection works on; products of the library are computed once, as only residuals change."""

    problem: Problem
    scale: Scale
    library: Library
    beliefs: Beliefs
    bare_rss: float  # whitened sum of squares before any effect was found
    _without: WeakKeyDictionary[Fit, dict[int, Fit]] = field(
        default_factory=WeakKeyDictionary, init=False, repr=False
    )

    def effective(self, result: Fit, trust: float = 1.0) -> float:
        """
        Return the number of independent rows that the evidence of a fit may count.

        Frames that are fitted along take rows away. Two more things make a residual less telling than
        its count: autocorrelation, and physics richer than the model. An explained sum of squares E
        leaves about ``beliefs.misfit``^2 E of misfit in some ``beliefs.misfit_directions`` directions,
        and any further column may pick that up by chance.

        trust: exponent by which autocorrelation is believed: causes still missing make it theirs.
        """
        problem, beliefs, found = self.problem, self.beliefs, result.model.found
        share = problem.independent_share(result.residual) ** trust
        count = share * max(result.residual.size - problem.frame_count, 1)
        # What entered first explains most, and so does what its formula misses.
        misfit = beliefs.misfit * (found[0].fit.ideal if found else 1.0)
        explained = max(self.bare_rss - result.rss, 0.0) / max(result.rss, EMPTY) * count
        return float(count / (1.0 + misfit**2 * explained / beliefs.misfit_directions))

    def independent(self, fits: Sequence[Fit]) -> float:
        """Return the rows by which fits are weighed: as many as the one counts that leaves least."""
        return self.effective(min(fits, key=lambda f: f.rss))

    def without(self, now: Fit, k: int) -> Fit:
        """
        Return the fit without found effect k of another, made once.

        What is searched for at its joint is searched for anew: it may have left to it what it is.
        """
        known = self._without.setdefault(now, {})
        if k not in known:
            bare = self.fitted(now.model.without(k))
            gone, found = now.model.found[k], bare.model.found
            beside = [i for i, e in enumerate(found) if e.site == gone.site and e.fit.searched]
            fits = [bare, *(self.fitted_with(bare.model.without(i), found[i]) for i in beside)]
            known[k] = min(fits, key=lambda one: one.rss)
        return known[k]

    def predict_without(self, now: Fit) -> list[tuple[float, float]]:
        """
        Return of every found effect what a fit without it will leave, and how much it changes.

        About the whitened squares; and the RMS change of the residual [noise] before any fit anew.
        """
        own, out = designed(self.problem, now.model, self.scale), []
        place = own.count - now.coordinates.size
        for k, effect in enumerate(now.model.found):
            end = place + effect.fit.coordinates().size
            others = own.chosen(np.delete(np.arange(own.count), slice(place, end)))
            bare = now.model.without(k)
            residual, rss = predict_fit(self.problem, bare, self.scale, others)
            out.append((rss, float(np.sqrt(((residual - now.residual) ** 2).mean()))))
            place = end
        return out

    def fitted(self, model: Model, most: float = np.inf) -> Fit:
        """Return the fit of a model; of one that leaves too much, a sketch."""
        return fit(self.problem, model, self.scale, most=most)

    def fitted_with(self, model: Model, effect: Effect) -> Fit:
        """Return the fit of a model with one more effect, merged where its kind can merge."""
        effect = started(self.problem, model, self.scale, effect)
        return self.fitted(model.with_found(merged(model.found, effect)))

    def ahead(self, own: Fit, now: Fit) -> float:
        """
        Return by how much log Bayes factor one set is ahead of another.

        An effect or wave more costs what it costs to enter: that two errors happen to be one is
        seldom.
        """
        surprise = {
            part: own
            for unit in self.library.units
            for seed, own in zip(unit.seeds, unit.surprise, strict=True)
            for part in parts(seed)
        }

        def cost(result: Fit) -> float:
            each = parts_of(result)
            return sum(surprise.get(part, 0.0) + self.beliefs.enter_log_bayes for part in each)

        more = float(own.coordinates.size - now.coordinates.size)
        count = self.independent((now, own))
        return lead(own, now, more, count) - cost(own) + cost(now)

    def hopeless(self, now: Fit) -> float:
        """Return the sum of squares from which on nothing can take the place of what was found."""
        # Without noise a handful of rows count, and nothing is hopeless.
        with np.errstate(over='ignore'):
            return now.rss * max(float(np.exp(2.0 * FAR / self.effective(now))), FAR_SHARE)

    def beside(self, now: Fit) -> SeedSystems:
        """Return the normal equations of all seeds given a fit: its frames and effects fitted."""
        own = design(self.problem, now.model, self.scale)
        products = self.library.columns.products(np.concatenate([own, now.residual[None]]))
        return self.library.systems.given(own @ own.T, own @ now.residual, now.rss, products)

    def ranked(
        self, now: Fit, count: float, least: float = -np.inf, roles: Iterable[Role] = (Role.FOUND,)
    ) -> list[Choice]:
        return ranking(self.beside(now), self.library.units, count, least, tuple(roles))


def merged(result: tuple[Effect, ...], effect: Effect) -> tuple[Effect, ...]:
    """Return the effects with one more, in one with its like where their kind can join."""
    for k, other in enumerate(result):
        if Site.of(other) == Site.of(effect):
            both = other.search.joined(effect)
            if both is not None:
                return (*result[:k], both, *result[k + 1 :])
    return (*result, effect)
