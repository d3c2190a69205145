# Copyright 2026 weld_twin contributors
# SPDX-License-Identifier: Apache-2.0
"""
What moves with heat: links that grow, all of them or one as it warms up, and a joint's zero.

With w = 1 - exp(-t / warming_time), from the recording's first stamp on, thermal growth of all links is
a, d -> (1 + coefficient dT) a, d, with dT measured, or a rise times w. A motor heats the link that it
sits in, and its gear: warm-up of one link is a, d -> (1 + strain w) a, d, of one joint
theta -> theta + offset w. Where a temperature was recorded, their w may follow it instead:
(temperature - at) / rise.
"""

from __future__ import annotations

from abc import abstractmethod
from collections.abc import Iterable, Sequence
from dataclasses import replace
from numbers import Real
from typing import Any

import numpy as np

from ..errors import DataError, ModelError
from .effect import Effect, FitHooks, Hooked, SearchHooks, Traits, register
from .view import Array, Parameter, Robot, Shift, Stage, Value, View
from .wording import number

_REFERENCE = 20.0
"""Temperature [degC] at which the model holds unless something else is said, as lengths do (ISO 1)."""


def _grown(robot: Robot, rows: Iterable[int], strain: Array) -> Shift:
    """Return by how much lengths of rows grow that are not zero, by a share of them, shape (N,)."""
    lengths = {(key, i): float(getattr(robot, key)[i]) for i in rows for key in ('a', 'd')}
    return {channel: length * strain for channel, length in lengths.items() if length != 0.0}


def _is_pair(values: Sequence[float]) -> bool:
    return len(values) == 2 and all(isinstance(value, Real) for value in values)


_CONSTANTS = (0.15, 0.6, 2.5)
"""Time constants that a search starts from, in lengths of the recording: beyond, it is a ramp."""
_WARMER = 1.0
"""Kelvin by which a temperature must vary to be followed: sensors wander by some tenths."""
_RISE = 10.0
"""Kelvin by which links are taken to warm up where none were recorded: with what metals grow by per
kelvin, as much as one link grows beside its motor."""
_NUMBERED = 1e-6
"""By how much [s] stamps of stations are further apart than one where they are row numbers."""


class _Fit(FitHooks):
    effect: _Warming

    def fitted(self) -> list[int]:
        return [0, 1] if self.effect._timed else [0]


_WARMING_TIME = Parameter(
    'warming_time', 's', typical=60.0, lower=0.1, linear=False, idealised=0.1
).plausible(
    (np.inf, 1.0, 2e4),
    'derived: no metal warms within a second; beyond five hours it is the hall',
)


class _Warming(Effect):
    """Something moves by its first parameter times how warm it is, by a temperature or a curve."""

    warming_time: Value

    fit = Hooked(_Fit)

    @property
    @abstractmethod
    def _curve(self) -> tuple[float, Array | float] | None:
        """Return how warm it gets, and in what time [s]; None where a temperature says it."""

    @property
    @abstractmethod
    def _measured(self) -> tuple[float, float]:
        """Return the temperature at which nothing has moved, and by how much more it is warm [K]."""

    @property
    def _timed(self) -> bool:
        """Return whether the time constant of the curve is a parameter."""
        return self._curve is not None

    @abstractmethod
    def _moved(self, view: View, size: Array) -> Shift:
        """Return what a size of the first parameter moves, shape (N,)."""

    @property
    def on(self) -> str:
        return 'temperature' if self._curve is None else 'time'

    def _warmth(self, view: View) -> Array:
        """Return how warm it is, shape (N,)."""
        if self._curve is not None:
            warm, constant = self._curve
            return warm * -np.expm1(-view.elapsed / constant)
        if view.temperature is None:
            raise DataError(
                f'{self.name} needs a temperature: record /temperature, say it with '
                '--temperature, or give the effect a curve in time'
            )
        at, rise = self._measured
        return np.asarray((view.temperature - at) / rise)

    def displace(self, view: View) -> Shift:
        size = self.number(self.parameters[0].name)
        return self._moved(view, size * self._warmth(view))

    def gradient(self, view: View) -> list[Shift | None]:
        slow = np.zeros_like(view.elapsed)
        if self._curve is not None and self._timed:
            warm, constant = self._curve
            slow = -warm * view.elapsed / constant**2 * np.exp(-view.elapsed / constant)
        size = self.number(self.parameters[0].name)
        return [self._moved(view, self._warmth(view)), self._moved(view, size * slow)]

    def atoms(self, view: View) -> list[Shift]:
        return [self._moved(view, self._warmth(view))]

    def to_mapping(self) -> dict[str, Any]:
        """Return the entry of a file, without the time constant of a curve that it does not follow."""
        entry = super().to_mapping()
        return entry if self._timed else {k: v for k, v in entry.items() if k != 'warming_time'}


