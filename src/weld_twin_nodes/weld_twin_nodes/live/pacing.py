# Copyright 2026 weld_twin contributors
# SPDX-License-Identifier: Apache-2.0
"""When to send which sample: in real time, or as fast as the listeners keep up."""

from __future__ import annotations

import numpy as np

STALLED = 5.0
"""Seconds without an answer after which the window is taken to be too small: a loaded machine may
starve a listener for a second or two, and a wider window would then overflow its queue."""


class Pump:
    """
    Hands out sample numbers to send.

    stamps: header stamps, increasing, shape (N,) [ns].
    playback: run speed against the stamps; 0 is as fast as the listeners keep up.
    window: how many samples may be under way that nobody has answered yet.
    answered: whether answers will be told at all; without them the window is not kept.
    """

    def __init__(
        self, stamps: np.ndarray, *, playback: float, window: int, answered: bool
    ) -> None:
        self._stamps = stamps
        self._playback = playback
        self._window = window
        self._limit = window if answered else len(stamps)
        self._begin: int | None = None
        self._progress: int | None = None
        self.sent = 0

    @property
    def done(self) -> bool:
        """Return whether all samples were handed out."""
        return self.sent == len(self._stamps)

    def answer(self, stamp: int) -> None:
        """Take note that a listener has worked through the samples up to a stamp."""
        seen = int(np.searchsorted(self._stamps, stamp, side='right'))
        self._limit = max(self._limit, seen + self._window)
        self._progress = None

    def due(self, now: int, most: int) -> range:
        """Return the numbers of the samples to send at a time [ns], at most so many."""
        if self._begin is None:
            self._begin = now
        end = min(self._limit, self.sent + most, len(self._stamps))
        if self._playback > 0.0:
            reached = self._stamps[0] + (now - self._begin) * self._playback
            end = min(end, int(np.searchsorted(self._stamps, reached, side='right')))
        out = range(self.sent, max(end, self.sent))
        self.sent = out.stop
        self._widen(now)
        return out

    def _widen(self, now: int) -> None:
        """Open the window when answers stay out: a late measurement clock shifts them all."""
        if self.sent < self._limit or self.done:
            self._progress = None
        elif self._progress is None:
            self._progress = now
        elif now - self._progress > STALLED * 1e9:
            self._window *= 2
            self._limit += self._window
            self._progress = None
