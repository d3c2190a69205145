# Copyright 2026 weld_twin contributors
# SPDX-License-Identifier: Apache-2.0
"""
How large every small error of this arm is: models weighed by what they say of the recordings.

No arm is exact, but most of what it could have it has next to nothing of. Every coordinate therefore
has one of a few sizes, and a model is a choice of sizes. Models are drawn as often as the recordings
vouch for them: one size after the other given all other sizes [1]_, whatever the values of the
coordinates are. Given its own value a coordinate that is small would hardly ever become large. What
sizes are usual is learned along, family by family and from all families of a kind together. What no
data could show, for it is one with a fitted frame or does nothing in them, is as wide as machines have
it, but for what the others of its family show: that an arm is good in one thing is no witness of what
nobody looked at.

References
----------
.. [1] E. I. George, R. E. McCulloch, "Approaches for Bayesian variable selection", Statistica Sinica
   7, 1997, section 3.2.

"""

from __future__ import annotations

from dataclasses import dataclass, field
from functools import cached_property
from math import log
from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray
from scipy.linalg.blas import dgemm, dger
from scipy.linalg.lapack import dtrtrs

from ...arrays import Array
from ..algebra.definite import inverse_of, root_of
from ..algebra.fit import NOISE_TRUST
from ..negligible import EMPTY, HIDDEN, ROUNDING

SIZES = np.array([0.0001, 0.001, 0.01, 0.03, 0.1, 0.3, 1.0, 3.0])
"""Sizes of an error in units of what machines have: a ten-thousandth is none, for a thousandth of all of
them together moves the tool by a micrometre."""
BELIEF = np.array([0.1, 0.1, 0.15, 0.15, 0.15, 0.15, 0.15, 0.05])
"""How often each size comes before anything is known of this arm. A judgement: real arms have a third
of their small errors at a usual size, simulated ones hardly any, and either shows within a few."""
POOLED, OWN = 3.0, 4.0
"""So many coordinates' worth of belief in that, and in what all families of a kind show, for each."""
USUAL = SIZES[5]
"""Size, a third of what machines have, from which on an error is one that machines usually have."""
SWEEPS, LEARNING = 100, 20
"""Models drawn, and those until the chain has forgotten where it was: on six sealed cells means of three
chains were a third of a standard deviation off that of a long one, which two ends agreed on."""
FEW = 4
"""Times as many where rows are fewer than coordinates, and models differ more: of a measured arm's 15
stations chains led 0.69 to 1.32 times as far astray as the best plain fit, these 0.78 to 0.99."""
KEPT = LEARNING
"""Every so many models one is kept: it has forgotten the one before."""
GEARS, GEOMETRY, MEASURING = range(3)
"""Whose small errors are."""
SEED = 1
"""Of the draws: the same recordings give the same posterior."""


@dataclass(frozen=True, eq=False)
class Prior:
    """Where coordinates lie before the data."""

    middle: Array  # counted from the fit, shape (P,)
    width: Array  # standard deviation of a usual one, shape (P,)
    group: NDArray[np.int_]
    """Family, shape (P,); -1 for what is as wide as it is: frames, and links that grow, as all do."""
    pool: NDArray[np.int_]
    """Whose a family is, `GEARS`, `GEOMETRY` or `MEASURING`, shape (G,). How even gears are says nothing
    of an arm's geometry, and neither of the instrument."""
    tied: NDArray[np.bool_]  # families whose coordinates all have one size, shape (G,)


class Products(NamedTuple):
    """Products of the columns of some rows with each other, (P, P), and with the residual, (P,)."""

    columns: Array
    residual: Array


@dataclass(frozen=True, eq=False)
class Rows:
    """
    Whitened rows at the fitted model, in units of its noise.

    ``columns`` (P, rows) are those of the coordinates of a `Prior`, ``residual`` (rows,) is what
    the model leaves, ``share`` the part of the rows that count as independent. ``moved`` (P,) is
    how far a coordinate moves the tool in all of them together, where they do not show it all:
    places that are touched and not known take up much of it.
    """

    columns: Array
    residual: Array
    share: float
    moved: Array | None = None

    @cached_property
    def products(self) -> Products:
        return Products(self.columns @ self.columns.T, self.columns @ self.residual)

    def parts(self, labels: Array) -> list[Products]:
        """Return the products of the rows of every label, (rows,), the least first."""
        out = []
        for label in np.unique(labels):
            columns = self.columns[:, labels == label]
            out.append(Products(columns @ columns.T, columns @ self.residual[labels == label]))
        return out


class Weighed(NamedTuple):
    mean: Array  # shape (P,)
    covariance: Array  # shape (P, P)
    shown: Array
    open: Array
    """Width of the one prior that stands for all sizes: by precision, as it counts where data show
    a coordinate, and by variance, as it counts where they do not, shape (P,)."""
    noise: float  # variance of a row
    drawn: tuple[Array, ...]  # widths of the priors of some models, each shape (P,)
    rough: float
    """Share of the small errors that are of a usual size, among those of the geometry or those of
    the gears, whichever are rougher."""


