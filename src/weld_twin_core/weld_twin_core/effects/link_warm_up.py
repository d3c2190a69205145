# Copyright 2026 weld_twin contributors
# SPDX-License-Identifier: Apache-2.0
"""
Warm-up of one link: a, d -> (1 + strain w) a, d with w = 1 - exp(-t / warming_time).

A motor heats the link that it sits in, from the recording's first stamp on. Where a temperature
was recorded, w may follow it instead: (temperature - at) / rise. `thermal_growth` is the whole arm.
"""

from __future__ import annotations

from collections.abc import Iterable, Sequence
from dataclasses import dataclass
from numbers import Real

import numpy as np

from ..arm.channels import Channel, Shift
from ..arm.robot import Robot
from ..arrays import Array
from ..errors import DataError, ModelError
from .effect import Effect
from .hooks import FitHooks, Hooked, Traits
from .registry import register
from .view import Parameter, Plausible, Stage, Value, View
from .wording import number

_CONSTANTS = (0.15, 0.6, 2.5)
"""Time constants that a search starts from, in lengths of the recording: beyond, it is a ramp."""
_WARMER = 1.0
"""Kelvin by which a temperature must vary to be followed: sensors wander by some tenths."""
_EVEN = 1e-6
"""Share of their spacing by which stamps of stations differ where they are only counted."""


class _Fit(FitHooks):
    effect: LinkWarmUp

    def fitted(self) -> list[int]:
        """Return strain and time constant, or the strain alone where it follows a temperature."""
        return [0, 1] if self.effect.follows is None else [0]


@register
@dataclass(frozen=True, eq=False)
class LinkWarmUp(Effect):
    """One link grows by ``strain`` of its lengths; ``follows``: [temperature degC, rise K]."""

    joint: str
    strain: Value = 0.0
    warming_time: Value = 60.0
    follows: Sequence[float] | None = None

    name = 'link_warm_up'
    traits = Traits(
        title='warm-up of the link',
        meaning='one link grows as it warms up',
        entered='warming up',
        depends_on='time',
        common=False,
    )
    of = 'link'
    stage = Stage.LINK
    parameters = (
        Parameter(
            'strain',
            '-',
            typical=1e-4,
            idealised=0.05,
            range=Plausible(
                2.4e-4,
                -2.4e-4,
                1.2e-3,
                'aluminium alloys grow by 21.5e-6 to 23.8e-6 per K (amesweb.info); range '
                'derived: beside its motor a link gets 50 K warmer than it was, or 10 K cooler '
                'where a fan blows',
            ),
        ),
        Parameter(
            'warming_time',
            's',
            typical=60.0,
            lower=0.1,
            linear=False,
            idealised=0.1,
            range=Plausible(
                np.inf,
                1.0,
                2e4,
                'derived: no metal warms within a second; beyond five hours it is the hall',
            ),
        ),
    )
    options = ('follows',)
    needs = frozenset({'time'})
    fit = Hooked(_Fit)

    def check(self, robot: Robot) -> None:
        """Refuse a temperature to follow that is not two numbers, or does not rise."""
        super().check(robot)
        if self.follows is not None and not _is_pair(self.follows):
            raise ModelError(
                'link_warm_up: follows must be [temperature in degC, rise in K, not zero], got '
                f'{self.follows!r}'
            )

    @property
    def on(self) -> str:
        """Return time, or the temperature that it follows."""
        return 'time' if self.follows is None else 'temperature'

    def _warmth(self, view: View) -> Array:
        """Return how warm the link is, 1 at the end, shape (N,)."""
        if self.follows is None:
            return -np.expm1(-view.elapsed / self.number('warming_time'))
        if view.temperature is None:
            raise DataError('link_warm_up follows a temperature: record /temperature')
        return np.asarray((view.temperature - self.follows[0]) / self.follows[1])

    def _grown(self, view: View, strain: Array) -> Shift:
        """Return lengths times a strain, shape (..., N)."""
        i = view.robot.index(self.joint)
        lengths: list[tuple[Channel, float]] = [
            ((key, i), float(getattr(view.robot, key)[i])) for key in ('a', 'd')
        ]
        return {channel: length * strain for channel, length in lengths if length != 0.0}

    def displace(self, view: View) -> Shift:
        """Return the growth of the link's lengths; travel of a joint that slides does not grow."""
        return self._grown(view, self.number('strain') * self._warmth(view))

    def gradient(self, view: View) -> list[Shift | None]:
        """Return lengths times warmth, and times how it falls with the time constant."""
        slow = np.zeros_like(view.elapsed)
        if self.follows is None:
            constant = self.number('warming_time')
            slow = -view.elapsed / constant**2 * np.exp(-view.elapsed / constant)
        return [
            self._grown(view, self._warmth(view)),
            self._grown(view, self.number('strain') * slow),
        ]

    def atoms(self, view: View) -> list[Shift]:
        """Return the growth for a strain of one."""
        return [self._grown(view, self._warmth(view))]

    @classmethod
    def applicable(cls, view: View, joint: str | None) -> str | None:
        """Return why the data cannot show it: stations that are only counted tell no time."""
        if view.static and _counted(view.t):
            return 'the stations carry no times'
        return super().applicable(view, joint)

    @classmethod
    def seeds(cls, view: View, joint: str | None, pull: Array | None = None) -> Iterable[Effect]:
        """Yield a fast, a usual and a slow warm-up, and one that follows a temperature that varies."""
        i = view.robot.index(str(joint))
        if view.robot.a[i] == 0.0 and view.robot.d[i] == 0.0:
            return
        span = max(float(np.max(view.elapsed, initial=0.0)), 1.0)
        for share in _CONSTANTS:
            yield cls(str(joint), 0.0, share * span)
        if view.temperature is not None and (rise := float(np.ptp(view.temperature))) > _WARMER:
            yield cls(str(joint), 0.0, span, (float(np.min(view.temperature)), rise))

    def remedy(self, robot: Robot) -> str:
        grown = self._plain('strain') * 1e3
        return (
            f'Warm {self.site} up before welding, or compensate its link while it warms: it grows by '
            f'{number(grown)} mm per m.'
        )


def _is_pair(follows: Sequence[float]) -> bool:
    numbers = [value for value in follows if isinstance(value, Real)]
    return len(follows) == len(numbers) == 2 and follows[1] != 0.0


def _counted(t: Array) -> bool:
    """Tell whether stamps of stations, shape (M,), are no more than their numbers."""
    apart = np.diff(t)
    return apart.size < 2 or bool(np.ptp(apart) <= _EVEN * np.abs(apart).max())