def _time_constants(view: View) -> list[float]:
    """Return the time constants [s] that a search starts from, by how long the recording is."""
    span = max(float(np.max(view.elapsed, initial=0.0)), 1.0)
    return [share * span for share in _CONSTANTS]


class _Search(SearchHooks):
    def small(self, view: View, joint: str | None, most: int) -> list[Any]:
        """Return growth with a temperature alone: what goes with time is no small error."""
        return [] if view.temperature is None else [self.kind()]


@register
class ThermalGrowth(_Warming):
    """
    Links grow with temperature against ``reference`` [degC].

    ``links`` names the joints whose rows grow (all when left out). Without a recorded temperature,
    ``warmup: rise`` [K] is how much warmer they get, with ``warming_time``; of
    ``warmup: [rise, time_constant]`` [K, s] the time is known, and not fitted.
    """

    coefficient: Value = 0.0
    reference: float = _REFERENCE
    links: Sequence[str] | None = None
    warmup: float | Sequence[float] | None = None
    warming_time: Value = 60.0

    traits = Traits(
        title='thermal growth',
        meaning='the links grow with temperature',
        formula='a, d → (1 + coefficient ΔT) a, d; ΔT = temperature − reference (20 °C), or '
        'rise (1 − exp(−t / warming_time)) with `warmup: rise`',
        entered='warming up, or of the temperature in the cell',
        depends_on='temperature',
        demand=1,
    )
    of = 'links'
    stage = Stage.LINK
    parameters = (
        Parameter('coefficient', '1/K', typical=1.2e-5).plausible(
            (2.4e-5, -2.4e-5, 7.2e-5),
            'aluminium alloys grow by 21.5e-6 to 23.8e-6 per K, cast iron by 11e-6 (amesweb.info); '
            'range derived: an arm may warm up three times as much as the place of the sensor',
        ),
        _WARMING_TIME,
    )
    options = ('reference', 'links', 'warmup')
    needs = frozenset({'temperature'})
    search = Hooked(_Search)

    def check(self, robot: Robot) -> None:
        super().check(robot)
        if isinstance(self.links, str):
            raise ModelError(f'thermal_growth: links must be a list, got {self.links!r}')
        for name in self.links or ():
            robot.index(name)
        if not isinstance(self.reference, Real):
            raise ModelError(f'thermal_growth: reference must be a number, got {self.reference!r}')
        known = (
            isinstance(self.warmup, Sequence) and _is_pair(self.warmup) and self.warmup[1] > 0.0
        )
        if not (self.warmup is None or isinstance(self.warmup, Real) or known):
            raise ModelError(
                'thermal_growth: warmup must be the rise in K, or [rise in K, time constant in s '
                f'above zero], got {self.warmup!r}'
            )

    @property
    def at(self) -> str:
        """Return the one link that grows, or the base where several do."""
        return self.links[0] if self.links is not None and len(self.links) == 1 else 'base'

    @property
    def _curve(self) -> tuple[float, Array | float] | None:
        if self.warmup is None:
            return None
        if isinstance(self.warmup, Sequence):
            return self.warmup[0], self.warmup[1]
        return self.warmup, self.number('warming_time')

    @property
    def _timed(self) -> bool:
        return isinstance(self.warmup, Real)

    @property
    def _measured(self) -> tuple[float, float]:
        return self.reference, 1.0

    def _moved(self, view: View, size: Array) -> Shift:
        """Return length times growth; travel of a joint that slides does not grow."""
        robot = view.robot
        rows = range(robot.n) if self.links is None else [robot.index(k) for k in self.links]
        return _grown(robot, rows, size)

    @classmethod
    def applicable(cls, view: View, joint: str | None) -> str | None:
        """Return why the data cannot show it: neither a temperature nor times were recorded."""
        timed = view.temperature is None and not _untimed(view)
        return None if timed else super().applicable(view, joint)

    @classmethod
    def seeds(cls, view: View, joint: str | None, pull: Array | None = None) -> Iterable[Effect]:
        """Yield growth with the temperature; where none was recorded, curves of warming up."""
        if view.temperature is not None:
            yield cls()
        else:
            for constant in _time_constants(view):
                yield cls(warmup=_RISE, warming_time=constant)

    def remedy(self, robot: Robot) -> str:
        grown, each = self._plain('coefficient') * 1e3, 'm and K'
        if self._curve is not None:
            grown, each = grown * self._curve[0], 'm while it warms'
        links = ', '.join(self.links or ('all links',))
        way = f'compensate {number(grown)} mm per {each} for {links}'
        return f'Warm the arm up before welding, or {way}.'