def weighed(rows: Rows, prior: Prior, expected: float) -> Weighed:
    """Return the coordinates over all models; a row varies as expected before anything is known."""
    chain, drawn = _Chain(rows, prior, expected), []
    sweeps = SWEEPS * (FEW if rows.residual.size < prior.width.size else 1)
    for sweep in range(sweeps):
        chain.step(look=sweep >= LEARNING)
        if sweep >= LEARNING and sweep % KEPT == 0:
            drawn.append(prior.width * chain.size)
    seen, width = chain.seen, prior.width
    mean = seen.mean / seen.count
    covariance = seen.square / seen.count - np.outer(mean, mean)
    covariance = (covariance + covariance.T) / 2.0 * np.outer(width, width)
    return Weighed(
        width * mean,
        covariance,
        width * np.sqrt(seen.count / seen.precision),
        width * np.sqrt(seen.variance / seen.count),
        seen.noise / seen.count,
        tuple(drawn),
        float(seen.usual.max() / seen.count),
    )


def with_prior(information: Array) -> Array:
    """Return the data's information with a prior of unit width added, in its place."""
    diagonal = np.einsum('ii->i', information)
    # Each by its own rounding: that of the largest entry would outweigh the prior of the others.
    diagonal *= 1.0 + ROUNDING
    diagonal += 1.0
    return information


def hidden(rows: Rows, frames: NDArray[np.bool_]) -> NDArray[np.bool_]:
    """Return which coordinates, but those of frames, no data like these could show, shape (P,)."""
    columns = rows.columns
    basis = np.linalg.svd(columns[frames & columns.any(axis=1)], full_matrices=False)[2]
    square = np.einsum('ij,ij->i', columns, columns)
    own = square if rows.moved is None else rows.moved**2
    remaining = square - ((columns @ basis.T) ** 2).sum(axis=1)
    return np.asarray(~frames & (remaining <= HIDDEN**2 * own))


@dataclass
class _Seen:
    """Sums over the models looked at, coordinates in units of their widths."""

    mean: Array
    square: Array
    precision: Array
    variance: Array
    usual: Array
    noise: float = 0.0
    count: int = 0


