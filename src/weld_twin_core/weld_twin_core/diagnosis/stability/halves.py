# Copyright 2026 weld_twin contributors
# SPDX-License-Identifier: Apache-2.0
"""Halves of the measurements, in pairs of which one holds what the other lacks."""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray

from ...arrays import Array
from ..algebra.problem import PLACES, Problem
from ..unseen.regions import posture_regions
from ..unseen.unseen_stretches import BLOCKS

PAIRS = 8
"""Pairs of halves drawn of stretches of time, and as many of regions of posture: 32 halves tell a
share to a tenth, and more would cost more than a search that is worth repeating."""
SEED = 11
"""Of the draws: the same recordings give the same answer."""


def parts_of(problem: Problem) -> list[Array]:
    """Return labels of every row, (rows,) each: stretches of time, and regions of posture."""
    stretches = problem.block_labels(BLOCKS)
    # Regions would have places of contacts on both sides.
    if problem.untracked and problem.places >= PLACES:
        return [stretches]
    return [stretches, posture_regions(problem)]


def halves(counts: list[int]) -> NDArray[np.bool_]:
    """
    Return which parts are in each half, shape (halves + 1, all parts); the last holds everything.

    Complementary pairs of halves [1]_, of the parts of one kind at a time. No rows where nothing
    can be halved.

    Parameters
    ----------
    counts : list of int
        How many parts there are of every kind; one alone cannot be halved.

    References
    ----------
    .. [1] R. D. Shah, R. J. Samworth, "Variable selection with error control: another look at
       stability selection", J. R. Statist. Soc. B 75, 2013.

    """
    draws, out, start = np.random.default_rng(SEED), [], 0
    for count in counts:
        for _ in range(PAIRS if count > 1 else 0):
            order = start + draws.permutation(count)
            for part in (order[: count // 2], order[count // 2 :]):
                half = np.zeros(sum(counts), bool)
                half[part] = True
                out.append(half)
        start += count
    if out:
        out.append(np.arange(sum(counts)) < counts[0])
    return np.array(out).reshape(-1, sum(counts))
