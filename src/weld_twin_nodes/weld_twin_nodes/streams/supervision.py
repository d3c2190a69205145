# Copyright 2026 weld_twin contributors
# SPDX-License-Identifier: Apache-2.0
"""Whether a model still holds, by the deviations that come while the arm works."""

from __future__ import annotations

from collections import deque
from math import hypot, sqrt
from typing import NamedTuple

import numpy as np

from weld_twin_core.arrays import Array

COUNT = 20
"""Deviations that are compared with what the model promises: as many as its change may go unnoticed."""
GROUPS = 40
"""Groups of so many deviations whose mean is compared with what the model leaves beside the noise."""
ABOVE = 2.0
"""Times what a model promises on unseen data from which on it does not hold: noise of twenty
measurements, three coordinates each, stays within 1.3 times in 999 of 1,000 cases."""
SIZED = 20
"""Groups whose medians are held by their size. White noise leaves 0.28 of what is promised in one, an
instrument that smooths over a tenth of a second 0.67; so many groups tell it to 9 %."""
ANYWHERE = 3.0
"""Times its usual size that what a model is not sure of has in one posture of 200,000."""
SURE = 7.0
"""Standard errors that chance makes in 1 of 5e7 means, also where one coordinate has all the noise."""
ALIKE = 0.9
"""Largest likeness of groups that follow each other which is reckoned with: above, no mean is sure."""
LOST = 2.0
"""Silence [s] after which measurements that came before are lost."""


class Promise(NamedTuple):
    """What a model leaves on data it has not seen."""

    rms: float  # distance of measurements from the twin, noise included [m]
    beside_noise: float
    """What a mean of many measurements of one posture may still be off by [m]."""

    @classmethod
    def of(cls, remaining: float, unsure: float, samples: int) -> Promise:
        """
        Return it from the RMS [m] left on unseen data, and what the model is unsure of [m].

        What hides in the noise of so many samples, within two standard errors, may be the model's.
        """
        hidden = 2.0 * remaining**2 * sqrt(2.0 / (3.0 * samples))
        rms = hypot(remaining, unsure)
        return cls(rms, sqrt(hidden + 3.0 * (ANYWHERE * unsure) ** 2))


class Supervision:
    """
    Takes deviations of the measured tool from the twin that has the same model.

    A change far above the noise is seen in the last `COUNT` of them. One that the noise of single
    ones hides is seen in the medians of groups of so many: in their size, `SIZED` of them, and in the
    mean of `GROUPS`; how sure that is, the groups tell.

    promise: none where it is not known.
    """

    def __init__(self, promise: Promise | None = None) -> None:
        self._promise = promise
        self._at_once = (
            0.0 if promise is None else hypot(ABOVE * promise.rms, promise.beside_noise)
        )
        self._heard: float | None = None
        self._broken = ''
        self._owed = 0
        self._lately: deque[Array] = deque(maxlen=COUNT)
        self._far: deque[bool] = deque(maxlen=COUNT)
        self._groups: deque[Array] = deque(maxlen=GROUPS)
        self._count = 0

    def forget(self) -> None:
        """Forget what came so far, as after a jump of the clock."""
        for kept in (self._lately, self._far, self._groups):
            kept.clear()
        self._heard, self._count, self._owed = None, 0, 0

    def pass_over(self, now: float) -> None:
        """Take note that a deviation came at a time [s] of a posture of which nothing is promised."""
        if self._heard is not None and now - self._heard > LOST:
            # What changed meanwhile is not known: what came before tells nothing of the arm any more.
            self.forget()
            self._owed = COUNT
        self._heard = now

    def take(self, deviation: Array, now: float) -> None:
        """Take a deviation (3,) [m] that came at a time [s]."""
        self.pass_over(now)
        self._owed = max(self._owed - 1, 0)
        if self._promise is None or self._broken:
            return
        self._lately.append(deviation)
        self._far.append(bool(deviation @ deviation > self._at_once**2))
        self._count += 1
        if self._count < COUNT:
            return
        # Most of them, and the middle one: outliers of an instrument are no change of the arm.
        if 2 * sum(self._far) > COUNT:
            usual = float(np.median(np.linalg.norm(self._lately, axis=1)))
            self._break(
                f'the last {COUNT} measurements are {usual * 1e3:.3f} mm from the twin, it leaves '
                f'{self._promise.rms * 1e3:.3f} mm'
            )
        elif self._count % COUNT == 0:
            self._groups.append(np.median(self._lately, axis=0))
            self._look_at_size(self._promise)
            self._look_at_mean(self._promise.beside_noise)

    def _look_at_size(self, promise: Promise) -> None:
        """Hold the size of the latest medians against what the model leaves."""
        if len(self._groups) < SIZED:
            return
        latest = np.array(self._groups)[-SIZED:]
        usual = sqrt(float((latest**2).sum()) / SIZED)
        if usual > hypot(promise.rms, promise.beside_noise):
            self._break(
                f'the medians of the last {SIZED} times {COUNT} measurements are {usual * 1e3:.3f} mm '
                f'from the twin, it leaves {promise.rms * 1e3:.3f} mm'
            )

    def _look_at_mean(self, remaining: float) -> None:
        """Hold the mean of all groups against what the model leaves beside the noise [m]."""
        if len(self._groups) < GROUPS:
            return
        groups = np.array(self._groups)
        mean = groups.mean(axis=0)
        apart = groups - mean
        spread = float((apart**2).sum())
        if spread > 0.0:
            alike = min(max(float((apart[1:] * apart[:-1]).sum()) / spread, 0.0), ALIKE)
            spread *= (1.0 + alike) / (1.0 - alike)
        doubt = sqrt(spread / (GROUPS * (GROUPS - 1)))
        off = float(np.linalg.norm(mean))
        if off > hypot(remaining, SURE * doubt):
            self._break(
                f'the mean of the last {COUNT * GROUPS} measurements is {off * 1e3:.3f} mm from the '
                f'twin, sure to {doubt * 1e3:.3f} mm; beside the noise it leaves at most '
                f'{remaining * 1e3:.3f} mm'
            )

    def _break(self, why: str) -> None:
        self._broken = (
            f'the model does not hold any more: {why}; diagnose anew and call ~/reload (the twin '
            'beside must have the same model)'
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
        if self._owed:
            return (
                f'the tracker was lost: {COUNT - self._owed} of the {COUNT} measurements have come '
                'since, in postures that were recorded, that tell whether the model still holds'
            )
        return ''
