# Copyright 2026 weld_twin contributors
# SPDX-License-Identifier: Apache-2.0
"""
Constant errors that come or go with the time.

A belt or a coupling jumps; the tool slips in its holder, or the reflector in its nest; the
instrument or the base of the robot is knocked. The set-up's own motion is no cause: it is moved
once, or creeps to its place while the cell warms up. It belongs to the frames that an alignment
fits, and is not carried over to another set-up.
"""

from __future__ import annotations

from abc import abstractmethod
from collections.abc import Iterable, Sequence
from dataclasses import dataclass, replace
from typing import Any, ClassVar, TypeVar

import numpy as np

from ..recording import FIRST_DATE_NS, Recording
from .effect import Effect, Hooked, LinearEffect, Traits, TwinHooks, register
from .geometry import ChannelError, FrameError, JointOffset, ToolPose, frame_parameters
from .view import Array, Parameter, Plausible, Robot, Shift, Stage, Value, View

_TIMES = 40
"""Instants of a moved set-up that a search tries, evenly over the recording."""

_DAYS = 1e4
"""Seconds from which on an instant is read in hours: few recordings last as long."""

_T = TypeVar('_T', bound='_Timed')


class _Timed(LinearEffect):
    """A constant error times a share that hangs on the time, on the clock of the (first) recording."""

    since: ClassVar[str] = 'time'
    """The option that is an instant [s]."""
    options: ClassVar[tuple[str, ...]] = ('time',)
    needs = frozenset({'time'})

    @abstractmethod
    def share(self, view: View) -> Array:
        """Return how much of the error there is, shape as the view's stamps."""

    def recounted(self: _T, later: float) -> _T:
        """Return the same with its instant counted from an epoch that is later by so much [s]."""
        return replace(self, **{self.since: getattr(self, self.since) - later})

    def per_unit(self, view: View) -> list[Shift]:
        share = self.share(view)
        whole = super().per_unit(view)  # type: ignore[safe-super]
        return [{channel: value * share for channel, value in shift.items()} for shift in whole]


class _Twin(TwinHooks):
    effect: Sudden

    def lasting(self) -> Effect:
        """Return the constant that it is from its instant on: what gave way stays so until mended."""
        sizes = (parameter.name for parameter in self.effect.parameters)
        values: dict[str, Any] = {name: getattr(self.effect, name) for name in sizes}
        kind = self.effect.since_then or type(self.effect)
        return kind(*filter(None, [self.effect.site]), **values)


class Sudden(_Timed):
    """
    What sets in at ``time`` [s]; left out, it is there all the time.

    A search takes it in only where the checks of the data found the instant: a step fits any
    slow change halfway.
    """

    time: float
    traits = Traits(depends_on='time', dated=True, jumps=True, common=False)
    twin = Hooked(_Twin)
    since_then: ClassVar[type[Effect] | None] = None
    """The kind of constant that it is afterwards; None where it is one of its own all the time."""

    def share(self, view: View) -> Array:
        return (view.dates >= self.time).astype(np.float64)

    def _when(self) -> str:
        """Return the instant in words; of recordings on several days it is many seconds."""
        seconds = self._plain('time')
        return f't = {seconds:.4g}' if abs(seconds) < _DAYS else f't = {seconds / 3600.0:.5g} h'


@register
class JointSlip(Sudden, ChannelError):
    """The joint stands ``offset`` further than its reading from ``time`` [s] on."""

    joint: str
    offset: Value = 0.0
    time: float = -np.inf

    traits = replace(
        Sudden.traits,
        title='slip',
        meaning='a joint slipped at one instant, as by a tooth of a belt',
        formula='like `joint_offset`, from the instant `time` on; a cause only where the checks'
        ' of the data found the instant',
        entered='zero',
    )
    of = 'joint'
    stage = Stage.JOINT
    channel = 'q'
    parameters = (
        Parameter('offset', 'rad', typical=5e-4)
        .plausible(
            (5e-3, 0.13), 'derived: a tooth of a belt or the mark of a mastering; see joint_offset'
        )
        .plausible_sliding((5e-3, 0.1), 'derived: a tooth of a belt or a rack'),
    )
    since_then = JointOffset

    def remedy(self, robot: Robot) -> str:
        return (
            f'See to the belt, coupling and encoder of {self.site}: it slipped by '
            f'{self._shifted(robot, self._plain("offset"))} at {self._when()}; then '
            'master it again.'
        )


@dataclass(frozen=True, eq=False)
class _SuddenFrame(Sudden, FrameError):
    """A frame that stands elsewhere from an instant on."""

    time: float = -np.inf


