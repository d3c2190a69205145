# Copyright 2026 weld_twin contributors
# SPDX-License-Identifier: Apache-2.0
"""Transmission ripple: theta -> theta + sum A sin(n theta + phase), n in cycles per turn."""

from __future__ import annotations

from collections.abc import Iterable
from dataclasses import replace
from typing import Any

import numpy as np
from numpy.typing import NDArray

from ..errors import ModelError
from .backlash import RV
from .effect import Effect, FitHooks, Hooked, SearchHooks, Traits, TwinHooks, register
from .hooks import Waves, highest_order
from .view import Array, Parameter, Robot, Shift, Stage, Value, View
from .wording import size

_MAX_ORDER = 100
"""Highest order a search considers: one per tooth of a 100:1 strain-wave gear."""
_HIGHEST_LINE = 420
"""Highest order of a single line looked for: some four per tooth of such a gear. A judgement."""
_BANDS = (4, 8, 16, 24, 36, 54, 81, 121, 1000)
"""Orders whose amplitudes are expected to be alike: up to a band's last order. Amplitudes fall off
with the order, so bands widen with it; where they end is a judgement."""

_MANY_ORDERS, _SPARSE = 8, 3
"""Whole orders from which on their sum is worked out by powers of exp(i theta), and how many times as
many powers as orders there may be: a sine takes as long as some five products."""


class _Twin(TwinHooks):
    effect: TransmissionRipple

    def slope(self, view: View) -> Shift:
        total = _sum(a * n * np.cos(angle) for a, n, angle in self.effect._terms(view))
        return self.effect._moves(view, total)


class _Search(SearchHooks):
    effect: TransmissionRipple
    kind: type[TransmissionRipple]

    def lines(self, joint: str, orders: Array) -> list[TransmissionRipple]:
        return [self.kind(joint, 0.0, float(order), 0.0) for order in orders]

    def small(self, view: View, joint: str | None, most: int) -> list[TransmissionRipple]:
        """Return one ripple of all orders up to the highest that the measurements can hold apart."""
        orders = np.arange(1.0, min(_MAX_ORDER, most) + 1.0)
        zero = np.zeros(orders.size)
        return [self.kind(str(joint), zero, orders, zero)] if orders.size else []

    def orders(self) -> Array:
        return np.atleast_1d(np.asarray(self.effect.order, dtype=np.float64))

    def surprise(self, among: float) -> float:
        """
        Return minus the log probability of its order, of those from 1 on.

        An order counts as scales do [1]_: as likely from 1 to 2 as from 50 to 100. Wheels are out of
        round once and twice a turn; teeth and rollers make any number of waves.

        References
        ----------
        .. [1] H. Jeffreys, "Theory of Probability", 3rd ed., Oxford 1961, section 3.1.

        """
        every = float(np.sum(1.0 / np.arange(1.0, max(among, 1.0) + 1.0)))
        return float(np.log(self.orders()[0] * every))

    def with_orders(self, orders: Array) -> TransmissionRipple:
        own, pairs = self.orders(), self.effect.fit.coordinates().reshape(-1, 2)
        wanted = [pairs[own == order].sum(axis=0) for order in orders]
        like = self.kind(self.effect.joint, 0.0, orders if orders.size > 1 else orders.item(), 0.0)
        return like.from_atoms(np.array(wanted))

    def joined(self, other: TransmissionRipple) -> TransmissionRipple:
        parts: dict[str, Any] = {
            p.name: np.append(getattr(self.effect, p.name), getattr(other, p.name))
            for p in self.effect.parameters
        }
        return replace(self.effect, **parts)


