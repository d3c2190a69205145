# Copyright 2026 weld_twin contributors
# SPDX-License-Identifier: Apache-2.0
"""Curves that were measured, not derived, over a quantity of a view: of a joint, of base or tool."""

from __future__ import annotations

from collections.abc import Callable, Sequence
from functools import lru_cache
from numbers import Real

import numpy as np

from ..arm.channels import ROW_CHANNELS
from ..arm.dynamics import chain_gravity_torque, wrench_torque
from ..cubics import hermite, natural_slopes
from ..errors import DataError, ModelError
from .effect import Effect, FitHooks, Hooked, SearchHooks, Traits, TwinHooks, register
from .view import Array, Channel, Parameter, Robot, Shift, Stage, Value, View

AT_REST = 2e-3
"""Speed [rad/s or m/s] at which the direction of motion counts for two thirds: some ten times the
speed that the noise of encoders makes of a standing joint."""


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
    """Return the recorded temperature, shape (N,) [degC]; DataError where there is none."""
    if view.temperature is None:
        raise DataError('a curve over temperature needs one: record /temperature')
    return view.temperature


_Quantity = Callable[[View, int], Array]
QUANTITIES: dict[str, _Quantity] = {
    'constant': lambda view, index: np.zeros(np.shape(view.q[..., index])),
    'angle': lambda view, index: view.joint(index),
    'direction': lambda view, index: np.tanh(view.qd[..., index] / AT_REST),
    'speed': lambda view, index: view.qd[..., index],
    'load': load,
    'temperature': _temperature,
    'time': lambda view, _: view.elapsed,
}
"""What a curve may run over at a joint, shape (..., N): zero where it is over nothing, its direction
from -1 to 1 and 0 at rest, the time since the first stamp [s]."""


def basis(knots: Sequence[float], x: Array) -> Array:
    """
    Return how much the value at each of K increasing knots counts at x, shape (K, ...).

    Natural cubic splines through unit values, one for each knot; beyond the knots, where nothing
    is known, the value at the end stays.
    """
    if len(knots) == 1:
        return np.ones((1, *np.shape(x)))
    values, _ = _cardinal(tuple(float(k) for k in knots), np.clip(x, knots[0], knots[-1]))
    return np.asarray(np.moveaxis(values, -1, 0))


def _basis_slope(knots: Sequence[float], x: Array) -> Array:
    """Return the derivative of `basis` by x, shape (K, ...); 0 beyond the knots."""
    _, rates = _cardinal(tuple(float(k) for k in knots), np.clip(x, knots[0], knots[-1]))
    inside = (x >= knots[0]) & (x <= knots[-1])
    return np.asarray(np.moveaxis(rates, -1, 0) * inside)


def _cardinal(knots: tuple[float, ...], x: Array) -> tuple[Array, Array]:
    """Return the natural splines that are one at one knot each, and their slopes."""
    return hermite(np.array(knots), np.eye(len(knots)), _slopes(knots), x)


@lru_cache(maxsize=256)
def _slopes(knots: tuple[float, ...]) -> Array:
    return natural_slopes(np.array(knots), np.eye(len(knots)))


def _check_knots(name: str, over: str, knots: Sequence[float], count: int) -> None:
    """Raise ModelError unless knots over a known quantity increase, and each has its value."""
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


_KNOT = 0.1
"""Least distance [rad] of the knots of a joint's curve: ripple of the orders up to ten or so bends
within some tenths of a radian. A joint that travels less has no curve."""
_LEAST_KNOTS, _MOST_KNOTS = 2, 8
"""Fewest and most intervals of such a curve: one would be a line, more than eight are waves."""


class _Search(SearchHooks):
    kind: type[JointCurve]

    def bend(self, joint: str, angles: Array) -> JointCurve | None:
        """Return a level curve over the angle, None where its knots would be too near."""
        low, high = float(angles.min()), float(angles.max())
        count = min(int((high - low) / _KNOT), _MOST_KNOTS)
        if count < _LEAST_KNOTS:
            return None
        return self.kind(
            joint, np.zeros(count + 1), tuple(np.linspace(low, high, count + 1).tolist())
        )


class _Fit(FitHooks):
    effect: JointCurve

    def alike(self) -> list[tuple[str, ...]]:
        """Return one label for each joint: every gear is as uneven as it was cut."""
        return [(self.effect.name, self.effect.joint)] * self.coordinates().size


class _Twin(TwinHooks):
    effect: JointCurve

    def off_outside(self) -> float:
        """Return the RMS of a curve over the angle: no formula says how it goes on beyond."""
        if (self.effect.over, self.effect.channel) != ('angle', 'q'):
            return 0.0
        return float(np.sqrt(np.mean(np.square(self.effect.values))))

    def slope(self, view: View) -> Shift:
        """Return the slope of a curve over the angle that bends the joint itself."""
        if (self.effect.over, self.effect.channel) != ('angle', 'q'):
            return {}
        index = view.robot.index(self.effect.joint)
        rise = _basis_slope(self.effect.knots, view.joint(index))
        values = np.asarray(self.effect.values, dtype=np.float64)
        return {self.effect._site(view): np.tensordot(values, rise, axes=(-1, 0))}