@dataclass
class _Chain:
    """One model after the other."""

    rows: Rows
    prior: Prior
    expected: float
    rng: np.random.Generator = field(default_factory=lambda: np.random.default_rng(SEED))

    def __post_init__(self) -> None:
        rows, prior = self.rows, self.prior
        width = prior.width
        self.normal = rows.share * np.outer(width, width) * rows.products.columns
        self.right = rows.share * width * rows.products.residual
        self.middle = prior.middle / prior.width
        self.hidden = hidden(rows, prior.group < 0)
        curves = [np.flatnonzero(prior.group == k) for k in np.flatnonzero(prior.tied)]
        self.tied = [each for each in curves if not self.hidden[each].all()]
        for each in self.tied:
            self.hidden[each] = False
        self.small = (prior.group >= 0) & ~self.hidden
        self.single = self.small & ~prior.tied[prior.group]
        self.counted = self.single.copy()
        self.counted[[each[0] for each in self.tied]] = True
        # What was found is as large as it was found, for the chain may come upon it late.
        off = np.log(np.maximum(np.abs(self.middle), EMPTY))[:, None] - np.log(SIZES)
        start = np.where(self.middle == 0.0, SIZES[2], SIZES[np.abs(off).argmin(axis=1)])
        self.size, self.noise = np.where(self.small, start, 1.0), self.expected
        self.belief = np.tile(BELIEF, (prior.pool.size, 1))
        n = prior.width.size
        zeros = (np.zeros(n), np.zeros((n, n)), np.zeros(n), np.zeros(n), np.zeros(2))
        self.seen = _Seen(*zeros)

    def step(self, *, look: bool) -> None:
        """Go on to the next model, and take a look at what is known given this one's sizes."""
        lower, half = self._solved()
        random = self.rng.standard_normal(half.size)
        mean, drawn = self._coordinates(lower, np.stack([half, half + random], axis=1))
        if look:
            self._look(lower, mean)
        self._noise(drawn)
        self._sizes()
        self._usual()

    def _solved(self) -> tuple[Array, Array]:
        """Return the root of the information in units of the sizes, and what it turns the pull into."""
        size = self.size
        system = np.outer(size, size)
        system *= self.normal
        system /= self.noise
        lower = root_of(with_prior(system))
        wanted = size * self.right / self.noise + self.middle / size
        return lower, dtrtrs(lower, wanted, lower=1)[0]

    def _coordinates(self, lower: Array, half: Array) -> Array:
        """Return the coordinates of solutions that are half done (P, K), shape (K, P)."""
        return np.asarray(self.size * dtrtrs(lower, half, lower=1, trans=1)[0].T)

    def _covariance(self, lower: Array) -> Array:
        """Return the covariance of the coordinates by a root of the information, which is used up."""
        covariance = inverse_of(lower)
        covariance *= self.size
        covariance *= self.size[:, None]
        return covariance

    def _look(self, lower: Array, mean: Array) -> None:
        seen, size = self.seen, self.size
        seen.mean += mean
        seen.square += self._covariance(lower)
        seen.square += np.outer(mean, mean)
        seen.precision += size**-2.0
        seen.variance += size**2
        usual, whose = size[self.counted] >= USUAL, self.prior.pool[self.prior.group[self.counted]]
        parts = (whose == pool for pool in (GEARS, GEOMETRY))
        seen.usual += [usual[part].mean() if part.any() else 0.0 for part in parts]
        seen.noise += self.noise
        seen.count += 1

    def _noise(self, drawn: Array) -> None:
        """Draw the variance of a row, given what the coordinates leave."""
        rows = self.rows
        rss = rows.share * float(rows.residual @ rows.residual)
        left = float(rss - 2.0 * self.right @ drawn + drawn @ self.normal @ drawn)
        freedom = rows.share * rows.residual.size + NOISE_TRUST
        self.noise = (max(left, 0.0) + NOISE_TRUST * self.expected) / self.rng.chisquare(freedom)

    def _sizes(self) -> None:
        """
        Draw the size of every small error given all others, over all values of the coordinates.

        What the data and the other sizes say of a coordinate is a normal law, that of all less its own
        prior; each size is as likely as it makes that law's mean. Another size changes the
        covariance of all coordinates by one product of a column with itself.
        """
        lower, half = self._solved()
        (mean,) = self._coordinates(lower, half[:, None])
        covariance = self._covariance(lower).T  # as BLAS wants it
        for group in self.tied:
            self._shared_size(group, mean, covariance)
        each = self.rng.permutation(np.flatnonzero(self.single))
        luck = np.log(self.belief)[self.prior.group[each]]
        luck += self.rng.gumbel(size=luck.shape)
        squares = (SIZES**2).tolist()
        for j, own in zip(each.tolist(), luck.tolist(), strict=True):
            # Numbers of Python: there are eight sizes, and an array costs as much as a hundred.
            old, variance = float(self.size[j]) ** -2.0, float(covariance[j, j])
            seen, off = max(1.0 / variance - old, 0.0), float(mean[j] - self.middle[j])
            pull = (off / variance) ** 2
            likely = [
                one + (pull * square / (1.0 + square * seen) - log(1.0 + square * seen)) / 2.0
                for square, one in zip(squares, own, strict=True)
            ]
            self.size[j] = SIZES[likely.index(max(likely))]
            more = float(self.size[j]) ** -2.0 - old
            if more != 0.0:
                factor, column = more / (1.0 + more * variance), covariance[:, j].copy()
                mean -= factor * off * column
                dger(-factor, column, column, a=covariance, overwrite_a=1)

    def _shared_size(self, group: NDArray[np.int_], mean: Array, covariance: Array) -> None:
        """Draw the one size of some coordinates, as `_sizes` does; keep mean and covariance so."""
        old, off = self.size[group[0]] ** -2.0, mean[group] - self.middle[group]
        own, columns = covariance[np.ix_(group, group)], covariance[:, group]
        variance, turn = np.linalg.eigh(own)
        variance = np.maximum(variance, ROUNDING * variance[-1])
        squares, seen = SIZES[:, None] ** 2, np.maximum(1.0 / variance - old, 0.0)
        pull, grown = (turn.T @ off) / variance, 1.0 + squares * seen
        likely = (pull**2 * squares / grown - np.log(grown)).sum(axis=1) / 2.0
        likely += np.log(self.belief[self.prior.group[group[0]]])
        self.size[group] = SIZES[(likely + self.rng.gumbel(size=likely.size)).argmax()]
        more = self.size[group[0]] ** -2.0 - old
        if more != 0.0:
            factor = more / (1.0 + more * variance)
            columns = columns @ turn
            mean -= columns @ (factor * (turn.T @ off))
            scaled = (columns * factor).T
            dgemm(-1.0, columns.T, scaled, 1.0, covariance, trans_a=1, overwrite_c=1)

    def _usual(self) -> None:
        """Draw how often each size comes in every family."""
        group, pools = self.prior.group, self.prior.pool
        counts = np.zeros(self.belief.shape)
        chosen = np.searchsorted(SIZES, self.size[self.counted])
        np.add.at(counts, (group[self.counted], chosen), 1.0)
        alike = counts[group[self.hidden]] + OWN * BELIEF
        self.size[self.hidden] = np.sqrt(alike @ SIZES**2 / alike.sum(axis=1))
        for part in (pools == pool for pool in np.unique(pools)):
            common = counts[part].sum(axis=0) + POOLED * BELIEF
            drawn = self.rng.standard_gamma(counts[part] + OWN * common / common.sum())
            drawn = np.maximum(drawn, EMPTY)
            self.belief[part] = drawn / drawn.sum(axis=1, keepdims=True)
