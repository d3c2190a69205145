# Copyright 2026 weld_twin contributors
# SPDX-License-Identifier: Apache-2.0
"""Stamps in bursts: samples taken evenly, kept in a buffer, and stamped when they are sent."""

from __future__ import annotations

from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray

from .arrays import Array

_ENOUGH = 30
"""Stamps below which their steps show no bursts."""
_SHORT = 0.1
"""A step of less than this share of the mean step lies inside a burst."""
_MANY = 0.4
"""Share of the steps that must be so short: bursts of two have half, messages at random a tenth."""
_LEAST = 5
"""Bursts below which there is no rate of bursts."""
_WINDOW = 5
"""Bursts whose least delay is that of the time: some were sent right after a sample."""
_SKIPPED = 0.6
"""Steps that the least delay must grow by at once for a sample to have been lost."""
_SETTLED = 3
"""Times that lost samples and the step are found in turn."""
_SOONEST = 0.05
"""Quantile of the delays of the last sample of a burst that counts as the least; a few may be off."""


class Bursts(NamedTuple):
    """What the stamps of a stream look like that was sent in bursts."""

    number: int
    every: float
    """Median time from burst to burst [s]."""
    first: float
    step: float
    """Stamps as of an even clock, which the last sample of each burst keeps nearly [s]."""
    lost: NDArray[np.int_]
    """Samples before which one is missing; twice where two are."""

    @property
    def rate(self) -> float:
        """Return the rate underneath [Hz]."""
        return 1.0 / self.step

    @property
    def words(self) -> str:
        """Return what is to be said of it, to follow the name of the stream."""
        return (
            f'stamped in {self.number} bursts, one every {self.every * 1e3:.3g} ms; '
            f'{self.rate:#.4g} Hz underneath'
        )


def bursts(t: Array) -> Bursts | None:
    """Return the bursts of stamps (N,) [s], not decreasing; None where they come one by one."""
    steps = np.diff(t)
    if t.size < _ENOUGH or t[-1] <= t[0]:
        return None
    inside = steps < _SHORT * float(steps.mean())
    if inside.mean() < _MANY:
        return None
    last = np.append(np.flatnonzero(~inside), t.size - 1)
    if last.size < _LEAST:
        return None
    start, lost = np.append(0, last[:-1] + 1), np.zeros(0, dtype=int)
    for _ in range(_SETTLED):
        counted = last + np.searchsorted(lost, last, side='right')
        step = float(np.polyfit(counted, t[last], 1)[0])
        lost = _lost(t[last] - step * last, start, step)
    counted = last + np.searchsorted(lost, last, side='right')
    step = float(np.polyfit(counted, t[last], 1)[0])
    # What was measured last before it was sent waited least.
    first = float(np.quantile(t[last] - step * counted, _SOONEST))
    return Bursts(last.size, float(np.median(np.diff(t[last]))), first, step, lost)


def _lost(delay: Array, start: NDArray[np.int_], step: float) -> NDArray[np.int_]:
    """Return the samples before which one is missing: from there on all come a step later."""
    out: list[int] = []
    for k in range(1, delay.size):
        before = float(delay[max(k - _WINDOW, 0) : k].min())
        later = float(delay[k : k + _WINDOW].min()) - before
        if later > _SKIPPED * step and delay.size - k >= 2:
            missing = max(round(later / step), 1)
            out += [int(start[k])] * missing
            delay = np.where(np.arange(delay.size) >= k, delay - missing * step, delay)
    return np.array(out, dtype=int)


def evenly(first: float, step: float, lost: NDArray[np.int_], size: int, count: int) -> Array:
    """
    Return the stamps of an even clock, shape (size,) [s]: evenly thinned where fewer than count.

    ``lost`` is as `Bursts` has it, counted in ``count`` samples.
    """
    index = np.arange(size) * (count / size)
    return np.asarray(first + step * (index + np.searchsorted(lost, index, side='right')))


ONE_CLOCK = 'Stamp both streams with one clock, or synchronise the two (PTP, NTP)'
"""The remedy, in the imperative, wherever two clocks are reported."""


def apart(joints: tuple[float, float], measured: tuple[float, float]) -> str | None:
    """Return that measurements and joint states have no time [s] in common; None if they have."""
    gap = max(measured[0] - joints[1], joints[0] - measured[1])
    if gap <= 0.0:
        return None
    return (
        f'measurements and joint states do not overlap in time, they are {gap:.3f} s apart: their '
        'stamps come from two clocks'
    )