@register
class JointCurve(Effect):
    """
    A spline over ``over``, through ``values`` at ``knots``, added to ``channel`` of a joint.

    ``over`` is 'angle', 'direction', 'speed', 'load', 'temperature', 'time', or 'constant' with a
    single knot; ``channel`` is 'q', the joint's position, or a value of its row ('theta', 'd', 'a',
    'alpha', 'beta'), whose unit the values have. It stands for causes that nobody has a formula
    for.
    """

    joint: str
    values: Value = (0.0, 0.0)
    knots: Sequence[float] = (-1.0, 1.0)
    over: str = 'angle'
    channel: str = 'q'

    traits = Traits(
        title='measured curve',
        entered='program',
        cause=False,
        by_motion=True,
        bends=True,
        formula='θ → θ + s(x), s the natural cubic spline through `values` at `knots` and '
        "constant beyond them; x is the joint's `angle`, `direction` (−1 to 1), "
        '`speed`, `load` torque, the `temperature` or the `time` since the first stamp,'
        ' or `constant` (one knot); on `channel` `d`, `a`, `alpha`, `beta` of the '
        "joint's row in place of the joint",
    )
    of = 'joint'
    stage = Stage.LINK
    parameters = (Parameter('values', 'rad', size=0, typical=2e-4),)
    options = ('knots', 'over', 'channel')
    search = Hooked(_Search)
    fit = Hooked(_Fit)
    twin = Hooked(_Twin)

    def check(self, robot: Robot) -> None:
        super().check(robot)
        _check_knots(self.name, self.over, self.knots, np.shape(self.values)[-1])
        if self.channel not in ('q', *ROW_CHANNELS):
            raise ModelError(
                f'{self.name}: channel must be one of q, {", ".join(ROW_CHANNELS)}, '
                f'got {self.channel!r}'
            )

    @property
    def on(self) -> str:
        return self.over

    def _basis(self, view: View) -> Array:
        index = view.robot.index(self.joint)
        return basis(self.knots, QUANTITIES[self.over](view, index))

    def _site(self, view: View) -> tuple[str, int]:
        return self.channel, view.robot.index(self.joint)

    def displace(self, view: View) -> Shift:
        values = np.asarray(self.values, dtype=np.float64)
        return {self._site(view): np.tensordot(values, self._basis(view), axes=(-1, 0))}

    def gradient(self, view: View) -> list[Shift | None]:
        """Return how much the value at each knot counts."""
        return [{self._site(view): row} for row in self._basis(view)]

    def remedy(self, robot: Robot) -> str:
        return (
            f'Look at {self.site}: it is off by a curve over the {self.on} that no known effect '
            'gives.'
        )


_FRAMES = ('base', 'tool')
_OVER = ('constant', 'temperature', 'time')


@register
class FrameCurve(Effect):
    """
    A spline over temperature or time, through ``xyz`` [m] and ``rotvec`` [rad] at ``knots``.

    ``over`` may be 'constant', with one knot. Both hold one value for each knot and axis, all
    knots of the first axis first. It stands for causes that nobody has a formula for; a diagnosis
    does not name it as a cause.
    """

    xyz: Value = (0.0,) * 6
    rotvec: Value = (0.0,) * 6
    knots: Sequence[float] = (0.0, 1.0)
    over: str = 'time'
    frame: str = 'base'

    traits = Traits(
        title='measured motion',
        entered='program',
        depends_on='time',
        cause=False,
        formula='like `base_pose` or `tool_pose` (`frame`), each component a spline over `time` or '
        '`temperature`; all knots of x first, then of y and z',
    )
    of = 'robot'
    stage = Stage.LINK
    parameters = (
        Parameter('xyz', 'm', size=0, typical=1e-4),
        Parameter('rotvec', 'rad', size=0, typical=1e-4),
    )
    options = ('knots', 'over', 'frame')

    def check(self, robot: Robot) -> None:
        super().check(robot)
        for part in (self.xyz, self.rotvec):
            count = np.shape(part)[-1]
            _check_knots(self.name, self.over, self.knots, count // 3 if count % 3 == 0 else -1)
        if self.frame not in _FRAMES or self.over not in _OVER:
            raise ModelError(
                f'{self.name}: frame must be base or tool and over constant, temperature or time, '
                f'got {self.frame!r} and {self.over!r}'
            )

    @property
    def at(self) -> str:
        return self.frame

    @property
    def on(self) -> str:
        return self.over

    def displace(self, view: View) -> Shift:
        weights = basis(self.knots, QUANTITIES[self.over](view, 0))
        out: dict[Channel, Array] = {}
        for at, part in enumerate((self.xyz, self.rotvec)):
            values = np.asarray(part, dtype=np.float64)
            values = values.reshape(*values.shape[:-1], 3, len(self.knots))
            for axis in range(3):
                curve = np.tensordot(values[..., axis, :], weights, axes=(-1, 0))
                out[self.frame, 3 * at + axis] = curve
        return out

    def gradient(self, view: View) -> list[Shift | None]:
        """Return how much the value at each knot counts, for every axis."""
        weights = basis(self.knots, QUANTITIES[self.over](view, 0))
        return [{(self.frame, axis): row} for axis in range(6) for row in weights]

    def remedy(self, robot: Robot) -> str:
        return (
            f'Look at the {self.at}: it moves over the {self.on} in a way that no known effect '
            'gives.'
        )
