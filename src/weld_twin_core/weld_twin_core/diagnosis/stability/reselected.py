# Copyright 2026 weld_twin contributors
# SPDX-License-Identifier: Apache-2.0
"""The search repeated on many halves at once, as small linear algebra."""

from __future__ import annotations

import numpy as np

from ...arrays import Array
from ..hypotheses.seed_systems import PERFECT
from .tableau import Mask, Tableau

MOVES = 12
"""Candidates that may come or go one by one before a search is over."""
SWAPS = 2
"""Rounds in which every candidate in a model is held against all others in its place."""


class Prices:
    """
    What a candidate must pay for.

    Parameters
    ----------
    counts : array, shape (H,)
        Independent rows of every half.
    freedom, trials : array, shape (U,)
        Coordinates of every candidate, and the logarithm of how many it was chosen among.
    enter : float [nats]
        Evidence from which on one enters or stays.

    """

    def __init__(self, counts: Array, freedom: Array, trials: Array, enter: float) -> None:
        self.counts, self.enter = counts, enter
        self.each = 0.5 * freedom * np.log(counts)[:, None] + trials

    def evidence(self, more: Array, less: Array) -> Array:
        """Return what a fall of the sum of squares from more to less tells, (H, U) nats."""
        ratio = np.log(more / np.maximum(less, PERFECT * more))
        return np.asarray(0.5 * self.counts[:, None] * ratio - self.each)


def reselected(table: Tableau, prices: Prices) -> Mask:
    """
    Return which candidates a search takes, from where a tableau stands, shape (H, U).

    One by one the best enters and what is not worth its price leaves; then each is held against all
    others in its place.

    Parameters
    ----------
    table : Tableau
        Swept in place.
    prices : Prices

    """
    _stepwise(table, prices)
    for _ in range(SWAPS):
        if not _swapped(table, prices):
            break
        _stepwise(table, prices)
    return np.array(table.taken)


def _stepwise(table: Tableau, prices: Prices) -> None:
    """Let candidates come and go until none of either is left."""
    for _ in range(MOVES):
        entered = _entered(table, prices)
        if not (_left(table, prices) or entered):
            break


def _entered(table: Tableau, prices: Prices) -> bool:
    """Take in the best candidate of every half that is worth it; return whether any was."""
    rss = table.rss[:, None]
    worth = prices.evidence(rss, rss - np.minimum(table.worth(), rss))
    worth[table.taken] = -np.inf
    return _swept(table, worth.argmax(axis=1), worth.max(axis=1) > prices.enter)


def _left(table: Tableau, prices: Prices) -> bool:
    """Take out the least of every half that is not worth its price; return whether any was."""
    rss = table.rss[:, None]
    worth = prices.evidence(rss + table.worth(), rss)
    worth[~table.taken] = np.inf
    return _swept(table, worth.argmin(axis=1), worth.min(axis=1) < prices.enter)


def _swept(table: Tableau, which: Array, wanted: Mask) -> bool:
    """Sweep one candidate in each of some halves; return whether there were any."""
    for k in np.unique(which[wanted]):
        table.sweep(np.flatnonzero(wanted & (which == k)), int(k))
    return bool(wanted.any())


def _swapped(table: Tableau, prices: Prices) -> bool:
    """Put a better candidate in the place of each that a model has; return whether any was put."""
    before = table.taken.copy()
    for k in np.flatnonzero(before.any(axis=0)):
        rows = table.taken[:, k].copy()
        table.sweep(np.flatnonzero(rows), int(k))
        rss = table.rss[:, None]
        worth = prices.evidence(rss, rss - np.minimum(table.worth(), rss))
        worth[table.taken] = -np.inf
        _swept(table, worth.argmax(axis=1), rows)
    return bool((table.taken != before).any())
