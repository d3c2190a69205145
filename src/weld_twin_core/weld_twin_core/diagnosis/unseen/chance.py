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
from ..algebra.definite import Index, unit_diagonal
from ..algebra.noise_floor import spread_of
from ..negligible import EMPTY, FLAT, REPEATED

DRAWS = 100
"""Drawings of noise. What none of them reaches noise reaches once in a hundred times."""
FEW = 400
"""Rows up to which chance counts: of more, the best of a hundred predicts no twentieth part."""
CLEAR = 80.0
"""Rows times logarithm of the fall, from which on nothing is drawn: the best of a hundred groups of ten
columns reaches a chi-square of 45 once in ten thousand times."""
SEED = 3
"""Of the drawings: the same recordings give the same answer."""


class Candidates(NamedTuple):
    fixed: Array  # whitened columns that are always fitted, shape (P, rows)
    precision: Array  # their prior precision, shape (P,)
    groups: Iterable[Array]  # one group is found at a time, shape (E, rows)
    ridges: Sequence[float]  # prior precisions at which it is tried
    ways: Sequence[Array]
    """Ways to divide the rows into parts that are left out in turn, shape (rows,); the one that
    shows least counts."""


def noise(rows: int) -> Array:
    return np.random.default_rng(SEED).standard_normal((DRAWS, rows))


def may_be_chance(rows: int, gain: float) -> bool:
    """Return whether the best of many could have gained a share of so many rows of noise."""
    return rows <= FEW and -rows * float(np.log(max(1.0 - gain, EMPTY))) <= CLEAR


def chance_gain(candidates: Candidates, steady: float, *, pooled: bool = False) -> float:
    """
    Return the share of noise that the best of all candidates hardly ever predicts.

    steady: standard errors that a gain must have to count.
    pooled: whether all ways to divide count together, and not the one that shows least.
    """
    rest, remaining = _noise_left(candidates.fixed, candidates.precision)
    ways = [_parts(rest, remaining, labels) for labels in candidates.ways]
    best = 0.0
    for group in candidates.groups:
        each = [_shares(own, group, rest, remaining, candidates.ridges, steady) for own in ways]
        best = max(best, float((np.mean if pooled else np.min)(each, axis=0).max()))
    return best


def _noise_left(columns: Array, precision: Array) -> tuple[Array, Array]:
    """Return what a fit leaves of unit rows, (rows, rows), and of drawings of noise, (rows, DRAWS)."""
    system, size = unit_diagonal(columns @ columns.T + np.diag(precision), REPEATED)
    unit = columns / size[:, None]
    rest = np.eye(columns.shape[1]) - unit.T @ np.linalg.solve(system, unit)
    return rest, rest @ noise(columns.shape[1]).T


class _Part(NamedTuple):
    """Rows that are left out together, what undoes their own part in a fit, and what it leaves there."""

    rows: Index
    undone: Array
    left: Array


def _parts(rest: Array, remaining: Array, labels: Array) -> list[_Part]:
    """Return the parts, from what a fit leaves of unit rows, (rows, rows), and of targets."""
    out = []
    for part in np.unique(labels):
        rows = np.flatnonzero(labels == part)
        undone = np.linalg.pinv(rest[np.ix_(rows, rows)], rcond=FLAT, hermitian=True)
        out.append(_Part(rows, np.asarray(undone), undone @ remaining[rows]))
    return out


def _shares(
    parts: Sequence[_Part],
    group: Array,
    rest: Array,
    remaining: Array,
    ridges: Sequence[float],
    steady: float,
) -> Array:
    """Return the steady share of every target that a group predicts at every ridge, shape (R, K)."""
    if len(parts) < 2:  # one part does not show what is steady
        return np.zeros((len(ridges), remaining.shape[1]))
    beside = group @ rest
    normal, pull = beside @ group.T, group @ remaining
    held = np.array(ridges)[:, None, None] * np.eye(len(group))
    after = []
    for part in parts:
        own = beside[:, part.rows]
        near = part.undone @ own.T
        x = np.linalg.solve(normal - own @ near + held, pull - own @ part.left)
        after.append(((part.left - near @ x) ** 2).sum(axis=1))
    before = np.stack([(part.left**2).sum(axis=0) for part in parts])
    fall = before[:, None] - np.stack(after)
    error = fall.std(axis=0, ddof=1) / np.sqrt(len(parts))
    sure = fall.mean(axis=0) >= steady * error
    return np.asarray(np.where(sure, fall.sum(axis=0) / before.sum(axis=0), 0.0))


def chance_ratio(columns: Array, precision: Array, ways: Sequence[Array], *, known: bool) -> float:
    """
    Return how many times wider than a floor what is left of noise on unseen parts is at the most.

    A fit of few stations takes up noise, so that it leaves too little there and too much elsewhere.

    columns, precision, ways: all that is fitted, (P, rows), (P,); parts of every row, (rows,).
    known: whether the floor is known apart from what the fit leaves.
    """
    rows = columns.shape[1]
    if rows > FEW:
        return 1.0
    rest, remaining = _noise_left(columns, precision)
    each = (_parts(rest, remaining, labels) for labels in ways)
    squares = [np.sum([(part.left**2).sum(axis=0) for part in own], axis=0) for own in each]
    unseen = np.sqrt(np.max(squares, axis=0) / rows)
    floors = 1.0 if known else np.array([spread_of(each) for each in remaining.T])
    return float((unseen / floors).max())
