# SPDX-FileCopyrightText: weld_twin contributors
# SPDX-License-Identifier: Apache-2.0
"""How much a unit explains: the fall of the sum of squares against what its freedom would buy."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from ...arrays import Array
from ...effects.effect import Effect
from ..hypotheses.library import Unit
from .gram import Gram, Index


@dataclass(frozen=True, eq=False)
class Choice:
    """
    A unit with the seed and columns that serve it best.

    Attributes
    ----------
    unit : Unit
    seed : int
    columns : array of int
        Of the seed, those that earn their place.
    nats : float
        Log of the evidence ratio against leaving the unit out (Schwarz's approximation).

    """

    unit: Unit
    seed: int
    columns: Index
    nats: float

    def effect(self, gram: Gram) -> Effect:
        """Return the effect that the linear coefficients stand for."""
        seed = self.unit.seeds[self.seed]
        all_columns = self.unit.columns[self.seed]
        coefficients = np.zeros(all_columns.size)
        coefficients[np.isin(all_columns, self.columns)] = gram.solve(self.columns)
        return seed.from_atoms(coefficients)


def evidence(gram: Gram, gain: float, freedom: float, effective: float) -> float:
    """
    Return the nats that a fall of the sum of squares is worth, noise level unknown.

    .. math:: \\tfrac{n}{2} \\log\\frac{RSS}{RSS - gain} - \\tfrac{p}{2} \\log n

    ``effective`` is the number of independent rows [1]_: autocorrelated residuals carry less
    than their count.

    References
    ----------
    .. [1] G. Schwarz, "Estimating the dimension of a model", Ann. Statist. 6, 1978.

    """
    left = max(gram.rss - gain, 1e-12 * gram.rss)
    count = max(effective, 3.0)
    return 0.5 * count * float(np.log(gram.rss / left)) - 0.5 * freedom * float(np.log(count))


def best_choice(gram: Gram, unit: Unit, effective: float) -> Choice | None:
    """Return a unit's best seed and columns on normal equations conditioned on the model."""
    best: Choice | None = None
    tried = float(np.log(unit.trials))
    for k, columns in enumerate(unit.columns):
        chosen, nats = _grow(gram, gram.live(columns), effective)
        if chosen.size and (best is None or nats - tried > best.nats):
            best = Choice(unit, k, chosen, nats - tried)
    return best


def _grow(gram: Gram, columns: Index, effective: float) -> tuple[Index, float]:
    """Return the columns that are worth it, added one at a time, and their evidence."""
    chosen = columns[:0]
    nats = -np.inf
    rest = list(columns)
    if columns.size > 1:
        everything = evidence(gram, gram.gain(columns), columns.size, effective)
        best_all = (columns, everything)
    else:
        best_all = (columns, -np.inf)
    while rest:
        trials = [
            evidence(gram, gram.gain(np.append(chosen, c)), chosen.size + 1, effective)
            for c in rest
        ]
        k = int(np.argmax(trials))
        if trials[k] <= nats:
            break
        nats = trials[k]
        chosen = np.append(chosen, rest.pop(k))
    return (best_all[0], best_all[1]) if best_all[1] > nats else (chosen, nats)


def effective_share(residual: Array, rows: tuple[int, ...], samples: tuple[int, ...]) -> float:
    """
    Return the share of rows that count as independent, from the residual's autocorrelation.

    Initial positive sequence estimate [1]_ on every component of every recording.

    Parameters
    ----------
    residual : array, shape (rows,)
        Whitened, as `Problem.whitened` lays it out.
    rows, samples : tuple of int
        Components and samples of every recording.

    References
    ----------
    .. [1] C. J. Geyer, "Practical Markov chain Monte Carlo", Statist. Sci. 7, 1992.

    """
    at, shares, counts = 0, [], []
    for c, m in zip(rows, samples, strict=True):
        part = residual[at : at + c * m].reshape(m, c)
        at += c * m
        times = _correlation_time(part - part.mean(axis=0))
        shares.append(1.0 / times)
        counts.append(c * m)
    return float(np.average(shares, weights=counts))


def _correlation_time(part: Array) -> float:
    """Return 1 + 2 sum of autocorrelations until a pair of them is not positive."""
    m = part.shape[0]
    if m < 8:
        return 1.0
    size = 1 << (2 * m - 1).bit_length()
    spectrum = np.abs(np.fft.rfft(part, size, axis=0)) ** 2
    covariance = np.fft.irfft(spectrum.sum(axis=1), size)[: m // 2]
    if covariance[0] <= 0.0:
        return 1.0
    rho = covariance / covariance[0]
    even = len(rho) // 2 * 2
    pairs = rho[0:even:2] + rho[1:even:2]
    stop = int(np.argmax(pairs <= 0.0)) if (pairs <= 0.0).any() else len(pairs)
    return float(max(1.0, 2.0 * pairs[:stop].sum() - 1.0))