@register
class ToolSlip(_SuddenFrame):
    """The tool is displaced by xyz of the flange and turned by rotvec from ``time`` [s] on."""

    traits = replace(
        Sudden.traits,
        title='slipped tool or reflector',
        meaning='tool or reflector moved on the flange at one instant',
        formula='like `tool_pose`, from the instant `time` on; a cause only where the checks of'
        ' the data found the instant',
        entered='tool',
        place='tool',
    )
    channel = 'tool'
    since_then = ToolPose
    parameters = frame_parameters(
        Plausible.even(5e-3, 0.05, 'derived: a holder or a nest that gave way'),
        Plausible.even(2e-2, 0.4, 'derived: a holder that gave way'),
    )

    def remedy(self, robot: Robot) -> str:
        return (
            f'Fasten the tool or the reflector: it moved by {self.in_words(robot)} at '
            f'{self._when()}; measure its centre point again.'
        )


@register
class InstrumentKnock(_SuddenFrame):
    """The base is displaced by xyz in the world and turned by rotvec from ``time`` [s] on."""

    traits = replace(
        Sudden.traits,
        of_setup=True,
        title='knocked instrument or base',
        meaning='instrument or base was moved at one instant',
        formula='like `base_pose`, from the instant `time` on; a cause only where the checks of'
        ' the data found the instant',
        entered='the instrument or the base was knocked',
        place='instrument',
    )
    channel = 'base'
    parameters = frame_parameters(
        Plausible.even(5e-3, 0.1, 'derived: a knock'),
        Plausible.even(5e-3, 0.1, 'derived: a knock'),
    )

    def remedy(self, robot: Robot) -> str:
        return (
            f'Fasten the instrument and the base: one moved by {self.in_words(robot)} at '
            f'{self._when()}; measure what came before and after apart.'
        )


class _SetupMotion(_Timed, FrameError):
    """The set-up's own motion: nuisance, never a cause."""

    traits = Traits(depends_on='time', place='base', cause=False, of_setup=True)
    channel = 'base'


@register
class SetupStep(_SetupMotion):
    """Displacement and turn of the base before the instant ``time`` [s]; then it is as aligned."""

    time: float = 0.0

    traits = replace(
        _SetupMotion.traits,
        title='moved set-up',
        entered='base',
        formula='like `base_pose`, before the instant `time` only; nuisance of a set-up, never '
        'named as a cause',
    )
    parameters = frame_parameters(
        Plausible.even(5e-3, 0.1, 'derived: a knock'),
        Plausible.even(5e-3, 0.1, 'derived: a knock'),
        typical=(1e-4, 1e-4),
    )

    def share(self, view: View) -> Array:
        return (view.dates < self.time).astype(np.float64)

    @classmethod
    def seeds(cls, view: View, joint: str | None, pull: Array | None = None) -> Iterable[Effect]:
        """Yield steps at evenly spread samples, none at the very ends."""
        t = view.dates
        index = np.linspace(0, t.size - 1, _TIMES + 2).round().astype(int)[1:-1]
        for k in np.unique(index):
            if k > 0:
                yield cls(time=float(0.5 * (t[k - 1] + t[k])))

    def remedy(self, robot: Robot) -> str:
        before = self.with_vector(-self.vector())
        return (
            f'Fasten the set-up: it moved by {before.in_words(robot)} at '
            f'{self._plain("time"):.4g} s; measure what came before and after apart.'
        )


@register
class SetupSettling(_SetupMotion):
    """Displacement and turn of the base at ``start`` [s], gone with ``time_constant`` [s]."""

    time_constant: float = 600.0
    start: float = 0.0

    traits = replace(
        _SetupMotion.traits,
        title='settling set-up',
        entered='how the set-up is held',
        formula='like `base_pose`, times exp(−(t − start) / time_constant) after `start`; '
        'nuisance of a set-up, never named as a cause',
    )
    parameters = frame_parameters(
        Plausible.even(1e-3, 2e-2, 'derived: what a stand creeps while it warms'),
        Plausible.even(1e-3, 2e-2, 'derived: a millimetre on a metre'),
        typical=(1e-4, 1e-4),
    )
    options = ('time_constant', 'start')
    since = 'start'

    def share(self, view: View) -> Array:
        return np.exp(-np.maximum(view.dates - self.start, 0.0) / self.time_constant)

    @classmethod
    def seeds(cls, view: View, joint: str | None, pull: Array | None = None) -> Iterable[Effect]:
        """Yield time constants from a twentieth to half of the recording."""
        span = float(view.elapsed[-1])
        if span > 0.0:
            for share in (0.05, 0.12, 0.25, 0.5):
                yield cls(time_constant=share * span, start=float(view.dates[0]))

    def remedy(self, robot: Robot) -> str:
        return (
            f'Let the set-up settle before measuring: it started {self.in_words(robot)} from '
            'where it ended.'
        )


