# Copyright 2026 weld_twin contributors
# SPDX-License-Identifier: Apache-2.0
"""
Normal equations of each candidate by itself, which are enough to rank the candidates.

A ranking asks what each seed would explain beside the model, never what two seeds would explain
together. So each seed has a small system of its own, and those of one size are one array.
"""

from __future__ import annotations

from collections.abc import Collection, Sequence
from dataclasses import dataclass
from enum import Enum
from functools import cached_property
from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray

from ...arrays import Array
from ...effects.effect import Effect
from .definite import EMPTY, FLAT, REPEATED, ROUNDING, Index, unit_diagonal
from .problem import Site

FEWEST = 3.0
"""Independent rows at the least: a position has three coordinates."""


class Role(Enum):
    """What a unit may do: be found; or only stand beside what was found, as the same on these data."""

    FOUND = 'found'
    ALIKE = 'alike'
    TAKEN_OUT = 'taken out'


class Part(NamedTuple):
    """What a set has or lacks: an effect, or one wave of an effect that has several."""

    site: Site
    order: float | None = None
    """Of the wave, in cycles per turn; None of the whole effect."""


def parts(effect: Effect) -> list[Part]:
    """Return what an effect is a set of: its waves, where it is a sum of waves, or itself."""
    site = Site.of(effect)
    return [Part(site, order) for order in effect.search.orders().tolist()] or [Part(site)]


@dataclass(frozen=True, eq=False)
class Unit:
    """One family on one joint: the smallest thing a verdict can name."""

    site: Site
    seeds: tuple[Effect, ...]
    """Instances that span it; more than one where a parameter bends the response."""
    columns: tuple[Index, ...]
    """Column numbers of every seed."""
    trials: float
    """Among how many instances the seeds were chosen."""
    role: Role = Role.FOUND


class Alike(NamedTuple):
    """Systems of seeds with the same number of columns."""

    seeds: Index
    """Which, counted over the units in order, shape (S,)."""
    columns: Index
    """Shape (S, K)."""
    normal: Array
    """Shape (S, K, K)."""
    right: Array
    """Shape (S, K)."""
    size: Array
    """Squared norm of every column before anything was projected out, shape (S, K)."""


@dataclass(frozen=True, eq=False)
class SeedSystems:
    """Normal equations of all seeds."""

    alike: tuple[Alike, ...]
    """One entry for every number of columns."""
    rss: float = 0.0
    """Sum of squares of the residual."""

    @classmethod
    def of(cls, columns: Sequence[Index], normals: Sequence[Array]) -> SeedSystems:
        """
        Sort seeds by their number of columns.

        columns: column numbers of every seed, shape (K,).
        normals: products of its columns with each other, shape (K, K).
        """
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

        normal: products of the model's columns, shape (P, P).
        pull: their products with the residual, shape (P,).
        rss: sum of squares of the residual.
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
    Return which columns of every seed are worth it, bool (S, K), and their log Bayes factor, (S,).

    Columns enter one at a time, the one that explains most first, as long as the evidence
    grows; all together where that is worth more.

    rss: sum of squares of the residual.
    effective: number of independent rows.
    least: log Bayes factor up to which it does not matter which columns are worth it.
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

    rss, gain: sum of squares before, and by how much it falls.
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


@dataclass(frozen=True, eq=False)
class Choice:
    """A unit with the seed and columns that serve it best."""

    unit: Unit
    seed: int
    log_bayes: float
    """Log of the evidence ratio against leaving the unit out (Schwarz's approximation)."""
    alike: Alike
    """The systems that the seed's is among."""
    row: int
    """Which of them."""
    chosen: Index
    """Of the seed's columns, those that earn their place."""

    @cached_property
    def part(self) -> Part:
        """Return what it puts into a set."""
        return parts(self.unit.seeds[self.seed])[0]

    @cached_property
    def columns(self) -> Index:
        """Return the numbers of the columns that earn their place."""
        return np.asarray(self.alike.columns[self.row][self.chosen])

    def effect(self) -> Effect:
        """Return the effect that the least-squares coefficients stand for."""
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
    Return every unit's best choice, most evidence first.

    systems: normal equations of all seeds, with the model projected out.
    units: what may enter, each as a whole.
    effective: number of independent rows.
    least: log Bayes factor that a choice must exceed.
    roles: which units are asked.
    open_to: which seeds may be chosen, counted over the units in order, shape (S,); all by default.
    """
    each = [grown(alike, systems.rss, effective, least) for alike in systems.alike]
    first = np.cumsum([0, *(len(unit.seeds) for unit in units)])
    log_bayes_factor, group = np.full(first[-1], -np.inf), np.zeros(first[-1], int)
    row = np.zeros(first[-1], int)
    for k, (alike, (_, own)) in enumerate(zip(systems.alike, each, strict=True)):
        log_bayes_factor[alike.seeds], group[alike.seeds] = own, k
        row[alike.seeds] = np.arange(alike.seeds.size)
    if open_to is not None:
        log_bayes_factor[~open_to] = -np.inf
    worth = np.maximum.reduceat(log_bayes_factor, first[:-1]) if units else log_bayes_factor
    worth = worth - np.log([unit.trials for unit in units])
    result = []
    asked = np.array([unit.role in roles for unit in units], dtype=bool)
    for u in np.flatnonzero(asked & (worth > least)).tolist():
        seed = int(np.argmax(log_bayes_factor[first[u] : first[u + 1]]))
        k, r = group[first[u] + seed], row[first[u] + seed]
        chosen = np.flatnonzero(each[k][0][r])
        result.append(Choice(units[u], seed, float(worth[u]), systems.alike[k], int(r), chosen))
    return sorted(result, key=lambda choice: -choice.log_bayes)
