# Copyright 2026 weld_twin contributors
# SPDX-License-Identifier: Apache-2.0
"""A measured curve as a small picture: the spline, its band, and axes in units people read."""

from __future__ import annotations

import numpy as np

from weld_twin_core.arrays import Array
from weld_twin_core.effects.curve import basis
from weld_twin_core.effects.frame_curve import FrameCurve
from weld_twin_core.effects.joint_curve import JointCurve

from .charts import Axis, Line, chart
from .html import Html

_SAMPLES = 60
"""Points of a drawn curve: one for every four units of its width."""
_FLAT = 0.05
"""Part of a curve's size within which it is told as the same everywhere."""
_NINETY = 1.645
"""Standard deviations to either side that hold 90 % of a Gaussian."""
_DEGREES = 180.0 / np.pi
"""Degrees in a radian."""
_AXES = {
    'angle': (_DEGREES, Axis('angle', '°')),
    'direction': (1.0, Axis('direction, backward to forward')),
    'speed': (_DEGREES, Axis('speed', '°/s')),
    'load': (1.0, Axis('load torque', 'N m')),
    'temperature': (1.0, Axis('temperature', '°C')),
    'time': (1.0, Axis('time', 's')),
}
_VALUES = {'d': (1e3, 'mm'), 'a': (1e3, 'mm')}


def curve_figure(curve: JointCurve, covariance: Array | None, joint: int) -> Html:
    """
    Return a figure of a curve over what it runs over.

    Parameters
    ----------
    curve : JointCurve
    covariance : array, shape (K, K), optional
        Of its values; without it there is no band.
    joint : int
        Number of its joint: over its angle, the cursor follows the instant looked at.

    """
    x, weights, y = _sampled(curve)
    band = np.zeros_like(y)
    if covariance is not None:
        band = _NINETY * np.sqrt(
            np.maximum(np.einsum('ki,kl,li->i', weights, covariance, weights), 0)
        )
    size, unit = _VALUES.get(curve.channel, (_DEGREES, '°'))
    across, label = _AXES[curve.over]
    what = 'how far off' if curve.channel == 'q' else curve.channel
    middle, half = y * size, band * size
    return chart(
        f'{curve.joint}: {what} by {curve.over}, {furthest(curve)}',
        x * across,
        [Line('off by', middle), Line('not off', 0.0 * middle, 'soft', dashed=True)],
        (label, Axis('off by', unit)),
        band=(middle - half, middle + half),
        joint=joint if curve.over == 'angle' else None,
    )


def furthest(curve: JointCurve) -> str:
    """Return how far a curve is off where it is furthest off, and where that is."""
    size, unit = _VALUES.get(curve.channel, (_DEGREES, '°'))
    if curve.over == 'constant':
        return f'{size * float(np.ravel(curve.values)[0]):.3g}{_spaced(unit)} everywhere'
    x, _, y = _sampled(curve)
    at = int(np.argmax(np.abs(y)))
    if float(np.ptp(y)) < _FLAT * abs(float(y[at])):
        return f'{size * float(y[at]):.3g}{_spaced(unit)} everywhere'
    return (
        f'up to {size * abs(float(y[at])):.3g}{_spaced(unit)} {_where(curve.over, float(x[at]))}'
    )


def furthest_frame(curve: FrameCurve) -> str:
    """Return how far a frame moves by its curve where it moves furthest."""
    moved, turned = (
        float(np.linalg.norm(np.reshape(part, (3, -1)), axis=0).max())
        for part in (np.asarray(curve.xyz), np.asarray(curve.rotvec))
    )
    return (
        f'up to {1e3 * moved:.3g}\N{NO-BREAK SPACE}mm and turns by up to {_DEGREES * turned:.3g}°'
    )


def _where(over: str, at: float) -> str:
    if over == 'direction':
        return f'going {"forward" if at > 0.0 else "backward"}'
    across, axis = _AXES[over]
    return f'at {across * at:.3g}{_spaced(axis.unit)}'


def _spaced(unit: str) -> str:
    return unit if unit == '°' else f'\N{NO-BREAK SPACE}{unit}'


def _sampled(curve: JointCurve) -> tuple[Array, Array, Array]:
    """Return what a curve runs over, (N,), the weights of its values, (K, N), and what it is there."""
    x = np.linspace(curve.knots[0], curve.knots[-1], _SAMPLES)
    weights = np.asarray(basis(curve.knots, x))
    return x, weights, np.asarray(np.asarray(curve.values) @ weights)