class _Fit(FitHooks):
    effect: TransmissionRipple

    def alike(self) -> list[tuple[str, ...]]:
        """Return a label per sine and cosine: the joint and the band of its order."""
        band = np.searchsorted(_BANDS, np.repeat(self.effect.search.orders(), 2))
        return [(self.effect.name, self.effect.joint, str(b)) for b in band]

    def errors(self, std: Array) -> dict[str, Any]:
        """Return the errors of amplitude and phase; sine and cosine are what was fitted."""
        amplitude = np.atleast_1d(np.asarray(self.effect.amplitude))
        spread = np.sqrt((std.reshape(-1, 2) ** 2).mean(axis=1))
        phase = np.minimum(spread / np.maximum(amplitude, 1e-300), np.pi)
        if np.ndim(self.effect.amplitude) > 0:
            return {'amplitude': spread.tolist(), 'phase': phase.tolist()}
        return {'amplitude': float(spread[0]), 'phase': float(phase[0])}

    def coordinates(self) -> Array:
        """Return sine and cosine coefficients, pairs in order; the orders stay."""
        amplitude = np.atleast_1d(np.asarray(self.effect.amplitude, dtype=np.float64))
        phase = np.atleast_1d(np.asarray(self.effect.phase, dtype=np.float64))
        return np.stack([amplitude * np.cos(phase), amplitude * np.sin(phase)], -1).ravel()

    def with_coordinates(self, values: Array) -> TransmissionRipple:
        return self.effect.from_atoms(values)

    def straight(self) -> NDArray[np.bool_]:
        return np.ones(self.coordinates().size, dtype=bool)

    def coordinate_shifts(self, view: View) -> list[Shift]:
        return self.effect.atoms(view)

    def coordinate_scales(self) -> Array:
        return np.full(2 * np.size(self.effect.order), self.effect.parameters[0].typical)


