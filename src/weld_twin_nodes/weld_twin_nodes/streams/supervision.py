# Copyright 2026 weld_twin contributors
# SPDX-License-Identifier: Apache-2.0
"""Where an arm stands, whether it moves, and whether a model still holds while it works."""

from __future__ import annotations

from collections import deque
from collections.abc import Sequence
from math import hypot, sqrt
from typing import NamedTuple

import numpy as np

from weld_twin_core.arrays import Array
from weld_twin_core.effects.curves import AT_REST
from weld_twin_core.twin.goal_correction import Start

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


STILL = 2e-4
"""How far a joint may move within `PAUSE` and still stand [rad, m]: encoders are steadier."""
PAUSE = 0.1
"""Time over which an arm is looked at [s]."""
CAME = 1e-4
"""Motion of a joint [rad, m] that tells where it came from: more than noise, less than play."""
MOVING = 2.0 * AT_REST
"""Speed [rad/s or m/s] from which on a direction counts for 96 %."""
SPAN = 20_000_000
"""Time over which a speed is looked at [ns]: noise of encoders counts for little then."""
REMEMBERED = 1000
"""Joint states back to which a measurement may be late: two seconds of the usual 500 a second."""


class Moving:
    """Tells afterwards whether joints moved: at rest nobody knows on which side their play is."""

    def __init__(self, columns: Sequence[int]) -> None:
        self._columns = list(columns)
        self._lately: deque[tuple[int, Array]] = deque(maxlen=REMEMBERED)

    def take(self, stamp: int, q: Array) -> None:
        """Take joint positions (n,) [rad or m] at a stamp [ns]."""
        if self._lately and stamp <= self._lately[-1][0]:
            self._lately.clear()
        self._lately.append((stamp, q[self._columns]))

    def at(self, stamp: int) -> bool:
        """Return whether all of them moved at a stamp [ns], or it is longer ago than is remembered."""
        near: tuple[int, Array] | None = None
        for at, q in reversed(self._lately):
            if near is None:
                near = (at, q) if at <= stamp else None
            elif near[0] - at >= SPAN:
                speed = np.abs(near[1] - q) / ((near[0] - at) * 1e-9)
                return bool((speed > MOVING).all())
        return True


class ArmState:
    """The arm by the joint states that came last."""

    def __init__(self) -> None:
        self.forget()

    def forget(self) -> None:
        """Forget what was heard, as after a jump of the clock."""
        self._lately: deque[tuple[float, Array]] = deque()
        self._turned: Array | None = None
        self._came: Array | None = None

    @property
    def heard(self) -> bool:
        """Return whether a joint state came at all."""
        return bool(self._lately)

    def take(self, q: Array, now: float) -> None:
        """Take joint positions (n,) [rad or m] that came at a time [s]."""
        self._lately.append((now, q))
        while now - self._lately[0][0] > PAUSE:
            self._lately.popleft()
        if self._turned is None or self._came is None:
            self._turned, self._came = q.copy(), np.zeros_like(q)
            return
        way = q - self._turned
        ahead = way * self._came > 0.0
        turned = np.abs(way) > CAME
        self._came = np.where(turned, np.sign(way), self._came)
        # What goes on the way it came takes its mark along; the other way has to be gone first.
        self._turned = np.where(ahead | turned, q, self._turned)

    def where(self, now: float, most_age: float) -> Array | None:
        """Return where the arm stands (n,) [rad or m]; None where the last state is too old."""
        if not self._lately or now - self._lately[-1][0] > most_age:
            return None
        return self._lately[-1][1]

    def start(self, now: float, most_age: float) -> Start:
        """Return where a goal begins; nothing is known of it where the last state is too old."""
        q = self.where(now, most_age)
        if q is None:
            return Start()
        moving = any(np.abs(q - then).max() > STILL for _, then in self._lately)
        return Start(q, moving, self._came)
