# SPDX-FileCopyrightText: weld_twin contributors
# SPDX-License-Identifier: Apache-2.0
"""A measured curve as a small picture: the spline, its band, and axes in units people read."""

from __future__ import annotations

import numpy as np

from weld_twin_core.arrays import Array
from weld_twin_core.effects.curve import basis
from weld_twin_core.effects.joint_curve import JointCurve

from .html import Html, tag

_WIDTH, _HEIGHT = 300.0, 170.0
"""Of a figure, in units of its view box."""
_LEFT, _RIGHT, _TOP, _BOTTOM = 52.0, 8.0, 10.0, 34.0
"""Margins for the labels, in the same units."""
_SAMPLES = 60
"""Points of a drawn curve: one for every four units of its width."""
_NINETY = 1.645
"""Standard deviations to either side that hold 90 % of a Gaussian."""
_DEGREES = 180.0 / np.pi
"""Degrees in a radian."""
_AXES = {
    'angle': (_DEGREES, 'angle [°]'),
    'direction': (1.0, 'direction, backward to forward'),
    'speed': (_DEGREES, 'speed [°/s]'),
    'load': (1.0, 'load torque [N m]'),
    'temperature': (1.0, 'temperature [°C]'),
    'time': (1.0, 'time [s]'),
}
_VALUES = {'d': (1e3, 'mm'), 'a': (1e3, 'mm')}


def curve_figure(curve: JointCurve, covariance: Array | None) -> Html:
    """
    Return a figure of a curve over what it runs over.

    Parameters
    ----------
    curve : JointCurve
    covariance : array, shape (K, K), optional
        Of its values; without it there is no band.

    """
    x = np.linspace(curve.knots[0], curve.knots[-1], _SAMPLES)
    weights = basis(curve.knots, x)
    # A constant goes with the frames and with the joint's zero; the shape is what was found.
    weights = weights - weights.mean(axis=1, keepdims=True)
    y = np.asarray(curve.values) @ weights
    band = np.zeros_like(y)
    if covariance is not None:
        band = _NINETY * np.sqrt(
            np.maximum(np.einsum('ki,kl,li->i', weights, covariance, weights), 0)
        )
    size, unit = _VALUES.get(curve.channel, (1e3, 'mrad'))
    across, label = _AXES[curve.over]
    what = 'zero' if curve.channel == 'q' else curve.channel
    title = f'{curve.joint}: {what} over {curve.over}'
    picture = _picture(x * across, y * size, band * size, label, unit)
    return tag('figure', tag('figcaption', title), picture)


def _picture(x: Array, y: Array, band: Array, label: str, unit: str) -> Html:
    low, high = float((y - band).min()), float((y + band).max())
    room = 0.05 * max(high - low, 1e-9)
    low, high = low - room, high + room
    first, last = float(x[0]), float(x[-1])

    def across(value: float) -> float:
        return _LEFT + (_WIDTH - _LEFT - _RIGHT) * (value - first) / max(last - first, 1e-12)

    def up(value: float) -> float:
        return _TOP + (_HEIGHT - _TOP - _BOTTOM) * (high - value) / (high - low)

    line = ' '.join(f'{across(a):.1f},{up(b):.1f}' for a, b in zip(x, y, strict=True))
    upper = [f'{across(a):.1f},{up(b):.1f}' for a, b in zip(x, y + band, strict=True)]
    lower = [f'{across(a):.1f},{up(b):.1f}' for a, b in zip(x, y - band, strict=True)]
    foot = _HEIGHT - _BOTTOM
    parts = [
        tag('polygon', points=' '.join(upper + lower[::-1]), class_='band'),
        tag('line', x1=_LEFT, x2=_WIDTH - _RIGHT, y1=f'{up(0.0):.1f}', y2=f'{up(0.0):.1f}'),
        tag('polyline', points=line, class_='curve'),
        _text(_LEFT, foot + 14.0, _short(float(x[0])), 'start'),
        _text(_WIDTH - _RIGHT, foot + 14.0, _short(float(x[-1])), 'end'),
        _text((_LEFT + _WIDTH - _RIGHT) / 2.0, foot + 29.0, label, 'middle'),
        _text(_LEFT - 5.0, _TOP + 9.0, _short(high - room), 'end'),
        _text(_LEFT - 5.0, foot, _short(low + room), 'end'),
        _text(_LEFT - 5.0, (foot + _TOP) / 2.0, unit, 'end'),
    ]
    told = f'curve from {_short(low + room)} to {_short(high - room)} {unit} over {label}'
    return tag(
        'svg', *parts, viewBox=f'0 0 {_WIDTH:.0f} {_HEIGHT:.0f}', role='img', aria_label=told
    )


def _text(x: float, y: float, text: str, anchor: str) -> Html:
    return tag('text', text, x=f'{x:.1f}', y=f'{y:.1f}', text_anchor=anchor)


def _short(value: float) -> str:
    return f'{value:.3g}'
