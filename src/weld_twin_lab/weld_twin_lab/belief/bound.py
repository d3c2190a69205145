# Copyright 2026 weld_twin contributors
# SPDX-License-Identifier: Apache-2.0
"""
From where an answer may be told as sure, so that being sure and wrong is bounded.

Conformal risk control [1]_: of N cases that took no part in the fit, the lowest threshold is taken
at which (wrong and sure + 1) / (N + 1) stays below the risk. One more case, exchangeable with
these, is then sure and wrong with at most that probability. How far the share itself may be off
is told by the exact binomial limit [2]_.

References
----------
.. [1] A. Angelopoulos, S. Bates, A. Fisch, L. Lei, T. Schuster, "Conformal risk control", ICLR
   2024.
.. [2] C. Clopper, E. Pearson, "The use of confidence or fiducial limits illustrated in the case
   of the binomial", Biometrika 26, 1934.

"""

from __future__ import annotations

from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray
from scipy.stats import beta

from weld_twin_core.arrays import Array


class Bound(NamedTuple):
    """A threshold, and what is known of it."""

    sure_from: float
    """Above 1 where no threshold keeps the risk: then nothing is told as sure."""
    wrong: int
    cases: int
    """Sure and wrong at this threshold, of how many cases."""
    expected: float
    """Bound on the probability that one more such case is sure and wrong."""
    most: float
    """Upper limit of the share that is sure and wrong, with 90 % confidence."""
    sure: float
    """Share of the cases that are sure."""


NEVER = 1.01
"""A threshold that no probability reaches."""
GRID = np.linspace(0.998, 0.5, 250)
"""Thresholds tried, chosen before any data: two in a thousand apart."""
ERROR = 0.1
"""How often the upper limit of the share may fail to hold."""


def bounded(probability: Array, right: Array, risk: float) -> Bound:
    """
    Return the lowest threshold at which one more case is sure and wrong too seldom to matter.

    probability: of cases that took no part in the fit, shape (N,).
    right: shape (N,).
    risk: probability that a case may be sure and wrong.
    """
    p, good = np.asarray(probability, dtype=float), np.asarray(right, dtype=bool)
    best = NEVER
    for threshold in GRID:
        wrong = int(((p >= threshold) & ~good).sum())
        if (wrong + 1) / (p.size + 1) > risk:
            break
        best = float(threshold)
    return at(best, p, good)


def precise(probability: Array, right: Array, risk: float) -> Bound:
    """
    Return the lowest threshold at which one more sure case is wrong too seldom to matter.

    probability: of cases that took no part in the fit, shape (N,).
    right: shape (N,).
    risk: share of the sure cases that may be wrong.
    """
    p, good = np.asarray(probability, dtype=float), np.asarray(right, dtype=bool)
    best = NEVER
    for threshold in GRID:
        sure = p >= threshold
        if int((sure & ~good).sum()) + 1 <= risk * (int(sure.sum()) + 1):
            best = float(threshold)
    return at(best, p, good)


def at(threshold: float, probability: Array, right: NDArray[np.bool_]) -> Bound:
    """
    Return what is known of a threshold.

    probability: shape (N,).
    right: shape (N,).
    """
    sure = probability >= threshold
    wrong, cases = int((sure & ~right).sum()), probability.size
    expected = (wrong + 1) / (cases + 1)
    return Bound(
        threshold, wrong, cases, expected, upper_limit(wrong, cases, ERROR), float(sure.mean())
    )


def upper_limit(wrong: int, cases: int, error: float) -> float:
    """
    Return the exact upper limit of a share.

    error: probability that the share is larger.
    """
    if wrong >= cases:
        return 1.0
    return float(beta.ppf(1.0 - error, wrong + 1, cases - wrong))
