# SPDX-FileCopyrightText: weld_twin contributors
# SPDX-License-Identifier: Apache-2.0
"""How much a unit explains: the fall of the sum of squares against what its freedom would buy."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from ...effects.effect import Effect
from ..algebra.gram import Gram, Index
from .library import Unit

PERFECT = 1e-12
"""Share of the sum of squares that counts as left at the least; keeps a logarithm finite."""
FEWEST = 3.0
"""Independent rows at the least: a position has three coordinates."""


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


def evidence(rss: float, gain: float, freedom: float, effective: float) -> float:
    """
    Return the nats that a fall of the sum of squares is worth, noise level unknown.

    .. math:: \\tfrac{n}{2} \\log\\frac{RSS}{RSS - gain} - \\tfrac{p}{2} \\log n

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
    left = max(rss - gain, PERFECT * rss)
    count = max(effective, FEWEST)
    return 0.5 * count * float(np.log(rss / left)) - 0.5 * freedom * float(np.log(count))


def best_choice(gram: Gram, unit: Unit, effective: float) -> Choice | None:
    """
    Return a unit's best seed and columns on normal equations conditioned on the model.

    Parameters
    ----------
    gram : Gram
        Normal equations that all hypotheses share.
    unit : Unit
        What enters or stays out together.
    effective : float
        Number of independent rows.

    """
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
        everything = evidence(gram.rss, gram.gain(columns), columns.size, effective)
        best_all = (columns, everything)
    else:
        best_all = (columns, -np.inf)
    while rest:
        trials = [
            evidence(gram.rss, gram.gain(np.append(chosen, c)), chosen.size + 1, effective)
            for c in rest
        ]
        k = int(np.argmax(trials))
        if trials[k] <= nats:
            break
        nats = trials[k]
        chosen = np.append(chosen, rest.pop(k))
    return (best_all[0], best_all[1]) if best_all[1] > nats else (chosen, nats)
