# Copyright 2026 weld_twin contributors
# SPDX-License-Identifier: Apache-2.0
"""
What noise alone would look like: the best of many candidates predicts some of it, too.

Of a hundred free forms one predicts a good part of what fifteen stations leave, by chance. So noise is
drawn, all that could have been found is tried on it, and what is found in the data has to be more. A
part left out is predicted in closed form: a fit is a matrix H, and what it leaves on the rows b without
them is (I - H_bb)^-1 times what it leaves there with them [1]_.

References
----------
.. [1] R. D. Cook, S. Weisberg, "Residuals and Influence in Regression", 1982, section 2.2.

"""

from __future__ import annotations

from collections.abc import Iterable, Sequence
from typing import NamedTuple

import numpy as np

from ...arrays import Array
from ..algebra.noise_floor import spread_of
from .folds import steadiness

DRAWS = 100
"""Drawings of noise. What none of them reaches noise reaches once in a hundred times."""
FEW = 400
"""Rows up to which chance counts: of more, the best of a hundred candidates predicts no twentieth
part, which is what is asked for."""
CLEAR = 80.0
"""Rows times logarithm of the fall, from which on nothing is drawn: the best of a hundred groups of ten
columns reaches a chi-square of 45 once in ten thousand times."""
SEED = 3
"""Of the drawings: the same recordings give the same answer."""


class Candidates(NamedTuple):
    """
    What could have been found.

    Attributes
    ----------
    fixed : array, shape (P, rows)
        Whitened columns that are always fitted.
    precision : array, shape (P,)
        Their prior precision.
    groups : iterable of array, shape (E, rows)
        One group is found at a time.
    ridges : sequence of float
        Prior precisions at which it is tried.
    ways : sequence of array of int, shape (rows,)
        Ways to divide the rows into parts that are left out in turn; the one that shows least counts.

    """

    fixed: Array
    precision: Array
    groups: Iterable[Array]
    ridges: Sequence[float]
    ways: Sequence[Array]


def left_out(columns: Array, precision: Array, labels: Array | None, targets: Array) -> Array:
    """
    Return what columns leave of targets on every part, fitted on the others, shape (K, rows).

    Without parts, what they leave where they are fitted.

    Parameters
    ----------
    columns : array, shape (P, rows)
    precision : array, shape (P,)
    labels : array of int, shape (rows,), or None
    targets : array, shape (K, rows)

    """
    system = columns @ columns.T + np.diag(precision)
    system[np.diag_indices_from(system)] *= 1.0 + 1e-11
    hat = columns.T @ np.linalg.solve(system, columns)
    out = targets - targets @ hat
    for part in () if labels is None else np.unique(labels):
        rows = np.flatnonzero(labels == part)
        own = np.eye(rows.size) - hat[np.ix_(rows, rows)]
        out[:, rows] = np.linalg.lstsq(own, out[:, rows].T, rcond=1e-9)[0].T
    return np.asarray(out)


def noise(rows: int) -> Array:
    """Return drawings of whitened noise, shape (DRAWS, rows)."""
    return np.random.default_rng(SEED).standard_normal((DRAWS, rows))


def chance_gain(candidates: Candidates, gain: float, steady: float) -> float:
    """
    Return the share of noise that the best of all candidates hardly ever predicts.

    Zero where there are so many rows, or so much is gained, that nothing has to be drawn.

    Parameters
    ----------
    gain : float
        What was gained.
    steady : float
        Standard errors that a gain must have to count.

    """
    rows = candidates.fixed.shape[1]
    if rows > FEW or -rows * np.log(max(1.0 - gain, 1e-300)) > CLEAR:
        return 0.0
    targets = noise(rows)
    before = [
        _squares(left_out(candidates.fixed, candidates.precision, labels, targets), labels)
        for labels in candidates.ways
    ]
    best = np.zeros(len(targets))
    for group in candidates.groups:
        columns = np.concatenate([candidates.fixed, group])
        for ridge in candidates.ridges:
            held = np.concatenate([candidates.precision, np.full(len(group), ridge)])
            least = np.full(len(targets), np.inf)
            for labels, was in zip(candidates.ways, before, strict=True):
                after = _squares(left_out(columns, held, labels, targets), labels)
                share = 1.0 - after.sum(axis=1) / was.sum(axis=1)
                sure = np.array([steadiness(*pair) for pair in zip(was, after, strict=True)])
                least = np.minimum(least, np.where(sure >= steady, share, 0.0))
            best = np.maximum(best, least)
    return float(best.max())


def chance_ratio(columns: Array, precision: Array, ways: Sequence[Array], *, known: bool) -> float:
    """
    Return how many times wider than a floor what is left of noise on unseen parts is at the most.

    A fit of few stations takes up part of the noise, so that it leaves too little where it was fitted
    and too much elsewhere. One where there are many rows.

    Parameters
    ----------
    columns : array, shape (P, rows)
        All that is fitted.
    precision : array, shape (P,)
    ways : sequence of array of int, shape (rows,)
    known : bool
        Whether the floor is known apart from what the fit leaves.

    """
    rows = columns.shape[1]
    if rows > FEW:
        return 1.0
    targets = noise(rows)
    unseen = [(left_out(columns, precision, w, targets) ** 2).mean(axis=1) for w in ways]
    floors = np.ones(len(targets))
    if not known:
        floors = np.array(
            [spread_of(each) for each in left_out(columns, precision, None, targets)]
        )
    return float((np.sqrt(np.max(unseen, axis=0)) / floors).max())


def _squares(residual: Array, labels: Array) -> Array:
    """Return the squared error of every part, shape (K, parts)."""
    return np.stack([(residual[:, labels == b] ** 2).sum(axis=1) for b in np.unique(labels)], 1)
