# Copyright 2026 weld_twin contributors
# SPDX-License-Identifier: Apache-2.0
"""
Backlash: play (dead-zone hysteresis) of full width delta.

The paper writes "theta - delta where the direction changes, theta otherwise" (eq. II.iii.d). Read
literally, the joint jumps for the one sample at which it reverses and is perfect again at the
next: the size of the deviation depends on the sample rate, and a slow reversal costs nothing. A
gear with a gap behaves as the *play operator*: the output stays while the input crosses the gap
and then trails by half of it until the next reversal. Play is the default; the literal form is
the variant ``form: reversal``.

An arm that stops at a station can do the opposite: driven gently, its inertia carries the link
across the gap while the motor brakes, and friction keeps it there. It then rests half a gap ahead
of its command, instead of behind. That is ``form: coast``, play mirrored about the input.

Loaded play is lost motion on the loaded flank, theta -> theta + width / 2 * tau / sqrt(tau^2 + T^2).
A gear with play and a load on it lies on the flank that the load pulls it to, whichever way it
moves; it changes over where the load changes sign, within the torque T that friction holds.

A stiffening spring looks like it and is none: strain-wave and cycloidal gears are soft under a small
load and stiff under a large one, as more and more teeth bear it. Their torque is a cubic of the
windup [1]_, tau / T = x / x0 + (x / x0)^3 with x0 = compliance T.

References
----------
.. [1] T. D. Tuttle and W. P. Seering, "A nonlinear model of a harmonic drive gear transmission",
   IEEE Trans. Robotics and Automation 12(3), 1996.

"""

from __future__ import annotations

from abc import abstractmethod
from collections.abc import Iterable
from dataclasses import replace
from typing import Any, ClassVar

import numpy as np
from numpy.typing import NDArray

from ..errors import ModelError
from .associative_scan import last_true, play
from .compliance import JointCompliance
from .curves import load
from .effect import Effect, LinearEffect, MemoryEffect, register
from .hooks import FitHooks, Hooked, SearchHooks, Traits
from .view import Array, Parameter, Robot, Shift, Stage, Value, View
from .wording import size

_FORMS = ('play', 'reversal', 'coast')
_CLOSED = 1e-5
"""Width [rad] that many small errors start from; less is none."""

RV = (
    'backlash of 1 to 1.5 arcmin and angle errors of at most 1 arcmin allowed for reducers of '
    'robots (zhygear.com, analysis-and-control-of-backlash-in-rv-reducers)'
)
"""What makers of reducers allow."""


class _Search(SearchHooks):
    kind: type[Backlash]

    def small(self, view: View, joint: str | None, most: int) -> list[Backlash]:
        return [self.kind(str(joint), _CLOSED)]


class _Fit(FitHooks):
    effect: Backlash

    def turned(self) -> Backlash:
        """Return a gap that the data refuse as the arm resting ahead instead of behind."""
        if self.coordinates()[0] > _CLOSED:
            return self.effect
        return replace(self.effect, form='coast', width=_CLOSED)


