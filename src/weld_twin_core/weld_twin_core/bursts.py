# Copyright 2026 weld_twin contributors
# SPDX-License-Identifier: Apache-2.0
"""Stamps in bursts: samples taken evenly, kept in a buffer, and stamped when they are sent."""

from __future__ import annotations

from typing import NamedTuple

import numpy as np

from .arrays import Array

ENOUGH = 30
"""Stamps below which their steps show no bursts."""
SHORT = 0.1
"""A step of less than this share of the mean step lies inside a burst."""
MANY = 0.4
"""Share of the steps that must be so short; bursts of two have half. Of messages that arrive at
random one step in ten is."""
LEAST = 5
"""Bursts below which there is no rate of bursts."""
SOONEST = 0.05
"""Quantile of the delays of the last sample of a burst that counts as the least; a few may be off."""


class Bursts(NamedTuple):
    """
    What the stamps of a stream look like that was sent in bursts.

    Attributes
    ----------
    count : int
    every : float [s]
        Median time from burst to burst.
    first, step : float [s]
        Stamps as of an even clock, which the last sample of each burst keeps nearly.

    """

    count: int
    every: float
    first: float
    step: float

    @property
    def rate(self) -> float:
        """Return the rate underneath [Hz]."""
        return 1.0 / self.step

    @property
    def words(self) -> str:
        """Return what is to be said of it, to follow the name of the stream."""
        return (
            f'stamped in {self.count} bursts, one every {self.every * 1e3:.3g} ms; '
            f'{self.rate:#.4g} Hz underneath'
        )


def bursts(t: Array) -> Bursts | None:
    """
    Return the bursts of a stream; None where its stamps come one by one.

    Parameters
    ----------
    t : array, shape (N,) [s]
        Stamps, not decreasing.

    Examples
    --------
    Forty samples taken every 0.1 s and sent by fours:

    >>> import numpy as np
    >>> from weld_twin_core.bursts import bursts
    >>> sent = np.repeat(np.arange(10) * 0.4 + 0.3, 4) + np.tile(np.arange(4) * 1e-4, 10)
    >>> print(bursts(sent).count, round(bursts(sent).rate, 2))
    10 10.0

    """
    steps = np.diff(t)
    if t.size < ENOUGH or t[-1] <= t[0]:
        return None
    inside = steps < SHORT * float(steps.mean())
    if inside.mean() < MANY:
        return None
    last = np.append(np.flatnonzero(~inside), t.size - 1)
    if last.size < LEAST:
        return None
    # What was measured last before it was sent waited least.
    step = float(np.polyfit(last, t[last], 1)[0])
    first = float(np.quantile(t[last] - step * last, SOONEST))
    return Bursts(last.size, float(np.median(np.diff(t[last]))), first, step)
