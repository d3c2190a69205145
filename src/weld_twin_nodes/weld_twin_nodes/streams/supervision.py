# Copyright 2026 weld_twin contributors
# SPDX-License-Identifier: Apache-2.0
"""Whether a model still holds, by the deviations that come while the arm works."""

from __future__ import annotations

from collections import deque

import numpy as np

from weld_twin_core.arrays import Array

COUNT = 20
"""Deviations that are held against what the model promises: as many as its change may go unnoticed."""
ABOVE = 2.0
"""Times what a model promises on unseen data from which on it does not hold: noise of twenty
measurements, three coordinates each, stays within 1.3 times in 999 of 1,000 cases."""
LOST = 2.0
"""Silence [s] after which measurements that came before are lost."""


class Supervision:
    """
    Takes deviations of the measured tool from the twin that has the same model.

    Parameters
    ----------
    promised : float, optional [m]
        RMS distance that the model leaves on unseen data, noise included, and how unsure it is
        elsewhere; None where it is not known.

    """

    def __init__(self, promised: float | None = None) -> None:
        self._promised = promised
        self._lately: deque[float] = deque(maxlen=COUNT)
        self._heard: float | None = None
        self._broken = ''

    def forget(self) -> None:
        """Forget what came so far, as after a jump of the clock."""
        self._lately.clear()
        self._heard = None

    def take(self, deviation: Array, now: float) -> None:
        """Take a deviation (3,) [m] that came at a time [s]."""
        self._heard = now
        self._lately.append(float(deviation @ deviation))
        if self._promised is None or len(self._lately) < COUNT or self._broken:
            return
        # The middle one: outliers of an instrument are no change of the arm.
        usual = float(np.sqrt(np.median(self._lately)))
        if usual > ABOVE * self._promised:
            self._broken = (
                f'the model does not hold any more: the last {COUNT} measurements are '
                f'{usual * 1e3:.3f} mm from the twin, it leaves {self._promised * 1e3:.3f} mm; diagnose '
                'anew and call ~/reload (the twin beside must have the same model)'
            )

    def withdrawn(self, now: float) -> str:
        """Return why the model is not to be used; empty where it is."""
        if self._broken:
            return self._broken
        if self._heard is not None and now - self._heard > LOST:
            return (
                f'the tracker is lost: the last deviation came {now - self._heard:.1f} s ago; '
                'whether the model holds is not watched any more'
            )
        return ''