@register
class Backlash(MemoryEffect):
    """A gap in the drive of one joint; before the first sample the gap is centred."""

    joint: str
    width: Value = 0.0
    form: str = 'play'

    traits = Traits(
        title='backlash',
        meaning='a gap in a gear (play): at every reversal the motor crosses it, and the arm stays',
        formula='w_k = min(θ_k + width/2, max(θ_k − width/2, w_{k−1})), w_0 = θ_0',
        entered="the joint's gear",
        depends_on='direction',
        changes_in_use=True,
        demand=2,
    )
    of = 'joint'
    stage = Stage.PLAY
    parameters = (
        Parameter('width', 'rad', typical=5e-4, lower=0.0, linear=False)
        .plausible((5e-4, 0.0, 2e-2), f'{RV}; range derived: a degree is a gear that is broken')
        .plausible_sliding(
            (5e-5, 0.0, 5e-3), 'derived: nuts have hundredths of a millimetre of play'
        ),
    )
    options = ('form',)
    needs = frozenset({'order'})
    search = Hooked(_Search)
    fit = Hooked(_Fit)

    def check(self, robot: Robot) -> None:
        super().check(robot)
        if self.form not in _FORMS:
            raise ModelError(f'backlash: form must be one of {_FORMS}, got {self.form!r}')

    def run(self, view: View, state: Any = None) -> tuple[Shift, Any]:
        """Return output minus input of the gap, and its output (or last motion) as state."""
        q = self._theta(view)
        if self.form == 'reversal':
            flips, state = _reversals(q, state)
            return self._moves(view, -self.number('width') * flips), state
        output = play(q, self.number('width'), q[..., 0] if state is None else state)
        return self._moves(view, self._side * (output - q)), output[..., -1]

    @property
    def _side(self) -> float:
        """Return 1 where the output trails the input, -1 where it runs ahead."""
        return -1.0 if self.form == 'coast' else 1.0

    def gradient(self, view: View) -> list[Shift | None]:
        """Return the side of the gap last touched, -1/2 or +1/2; 0 before it is first touched."""
        q = self._theta(view)
        if self.form == 'reversal':
            return [self._moves(view, -_reversals(q, None)[0])]
        contact, touched = self._contact(q)
        side = self._side * np.take_along_axis(np.sign(contact), np.maximum(touched, 0), -1)
        return [self._moves(view, np.where(touched >= 0, 0.5 * side, 0.0))]

    def push(self, view: View, tangent: Array) -> Array:
        """Hold the tangent of the last contact while the gap is being crossed."""
        if self.form == 'reversal':
            return tangent
        _, touched = self._contact(self._theta(view))
        at = np.broadcast_to(np.maximum(touched, 0), tangent.shape)
        latest = np.take_along_axis(tangent, at, -1)
        return latest if self.form == 'play' else 2.0 * tangent - latest

    def _contact(self, q: Array) -> tuple[Array, NDArray[np.intp]]:
        """Return output minus input where a side is touched (else 0), and when it last was."""
        width = self.number('width')
        lag = play(q, width, q[..., 0]) - q
        # Whatever is within rounding of a side rests on it; a closed gap always rests on the
        # side opposite to the motion.
        rounding = 4.0 * np.spacing(np.abs(q).max(initial=1.0))
        step = np.diff(q, axis=-1, prepend=q[..., :1])
        is_open = width > 4.0 * rounding
        side = np.where(is_open, lag, -step)
        resting = np.abs(side) >= np.where(is_open, 0.5 * width - rounding, 1e-300)
        return np.where(resting, side, 0.0), last_true(resting)

    @classmethod
    def seeds(cls, view: View, joint: str | None, pull: Array | None = None) -> Iterable[Effect]:
        """Yield play of a small, a usual and a large width: how it engages depends on width."""
        for width in (5e-5, 5e-4, 2e-3):
            yield cls(str(joint), width)

    def atoms(self, view: View) -> list[Shift]:
        return [{key: value / self.width for key, value in self.displace(view).items()}]

    def remedy(self, robot: Robot) -> str:
        play = self._travelled(robot, self._plain('width'))
        if self.form == 'coast':
            return (
                f'Approach stations with {self.site} always from one side, or preload its gear: '
                f'where it stops it coasts across {play} of play and rests ahead of its command.'
            )
        return (
            f'Service the gear of {self.site}: it has {play} of play; '
            'until then approach seams from one side.'
        )


def _reversals(q: Array, state: Any) -> tuple[Array, Any]:
    """Return 1.0 where the direction differs from that of the last motion, and what to carry."""
    before, moved = state if state is not None else (q[..., 0], np.zeros(q.shape[:-1]))
    path = np.concatenate([np.asarray(before)[..., None], q], axis=-1)
    direction = np.sign(np.diff(path, axis=-1))
    # Prefix the direction carried over, so that index 0 always holds a motion or rest.
    direction = np.concatenate([np.asarray(moved)[..., None], direction], axis=-1)
    last = np.maximum(last_true(direction != 0.0), 0)
    latest = np.take_along_axis(direction, last, -1)
    flips = (latest[..., 1:] * latest[..., :-1] < 0.0).astype(np.float64)
    return flips, (q[..., -1], latest[..., -1])


_CHANGED = 0.3
"""Share of half the play by which the joint must come off its flank: less looks like an offset."""


_BENDS = 7
"""Torques at which a curve may bend, from the least to the most of its `shares`: 1.3 apart."""


class _BentSearch(SearchHooks):
    def trials(self, view: View, joint: str | None) -> float:
        """Return among how many torques a fit chooses."""
        return float(_BENDS)


class _LoadedSearch(_BentSearch):
    kind: type[LoadedPlay]

    def constants(self, view: View, joint: str | None) -> Iterable[Effect]:
        """Yield play of a gear that slides easily, where the load keeps it on one flank."""
        torque = load(view, view.robot.index(str(joint)))
        friction = self.kind.shares[0] * float(np.abs(torque).max(initial=0.0))
        if friction > 0.0 and not _changes(torque, friction):
            yield self.kind(str(joint), 0.0, friction)


class _BentFit(FitHooks):
    effect: LoadedPlay | Stiffening

    def starts(self, view: View, zoom: int) -> tuple[list[Any], Array] | None:
        """Return curves that bend anywhere between the torques that a search starts from."""
        each = [] if zoom else self.effect._curves(view, self.effect.joint, _BENDS)
        if not each:
            return None
        torque = load(view, view.robot.index(self.effect.joint))
        return each, np.stack([curve.bent(torque) for curve in each])


