# Copyright 2026 weld_twin contributors
# SPDX-License-Identifier: Apache-2.0
"""
Normal equations of every seed by itself, and the ranking of units that asks for no more.

A ranking asks what each seed would explain beside the model, never what two seeds would explain
together. So each seed has a small system of its own, and those of one size are one array.
"""

from __future__ import annotations

from collections.abc import Collection, Sequence
from dataclasses import dataclass, replace
from enum import Enum
from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray

from ...arrays import Array
from ...effects.effect import Effect
from ..algebra.definite import EMPTY, FLAT, Index, unit_diagonal

SINGULAR = 1e-11
"""Added to the diagonal of ones, so that columns that repeat others do no harm; far above
rounding, far below what a column must carry to be told from the others."""
PERFECT = 1e-12
"""Share of the sum of squares that counts as left at the least; keeps a logarithm finite."""
FEWEST = 3.0
"""Independent rows at the least: a position has three coordinates."""


class Role(Enum):
    """What a unit may do: be found; or only stand beside what was found, as the same on these data."""

    FOUND = 'found'
    ALIKE = 'alike'
    TAKEN_OUT = 'taken out'


@dataclass(frozen=True, eq=False)
class Unit:
    """One family on one joint: the smallest thing a verdict can name."""

    family: str
    joint: str | None
    seeds: tuple[Effect, ...]
    """Instances that span it; more than one where a parameter bends the response."""
    columns: tuple[Index, ...]
    """Column numbers of every seed."""
    trials: float
    """Among how many instances the seeds were chosen."""
    role: Role = Role.FOUND

    @property
    def site(self) -> tuple[str, str | None]:
        """Return family and joint."""
        return self.family, self.joint

    def __str__(self) -> str:
        """Return family and joint as people read them."""
        return f'{self.family} of {self.joint}' if self.joint else self.family


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


class Grown(NamedTuple):
    """The columns of every seed that are worth it, bool (S, K), and their evidence, (S,)."""

    chosen: NDArray[np.bool_]
    nats: Array


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

    def beside(self, own: Array, residual: Array, products: Array) -> SeedSystems:
        """
        Return the systems for a residual, with the columns of a model projected out.

        own: the model's columns, shape (P, rows).
        residual: shape (rows,).
        products: products of all columns with the model's, and with the residual, shape (all
        columns, P + 1).
        """
        return self.given(own @ own.T, own @ residual, float(residual @ residual), products)

    def given(self, normal: Array, pull: Array, rss: float, products: Array) -> SeedSystems:
        """
        Return the systems with columns projected out of which the products are known.

        normal: products of the columns, shape (P, P).
        pull: their products with the residual, shape (P,).
        rss: sum of squares of the residual.
        products: products of all columns with them, and with the residual, shape (all columns, P +
        1).
        """
        live = np.flatnonzero(normal.diagonal() > EMPTY)
        scaled, size = unit_diagonal(normal[np.ix_(live, live)], 1e-12)
        cross = products[:, live] / size
        wanted = np.column_stack([cross.T, pull[live] / size])
        solved = np.linalg.solve(scaled, wanted) if live.size else wanted
        right = products[:, -1] - cross @ solved[:, -1]
        rss = max(rss - float(pull[live] / size @ solved[:, -1]), EMPTY)
        taken = solved[:, :-1].T
        return replace(
            self, rss=rss, alike=tuple(_less(a, cross, taken, right) for a in self.alike)
        )

    def grown(self, effective: float) -> list[Grown]:
        """
        Return which columns of every seed are worth it, for every size of seed.

        Columns enter one at a time, the one that explains most first, as long as the evidence
        grows; all together where that is worth more.

        effective: number of independent rows.
        """
        return [_grown(each, self.rss, effective) for each in self.alike]


def _less(alike: Alike, cross: Array, taken: Array, right: Array) -> Alike:
    both = cross[alike.columns] @ np.swapaxes(taken[alike.columns], 1, 2)
    return alike._replace(normal=alike.normal - both, right=right[alike.columns])


def _grown(alike: Alike, rss: float, effective: float) -> Grown:
    each = np.arange(alike.seeds.size)
    live = np.einsum('sii->si', alike.normal) > FLAT * alike.size
    remaining, pull = _scaled(alike, live)
    whole = _together(remaining, pull, live.sum(axis=1, dtype=np.float64), rss, effective)
    rest, chosen = live.copy(), np.zeros(live.shape, bool)
    log_bayes_factor, gain = np.full(each.size, -np.inf), np.zeros(each.size)
    for step in range(live.shape[1]):
        falls = np.where(rest, pull**2 / np.einsum('sii->si', remaining), -1.0)
        k = falls.argmax(axis=1)
        more = falls[each, k]
        worth = evidences(rss, gain + more, step + 1.0, effective)
        better = (more >= 0.0) & (worth > log_bayes_factor)
        if not better.any():
            break
        chosen[each[better], k[better]] = True
        rest[each, k] = False
        rest[~better] = False
        log_bayes_factor, gain = (
            np.where(better, worth, log_bayes_factor),
            np.where(better, gain + more, gain),
        )
        remaining, pull = _projected(remaining, pull, k)
    all_of_them = whole > log_bayes_factor
    return Grown(np.where(all_of_them[:, None], live, chosen), np.maximum(whole, log_bayes_factor))


