# Copyright 2026 weld_twin contributors
# SPDX-License-Identifier: Apache-2.0
"""The deviation metrics of `weld_twin_core.metrics.deviation`, kept up one pair at a time."""

from __future__ import annotations

from math import sqrt

import numpy as np

from ..arrays import Array


class RunningMetrics:
    """
    D(t), D_norm, D_cum, RMS, mean and max of the pairs so far.

    Parameters
    ----------
    path_length : float [m]
        Length of the seam, for D_norm; 0 takes the way the twin has gone so far.

    """

    def __init__(self, path_length: float = 0.0) -> None:
        self._given = path_length
        self._gone = 0.0
        self._before: Array | None = None
        self._now = 0.0
        self._squares = 0.0
        self._sum = 0.0
        self._largest = 0.0
        self.samples = 0

    def add(self, deviation: Array, twin: Array) -> None:
        """
        Take one pair of a measurement and the twin.

        Parameters
        ----------
        deviation : array, shape (3,) [m]
            Measured minus twin.
        twin : array, shape (3,) [m]
            Where the twin has the tool.

        """
        if self._before is not None:
            self._gone += float(np.linalg.norm(twin - self._before))
        self._before = twin
        self._now = float(np.linalg.norm(deviation))
        self._squares += self._now**2
        self._sum += self._now
        self._largest = max(self._largest, self._now)
        self.samples += 1

    def as_dict(self) -> dict[str, float | int]:
        """Return the metrics by the names they have on `/deviation/metrics` [m; D_norm 1]."""
        count = max(self.samples, 1)
        length = self._given or self._gone
        return {
            'D(t)': self._now,
            'D_norm': self._largest / length if length > 0.0 else float('nan'),
            'D_cum': self._sum,
            'RMS': sqrt(self._squares / count),
            'mean': self._sum / count,
            'max': self._largest,
            'path_length': length,
            'samples': self.samples,
        }
