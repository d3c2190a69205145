# Copyright 2026 weld_twin contributors
# SPDX-License-Identifier: Apache-2.0
"""Curves nobody has a formula for: a spline through values at knots, over a quantity of a view."""

from __future__ import annotations

from collections.abc import Callable, Sequence
from functools import lru_cache
from numbers import Real

import numpy as np

from ..arm.dynamics import chain_gravity_torque, wrench_torque
from ..arrays import Array
from ..cubics import hermite, spline_slopes
from ..errors import DataError, ModelError
from .view import View

AT_REST = 2e-3
"""Speed [rad/s or m/s] at which the direction of motion counts for two thirds: some ten times the
speed that the noise of encoders makes of a standing joint."""


def _constant(view: View, index: int) -> Array:
    """Return zero, shape (..., N): a curve over nothing has one knot, at zero."""
    return np.zeros(np.shape(view.q[..., index]))


def angle(view: View, index: int) -> Array:
    """Return the joint's position, shape (..., N) [rad or m]."""
    return view.joint(index)


def direction(view: View, index: int) -> Array:
    """Return -1 to 1, which way the joint moves; 0 at rest, shape (..., N)."""
    return np.tanh(view.qd[..., index] / AT_REST)


def _speed(view: View, index: int) -> Array:
    """Return the joint's velocity, shape (..., N) [rad/s or m/s]."""
    return view.qd[..., index]


def load(view: View, index: int) -> Array:
    """Return the load torque of links, payload and wrench, shape (..., N) [N m or N]."""
    known = view.shift.get(('tau', index))
    if known is not None:
        return np.asarray(known)
    torque = chain_gravity_torque(view.robot, view.frames)
    if view.wrench is not None:
        torque = torque + wrench_torque(view.robot, view.frames, view.wrench, view.wrench_frame)
    return np.asarray(torque[index])


def _temperature(view: View, index: int) -> Array:
    """
    Return the recorded temperature, shape (N,) [degC].

    Raises DataError: none was recorded.
    """
    if view.temperature is None:
        raise DataError('a curve over temperature needs one: record /temperature')
    return view.temperature


def time(view: View, index: int) -> Array:
    """Return the time since the first stamp, shape (N,) [s]."""
    return view.elapsed


_Quantity = Callable[[View, int], Array]
QUANTITIES: dict[str, _Quantity] = {
    'constant': _constant,
    'angle': angle,
    'direction': direction,
    'speed': _speed,
    'load': load,
    'temperature': _temperature,
    'time': time,
}
"""What a curve may run over; the second argument is the joint's index."""


def basis(knots: Sequence[float], x: Array) -> Array:
    """
    Return how much the value at each knot counts at x, shape (K, ...).

    Natural cubic splines through unit values, one for each knot; beyond the knots, where nothing
    is known, the value at the end stays.

    knots: increasing.
    x: shape (...).
    """
    if len(knots) == 1:
        return np.ones((1, *np.shape(x)))
    values, _ = _cardinal(tuple(float(k) for k in knots), np.clip(x, knots[0], knots[-1]))
    return np.asarray(np.moveaxis(values, -1, 0))


def basis_slope(knots: Sequence[float], x: Array) -> Array:
    """Return the derivative of `basis` by x, shape (K, ...); 0 beyond the knots."""
    _, rates = _cardinal(tuple(float(k) for k in knots), np.clip(x, knots[0], knots[-1]))
    inside = (x >= knots[0]) & (x <= knots[-1])
    return np.asarray(np.moveaxis(rates, -1, 0) * inside)


def _cardinal(knots: tuple[float, ...], x: Array) -> tuple[Array, Array]:
    """Return the natural splines that are one at one knot each, and their slopes."""
    return hermite(np.array(knots), np.eye(len(knots)), _slopes(knots), x)


@lru_cache(maxsize=256)
def _slopes(knots: tuple[float, ...]) -> Array:
    return spline_slopes(np.array(knots), np.eye(len(knots)), natural=True)


def check_knots(name: str, over: str, knots: Sequence[float], count: int) -> None:
    """
    Refuse a curve that is none.

    Raises ModelError: it runs over something unknown, or knots do not increase, or not each has a
    value.

    name: how the message names the curve.
    over: the quantity that it runs over.
    knots: where it has values, in the unit of that quantity.
    count: how many values it has.
    """
    if over not in QUANTITIES:
        raise ModelError(f'{name}: over must be one of {", ".join(QUANTITIES)}, got {over!r}')
    least = 1 if over == 'constant' else 2
    plain = all(isinstance(knot, Real) for knot in knots)
    if not plain or len(knots) < least or not (np.diff(np.asarray(knots, float)) > 0.0).all():
        raise ModelError(f'{name}: knots must be two or more increasing numbers, got {knots!r}')
    if count != len(knots):
        raise ModelError(
            f'{name}: every knot needs its value, but there are {len(knots)} knots and {count}'
        )