def of_the_robot(effects: Sequence[Effect]) -> tuple[Effect, ...]:
    """
    Return the effects as they act ever after: what slipped stays so until somebody mends it.

    How a set-up moved by itself is left out: it stands then as it was aligned.
    """
    return tuple(e for e in (effect.twin.lasting() for effect in effects) if e is not None)


def from_now_on(effects: Sequence[Effect]) -> tuple[Effect, ...]:
    """Return what is known of effects after the recordings: not what grows with the time for ever."""
    return tuple(effect for effect in of_the_robot(effects) if not effect.traits.endless)


def seen_from(
    effects: Sequence[Effect], epoch_ns: int, span_ns: tuple[int, int], other: Recording
) -> tuple[Effect, ...]:
    """
    Return effects for another recording: the set-up's motion at its right time, or left out.

    Where the other overlaps in time with ``span_ns``, first and last stamp of the one whose set-up
    moved, which count from ``epoch_ns``, it is taken for a part of the same.
    """
    return in_use(effects, epoch_ns, span_ns, other, same=_overlap(span_ns, other))[0]


def ways_seen(
    effects: Sequence[Effect], epoch_ns: int, span_ns: tuple[int, int], other: Recording
) -> list[tuple[Effect, ...]]:
    """
    Return every way in which effects may act in another recording; see `seen_from`, which is first.

    Clocks that start anew with each recording do not tell whether it was before what slipped, after
    it, or is a part of the recording in which it did.
    """
    ways = [seen_from(effects, epoch_ns, span_ns, other)]
    if _dated(epoch_ns, other) or not any(isinstance(effect, Sudden) for effect in effects):
        return ways
    before = [effect for effect in effects if not isinstance(effect, Sudden)]
    return [*ways, of_the_robot(effects), of_the_robot(before)]


def in_use(
    effects: Sequence[Effect],
    epoch_ns: int,
    span_ns: tuple[int, int],
    other: Recording,
    *,
    same: bool,
) -> tuple[tuple[Effect, ...], list[str]]:
    """
    Return effects as they act in another recording of the same cell, and what to say of that.

    What slipped stays slipped until somebody mends it. Where nothing tells when one of both was
    recorded, the other is taken to have been begun after the one diagnosed.

    epoch_ns, span_ns: see `seen_from`.
    same: stamps of both count from the same instant, as in the one diagnosed and its parts.
    """
    known, later = same or _dated(epoch_ns, other), (other.epoch_ns - epoch_ns) * 1e-9
    if known and _overlap(span_ns, other):
        return _recounted(effects, later), []
    said = _longer(effects, (span_ns[1] - span_ns[0]) * 1e-9, other)
    why, after = '', not known or other.span_ns[0] > span_ns[1]
    if known:
        out = _recounted([e for e in effects if not isinstance(e, _SetupMotion)], later)
    else:
        out = of_the_robot(effects)
        why = ', for stamps without a date do not tell when; give both the date and time'
    return out, said + [
        f'{effect.traits.title} at t = {effect.time:.4g} s of the recording diagnosed: '
        f'{other.name} is taken as recorded {"after" if after else "before"} that{why}.'
        for effect in effects
        if isinstance(effect, Sudden)
    ]


def _longer(effects: Sequence[Effect], lasted: float, other: Recording) -> list[str]:
    """Return which effects another recording has grow longer than anybody saw them do."""
    duration = float(np.ptp(other.joints.t))
    return [
        f'{effect.traits.title}: the recording diagnosed lasted {lasted:.6g} s, {other.name} lasts '
        f'{duration:.6g} s; nobody knows whether it goes on growing as it did.'
        for effect in effects
        if effect.traits.endless and duration > lasted
    ]


def _dated(epoch_ns: int, other: Recording) -> bool:
    return other.dated and epoch_ns >= FIRST_DATE_NS


def _overlap(span_ns: tuple[int, int], other: Recording) -> bool:
    first, last = other.span_ns
    return last >= span_ns[0] and first <= span_ns[1]


def _recounted(effects: Sequence[Effect], later: float) -> tuple[Effect, ...]:
    """Return effects whose instants count from an epoch that is later by so much [s]."""
    return tuple(e.recounted(later) if isinstance(e, _Timed) else e for e in effects)