def _scaled(alike: Alike, live: NDArray[np.bool_]) -> tuple[Array, Array]:
    """Return systems with ones on the diagonal; what is not live stands by itself."""
    unit = np.sqrt(np.where(live, np.einsum('sii->si', alike.normal), 1.0))
    both = live[:, :, None] & live[:, None]
    eye = np.eye(live.shape[1])
    scaled = np.where(both, alike.normal / (unit[:, :, None] * unit[:, None]), eye)
    return scaled + SINGULAR * eye, np.where(live, alike.right / unit, 0.0)


def _together(scaled: Array, pull: Array, count: Array, rss: float, effective: float) -> Array:
    """Return the evidence of all live columns of every seed at once, where there are several."""
    gain = (pull * np.linalg.solve(scaled, pull[..., None])[..., 0]).sum(axis=1)
    return np.where(count > 1, evidences(rss, gain, count, effective), -np.inf)


def _projected(remaining: Array, pull: Array, k: Index) -> tuple[Array, Array]:
    """Return systems with one column each, k (S,), fitted and projected out."""
    each = np.arange(k.size)
    row = remaining[each, k]
    share = row / row[each, k][:, None]
    pull = pull - share * pull[each, k][:, None]
    remaining = remaining - share[:, :, None] * row[:, None]
    diagonal = np.einsum('sii->si', remaining)
    diagonal[:] = np.maximum(diagonal, SINGULAR)
    return remaining, pull


def evidence(rss: float, gain: float, freedom: float, effective: float) -> float:
    r"""
    Return the nats that a fall of the sum of squares is worth, noise level unknown.

    .. math:: \tfrac{n}{2} \log\frac{RSS}{RSS - gain} - \tfrac{p}{2} \log n

    Parameters
    ----------
    rss : float
        Sum of squares before.
    gain : float
        By how much it falls.
    freedom : float
        Coordinates that the fall took.
    effective : float
        Number of independent rows [1]_: autocorrelated residuals carry less than their count.

    References
    ----------
    .. [1] G. Schwarz, "Estimating the dimension of a model", Ann. Statist. 6, 1978.

    """
    return float(evidences(rss, np.asarray(gain), freedom, effective))


def evidences(rss: float, gain: Array, freedom: Array | float, effective: float) -> Array:
    """
    Return the `evidence` of many falls at once.

    rss: sum of squares before.
    gain: by how much it falls, shape (S,).
    freedom: coordinates that each fall took, shape (S,).
    effective: number of independent rows.
    """
    # Where nothing was left before, nothing can fall.
    remaining = np.maximum(rss - gain, PERFECT * rss) / rss if rss > 0.0 else np.ones_like(gain)
    count = max(effective, FEWEST)
    return np.asarray(-0.5 * count * np.log(remaining) - 0.5 * freedom * np.log(count))


@dataclass(frozen=True, eq=False)
class Choice:
    """A unit with the seed and columns that serve it best."""

    unit: Unit
    seed: int
    nats: float
    """Log of the evidence ratio against leaving the unit out (Schwarz's approximation)."""
    alike: Alike
    """The systems that the seed's is among."""
    row: int
    """Which of them."""
    chosen: Index
    """Of the seed's columns, those that earn their place."""

    @property
    def columns(self) -> Index:
        """Return the numbers of the columns that earn their place."""
        return np.asarray(self.alike.columns[self.row][self.chosen])

    def effect(self) -> Effect:
        """Return the effect that the least-squares coefficients stand for."""
        normal = self.alike.normal[self.row][np.ix_(self.chosen, self.chosen)]
        scaled, size = unit_diagonal(normal, SINGULAR)
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
) -> list[Choice]:
    """
    Return every unit's best choice, most evidence first.

    systems: normal equations of all seeds, with the model projected out.
    units: what may enter, each as a whole.
    effective: number of independent rows.
    least: evidence [nats] that a choice must exceed.
    roles: which units are asked.
    """
    grown = systems.grown(effective)
    first = np.cumsum([0, *(len(unit.seeds) for unit in units)])
    log_bayes_factor, group, row = (
        np.full(first[-1], -np.inf),
        np.zeros(first[-1], int),
        np.zeros(first[-1], int),
    )
    for k, (alike, each) in enumerate(zip(systems.alike, grown, strict=True)):
        log_bayes_factor[alike.seeds], group[alike.seeds] = each.nats, k
        row[alike.seeds] = np.arange(alike.seeds.size)
    worth = np.maximum.reduceat(log_bayes_factor, first[:-1]) if units else log_bayes_factor
    worth = worth - np.log([unit.trials for unit in units])
    result = []
    asked = np.array([unit.role in roles for unit in units], dtype=bool)
    for u in np.flatnonzero(asked & (worth > least)).tolist():
        seed = int(np.argmax(log_bayes_factor[first[u] : first[u + 1]]))
        k, r = group[first[u] + seed], row[first[u] + seed]
        chosen = np.flatnonzero(grown[k].chosen[r])
        result.append(Choice(units[u], seed, float(worth[u]), systems.alike[k], int(r), chosen))
    return sorted(result, key=lambda choice: -choice.nats)