class _BentByLoad(LinearEffect):
    """What a joint does under its load torque, along a curve that bends at ``torque`` [N m]."""

    joint: str
    torque: float

    of = 'joint'
    stage = Stage.LINK
    options = ('torque',)
    needs = frozenset({'load'})
    fit = Hooked(_BentFit)
    shares: ClassVar[tuple[float, float]] = (0.03, 0.15)
    """Torques that a search starts from, in the largest load seen; a fit takes any between."""

    def check(self, robot: Robot) -> None:
        """Refuse a curve without a bend: it would jump."""
        super().check(robot)
        if not float(self.torque) > 0.0:
            raise ModelError(f'{self.name}: torque must be above zero, got {self.torque!r}')

    @abstractmethod
    def bent(self, pull: Array) -> Array:
        """Return what a load, any shape, does to the joint where the one parameter is one."""

    def per_unit(self, view: View) -> list[Shift]:
        i = view.robot.index(self.joint)
        return [{('q', i): self.bent(load(view, i))}]

    @classmethod
    def seeds(
        cls: type[Any], view: View, joint: str | None, pull: Array | None = None
    ) -> Iterable[Effect]:
        """Return curves that bend under a small load and under a larger one."""
        return list(cls._curves(view, str(joint), 2))

    @classmethod
    def _curves(cls: type[Any], view: View, joint: str, count: int) -> list[Any]:
        """Return curves of no size that bend at torques from the least to the most of `shares`."""
        torque, (least, most) = load(view, view.robot.index(joint)), cls.shares
        bends = np.abs(torque).max(initial=0.0) * np.geomspace(least, most, count)
        # Where the load stays on one side, so does the flank, and that is an offset.
        return [cls(joint, 0.0, b) for b in bends.tolist() if b > 0.0 and _changes(torque, b)]


@register
class LoadedPlay(_BentByLoad):
    """Play of full ``width`` whose side the load decides; ``torque`` [N m] is what friction holds."""

    joint: str
    width: Value = 0.0
    torque: float = 1.0

    traits = Traits(
        title='play under load',
        meaning='play whose side the load decides',
        formula='θ → θ + width/2 · τ / √(τ² + torque²), τ the load torque: the flank that the '
        'load pulls to',
        entered="the joint's gear",
        depends_on='load',
        common=False,
        by_motion=True,
    )
    parameters = (
        Parameter('width', 'rad', typical=5e-4, lower=0.0)
        .plausible((5e-4, 0.0, 2e-2), f'{RV}; see backlash')
        .plausible_sliding(
            (5e-5, 0.0, 5e-3), 'derived: nuts have hundredths of a millimetre of play'
        ),
    )
    search = Hooked(_LoadedSearch)

    def bent(self, pull: Array) -> Array:
        return np.asarray(0.5 * pull / np.hypot(pull, self.torque))

    def remedy(self, robot: Robot) -> str:
        return (
            f'Service or preload the gear of {self.site}: its load lays it on one flank or the other '
            f'of {self._travelled(robot, self._plain("width"))} of play.'
        )


@register
class Stiffening(_BentByLoad):
    """The joint yields by ``compliance`` under a small load and by less under ``torque`` [N m]."""

    joint: str
    compliance: Value = 0.0
    torque: float = 1.0

    traits = Traits(
        title='stiffening spring',
        meaning='a joint gives way under load, ever less the more it bears',
        formula='θ → θ + x, x + x³ / (compliance · torque)² = compliance · τ, τ the load torque: a '
        'gear that is soft under a small load and stiff under a large one',
        entered='program',
        depends_on='load',
        changes_in_use=True,
        common=False,
        by_motion=True,
    )
    parameters = JointCompliance.parameters
    search = Hooked(_BentSearch)
    shares = (0.1, 0.5)

    def bent(self, pull: Array) -> Array:
        third = np.arcsinh(1.5 * np.sqrt(3.0) * pull / self.torque) / 3.0
        return np.asarray(2.0 / np.sqrt(3.0) * self.torque * np.sinh(third))

    def remedy(self, robot: Robot) -> str:
        return (
            f'Compensate the yielding of {self.site} under load by a curve: it is softest under a '
            f'small load, and stiffens from about {size(float(self.torque))} '
            f'{"N" if self.on_slide(robot) else "N m"} on. If that is new, look for play in its gear: '
            'with a spring it does nearly the same.'
        )


def _changes(torque: Array, friction: float) -> bool:
    """Return whether a load, shape (N,), moves a gear from its flank that friction holds so far."""
    return bool(np.ptp(torque / np.hypot(torque, friction)) > _CHANGED)
