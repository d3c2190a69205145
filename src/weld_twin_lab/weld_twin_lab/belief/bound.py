# SPDX-FileCopyrightText: weld_twin contributors
# SPDX-License-Identifier: Apache-2.0
"""
From where an answer may be told as sure, so that being sure and wrong is bounded.

Learn then test [1]_ with fixed-sequence testing: thresholds are tried from the highest down, each
by the exact binomial bound [2]_ on the share of cases that are sure and wrong, and the last one
that passes before the first that does not is taken. The bound holds, with the confidence asked
for, for cases that are exchangeable with those it was made from, and that took no part in the
fit.

References
----------
.. [1] A. Angelopoulos, S. Bates, E. Candes, M. Jordan, L. Lei, "Learn then test: calibrating
   predictive algorithms to achieve risk control", Ann. Appl. Statist. 19, 2025.
.. [2] C. Clopper, E. Pearson, "The use of confidence or fiducial limits illustrated in the case
   of the binomial", Biometrika 26, 1934.

"""

from __future__ import annotations

from typing import NamedTuple

import numpy as np
from scipy.stats import beta

from weld_twin_core.arrays import Array


class Bound(NamedTuple):
    """
    A threshold, and what is known of it.

    Attributes
    ----------
    sure_from : float
        Above 1 where no threshold keeps the risk: then nothing is told as sure.
    wrong, cases : int
        Sure and wrong at this threshold, of how many cases.
    most : float
        Upper limit of the share that is sure and wrong.
    sure : float
        Share of the cases that are sure.

    """

    sure_from: float
    wrong: int
    cases: int
    most: float
    sure: float


NEVER = 1.01
"""A threshold that no probability reaches."""
GRID = np.linspace(0.995, 0.5, 100)
"""Thresholds tried, chosen before any data: half a per cent apart."""


def bounded(probability: Array, right: Array, risk: float, error: float) -> Bound:
    """
    Return the lowest threshold that keeps the share of cases sure and wrong below a risk.

    Parameters
    ----------
    probability : array, shape (N,)
        Of cases that took no part in the fit.
    right : array of bool, shape (N,)
    risk : float
        Share of all cases that may be sure and wrong.
    error : float
        Probability that the bound does not hold.

    """
    p, good = np.asarray(probability, dtype=float), np.asarray(right, dtype=bool)
    best = Bound(NEVER, 0, p.size, upper_limit(0, p.size, error), 0.0)
    for threshold in GRID:
        sure = p >= threshold
        wrong = int((sure & ~good).sum())
        most = upper_limit(wrong, p.size, error)
        if most > risk:
            break
        best = Bound(float(threshold), wrong, p.size, most, float(sure.mean()))
    return best


def upper_limit(wrong: int, cases: int, error: float) -> float:
    """
    Return the exact upper limit of a share.

    Parameters
    ----------
    wrong, cases : int
    error : float
        Probability that the share is larger.

    """
    if wrong >= cases:
        return 1.0
    return float(beta.ppf(1.0 - error, wrong + 1, cases - wrong))