@register
class TransmissionRipple(Effect):
    """
    Periodic error of the gear, one or several orders at once.

    Each parameter is a number or a list with one entry per order; a number beside lists holds
    for every order.
    """

    joint: str
    amplitude: Value = 0.0
    order: Value = 1.0
    phase: Value = 0.0

    traits = Traits(
        title='transmission ripple',
        meaning='a gear turns unevenly, in waves over its turn',
        formula='θ → θ + Σ amplitude sin(order θ + phase); numbers, or lists with one entry per'
        ' order',
        entered='program',
        depends_on='angle',
        demand=1,
        by_motion=True,
        everywhere=True,
        waves=Waves(dense=_MAX_ORDER, highest=_HIGHEST_LINE),
    )
    of = 'joint'
    stage = Stage.JOINT
    parameters = (
        Parameter('amplitude', 'rad', size=0, typical=2e-4)
        .plausible((2e-4, 3e-3), f'{RV}; range derived: ten times that, a gear that is worn out')
        .plausible_sliding(
            (2e-5, 1e-3), 'derived: a turn of a screw repeats within hundredths of a millimetre'
        ),
        Parameter('order', '1/rev', size=0, lower=0.0, differentiable=False, linear=False),
        Parameter('phase', 'rad', size=0, linear=False),
    )
    twin = Hooked(_Twin)
    search = Hooked(_Search)
    fit = Hooked(_Fit)

    def __post_init__(self) -> None:
        super().__post_init__()
        shapes = {p.name: np.shape(getattr(self, p.name)) for p in self.parameters}
        lengths = {shape[-1] for shape in shapes.values() if shape}
        if len(lengths) > 1:
            raise ModelError(
                'transmission_ripple: amplitude, order and phase must be numbers or lists of one '
                f'length, got lengths {sorted(lengths)}'
            )
        for name, shape in shapes.items():
            if lengths and not shape:
                every = np.full(lengths.copy().pop(), getattr(self, name), dtype=np.float64)
                every.setflags(write=False)
                object.__setattr__(self, name, every)

    def _terms(self, view: View) -> Iterable[tuple[Array, Array, Array]]:
        theta = self._theta(view)
        count = np.shape(self.order)[-1:]
        for index in range(*count) if count else (None,):
            phase = self.number('phase', index)
            order = self.number('order', index)
            yield self.number('amplitude', index), order, order * theta + phase

    def displace(self, view: View) -> Shift:
        if self._dense():
            return self._moves(view, self._all_orders(view))
        return self._moves(view, _sum(a * np.sin(angle) for a, _, angle in self._terms(view)))

    def _dense(self) -> bool:
        """Return whether there are so many whole orders that powers are quicker than sines."""
        shapes = {np.shape(getattr(self, p.name)) for p in self.parameters}
        orders = self.search.orders()
        if len(shapes) > 1 or orders.size < _MANY_ORDERS or orders.ndim != 1:
            return False
        whole = (orders == np.rint(orders)).all() and orders.min() > 0.0
        return bool(whole and orders.max() <= _SPARSE * orders.size)

    def _all_orders(self, view: View) -> Array:
        orders = self.search.orders().astype(int)
        weights = np.zeros(int(orders.max()) + 1, complex)
        np.add.at(weights, orders, self.amplitude * np.exp(1j * np.asarray(self.phase)))
        turn = np.exp(1j * self._theta(view))
        total = np.zeros_like(turn)
        for weight in weights[::-1]:
            total *= turn
            total += weight
        return np.asarray(total.imag)

    def gradient(self, view: View) -> list[Shift | None]:
        """Return d/d amplitude of every order, None for the orders, d/d phase of every order."""
        terms = list(self._terms(view))
        amplitude: list[Shift | None] = [self._moves(view, np.sin(angle)) for _, _, angle in terms]
        phase = [self._moves(view, a * np.cos(angle)) for a, _, angle in terms]
        return [*amplitude, *[None] * len(terms), *phase]

    @classmethod
    def seeds(cls, view: View, joint: str | None, pull: Array | None = None) -> Iterable[Effect]:
        """Return one instance per integer order that the joint's range of motion can tell."""
        most = highest_order(view.joint(view.robot.index(str(joint))))
        return cls.search.lines(str(joint), np.arange(1.0, min(_MAX_ORDER, int(most)) + 1.0))

    def atoms(self, view: View) -> list[Shift]:
        """Return sine and cosine of every order, so that amplitude and phase become linear."""
        theta, orders = self._theta(view), self.search.orders()
        if not self._dense():
            return [self._moves(view, f(n * theta)) for n in orders for f in (np.sin, np.cos)]
        turn, now, powers = np.exp(1j * theta), np.ones_like(theta, complex), {}
        for n in range(1, int(orders.max()) + 1):
            now = now * turn
            powers[n] = now
        waves = [powers[int(n)] for n in orders]
        return [self._moves(view, part) for wave in waves for part in (wave.imag, wave.real)]

    def from_atoms(self, coefficients: Array) -> TransmissionRipple:
        """Return amplitude and phase of sine and cosine coefficients, pairs in `atoms` order."""
        sine, cosine = np.asarray(coefficients, dtype=np.float64).reshape(-1, 2).T
        amplitude, phase = np.hypot(sine, cosine), np.arctan2(cosine, sine)
        if np.ndim(self.order) == 0:
            return TransmissionRipple(self.joint, float(amplitude[0]), self.order, float(phase[0]))
        return TransmissionRipple(self.joint, amplitude, self.order, phase)

    def remedy(self, robot: Robot) -> str:
        amplitude = np.atleast_1d(np.asarray(self.amplitude))
        order = np.atleast_1d(np.asarray(self.order))
        strongest = np.argsort(-np.abs(amplitude))[:3]
        slides = self.on_slide(robot)
        waves = ', '.join(
            f'{size(amplitude[k] * 1e3, 2)} mm every {2e3 * np.pi / order[k]:.3g} mm'
            if slides
            else f'{size(np.degrees(amplitude[k]), 2)} deg at {order[k]:g} per turn'
            for k in strongest
        )
        more = f' and {amplitude.size - 3} smaller orders' if amplitude.size > 3 else ''
        return (
            f'Compensate the ripple of {self.site} by table ({waves}{more}); inspect its gear and '
            'encoder if it grows.'
        )


def _sum(waves: Iterable[Array]) -> Array:
    return np.asarray(sum(waves))