class _WarmUp(_Warming):
    """
    One joint or link moves by its first parameter as it warms up; see the head of this file.

    ``follows``: [temperature degC, rise K].
    """

    joint: str
    follows: Sequence[float] | None

    traits = Traits(entered='warming up', depends_on='time', common=False)
    options = ('follows',)
    needs = frozenset({'time'})

    def check(self, robot: Robot) -> None:
        super().check(robot)
        if self.follows is not None and not (_is_pair(self.follows) and self.follows[1] != 0.0):
            raise ModelError(
                f'{self.name}: follows must be [temperature in degC, rise in K, not zero], got '
                f'{self.follows!r}'
            )

    @property
    def _curve(self) -> tuple[float, Array | float] | None:
        return (1.0, self.number('warming_time')) if self.follows is None else None

    @property
    def _measured(self) -> tuple[float, float]:
        assert self.follows is not None
        return self.follows[0], self.follows[1]

    @classmethod
    def applicable(cls, view: View, joint: str | None) -> str | None:
        """Return why the data cannot show it: stations that are only counted tell no time."""
        return _untimed(view) or super().applicable(view, joint)

    @classmethod
    def seeds(cls, view: View, joint: str | None, pull: Array | None = None) -> Iterable[Effect]:
        """Yield a fast, a usual and a slow warm-up, and one that follows a temperature that varies."""
        kind: Any = cls  # whose first fields are joint, size and time constant
        for constant in _time_constants(view):
            yield kind(str(joint), 0.0, constant)
        if view.temperature is not None and (rise := float(np.ptp(view.temperature))) > _WARMER:
            yield kind(str(joint), follows=(_REFERENCE, rise))


@register
class LinkWarmUp(_WarmUp):
    """One link grows by ``strain`` of its lengths as it warms up."""

    joint: str
    strain: Value = 0.0
    warming_time: Value = 60.0
    follows: Sequence[float] | None = None

    traits = replace(
        _WarmUp.traits,
        title='warm-up of the link',
        meaning='one link grows as it warms up',
        formula='a, d → (1 + strain w) a, d of one row, w = 1 − exp(−t / warming_time) since '
        'the first stamp; with `follows: [at, rise]` w = (temperature − at) / rise',
    )
    of = 'link'
    stage = Stage.LINK
    parameters = (
        Parameter('strain', '-', typical=1e-4, idealised=0.05).plausible(
            (2.4e-4, -2.4e-4, 1.2e-3),
            'aluminium alloys grow by 21.5e-6 to 23.8e-6 per K (amesweb.info); range '
            'derived: beside its motor a link gets 50 K warmer than it was, or 10 K cooler '
            'where a fan blows',
        ),
        _WARMING_TIME,
    )

    def _moved(self, view: View, size: Array) -> Shift:
        """Return the growth of the link's lengths; travel of a joint that slides does not grow."""
        return _grown(view.robot, [view.robot.index(self.joint)], size)

    @classmethod
    def seeds(cls, view: View, joint: str | None, pull: Array | None = None) -> Iterable[Effect]:
        """Yield warm-ups of a link that has a length."""
        i = view.robot.index(str(joint))
        if view.robot.a[i] != 0.0 or view.robot.d[i] != 0.0:
            yield from super().seeds(view, joint, pull)

    def remedy(self, robot: Robot) -> str:
        grown = self._plain('strain') * 1e3
        return (
            f'Warm {self.site} up before welding, or compensate its link while it warms: it grows by '
            f'{number(grown)} mm per m.'
        )


@register
class JointWarmUp(_WarmUp):
    """One joint stands ``offset`` further than its reading once it is warm."""

    joint: str
    offset: Value = 0.0
    warming_time: Value = 60.0
    follows: Sequence[float] | None = None

    traits = replace(
        _WarmUp.traits,
        title='thermal zero drift',
        meaning="a joint's zero moves as its gear warms up",
        formula='θ → θ + offset w, w as of `link_warm_up`',
    )
    of = 'joint'
    stage = Stage.JOINT
    parameters = (
        Parameter('offset', 'rad', typical=1e-4, idealised=0.05)
        .plausible(
            (5e-4, 5e-3),
            'derived: a housing of 0.1 m that grows aside of its axis by 50 µm'
            ' where it gets 20 K warmer than its other side; ten times as much is a loose part',
        )
        .plausible_sliding(
            (1e-4, 2e-3), 'derived: a screw of steel of 1 m that gets 10 K warmer grows by 0.1 mm'
        ),
        _WARMING_TIME,
    )

    def _moved(self, view: View, size: Array) -> Shift:
        return self._moves(view, size)

    def remedy(self, robot: Robot) -> str:
        return (
            f'Warm {self.site} up before welding, or compensate its zero while it warms: it moves by '
            f'{self._shifted(robot, self._plain("offset"))}.'
        )


def _untimed(view: View) -> str | None:
    """Return what to say of stations whose stamps are row numbers, as tables without times have."""
    t = view.t
    counted = t.size < 3 or bool(np.abs(np.diff(t) - 1.0).max() <= _NUMBERED)
    return 'the stations carry no times' if view.static and counted else None
