# Copyright 2026 weld_twin contributors
# SPDX-License-Identifier: Apache-2.0
"""
Charts that a page draws by itself: lines over something, and a cause as a small measured curve.

uPlot draws them, with ticks, hover values and linked cursors; it is embedded, see `uplot/README.md`. A
page with charts passes ``charts=True`` to `html.document`.
"""

import json
from collections.abc import Sequence
from math import isfinite
from typing import Any, NamedTuple

import numpy as np

from weld_twin_core.arm.robot import Robot
from weld_twin_core.arrays import Array
from weld_twin_core.diagnosis.result import Cause, Diagnosis
from weld_twin_core.effects.curves import FrameCurve, JointCurve, basis
from weld_twin_core.effects.effect import Effect
from weld_twin_core.effects.servo_lag import ServoLag
from weld_twin_msgs_py.files.whole_files import plain as finite
from weld_twin_nodes.wording.quantities import DEGREES, in_short, millimetres, short_rows, turned
from weld_twin_nodes.wording.words import CURVES, parameter_word

from .html import Html, tag

POINTS = 1200
"""Points of a line at most: two for each pixel of a chart as wide as the page."""
_DIGITS = 5
"""Digits kept of a number: a tenth of a pixel in a chart of a thousand."""


class Line(NamedTuple):
    name: str  # as the legend has it
    values: Array  # shape (N,), in the unit of the chart; what is not finite leaves a gap
    colour: str = 'after'
    """A colour of the page's style: 'before', 'after', 'soft', 'good', 'care', 'bad'."""
    dashed: bool = False
    points: bool = False  # dots in place of a line
    marked: bool = False  # dots on the line, where each value is one measurement


class Axis(NamedTuple):
    """What runs along an axis, and its unit, which may be empty."""

    label: str
    unit: str = ''


def chart(
    title: str,  # shown above; read out instead of the picture
    x: Array,  # shape (N,), ascending; seconds since 1970 where ``dates`` is set
    lines: Sequence[Line],
    axes: tuple[Axis, Axis],
    *,
    # Charts of one key have one cursor, and share it with whatever else listens on the page.
    key: str | None = None,
    # Shape (N,), least and most, shaded in the colour of the first line.
    band: tuple[Array, Array] | None = None,
    dates: bool = False,
    from_zero: bool = False,  # whether the axis starts at zero, as sizes do
    height: int = 180,  # of the drawing [px]
    # The chart runs over the position of this joint, so its cursor follows the instant looked at.
    joint: int | None = None,
) -> Html:
    """Return a figure of lines over something; a page's script draws it."""
    spec: dict[str, Any] = {
        'x': plain(x),
        'axes': [axis._asdict() for axis in axes],
        'lines': [{**line._asdict(), 'values': plain(line.values)} for line in lines],
        'band': None if band is None else [plain(side) for side in band],
        'key': key,
        'dates': dates,
        'zero': from_zero,
        'height': height,
        'joint': joint,
    }
    return tag(
        'figure.chart',
        tag('figcaption', title),
        tag('div.plot', role='img', aria_label=title, style=f'min-height:{height}px'),
        embedded(spec),
        data_key=key,
    )


def embedded(data: Any, id_: str | None = None) -> Html:
    """Return JSON in a page, what is not finite as null, that ends no script element."""
    text = json.dumps(finite(data), separators=(',', ':')).replace('<', '\\u003c')
    return tag('script', Html(text), type='application/json', id_=id_)


def plain(values: Array) -> list[float | None]:
    """Return numbers as short as a picture allows; None for what is not finite."""
    return [
        float(f'{v:.{_DIGITS}g}') if isfinite(v) else None for v in np.asarray(values).tolist()
    ]


def thinned(rows: Sequence[Array], most: int = POINTS) -> np.ndarray:
    """Return an index of at most so many samples, the largest of every row (N,) among them."""
    count = rows[0].size
    if count <= most:
        return np.arange(count)
    bins = np.array_split(np.arange(count), max(most // len(rows), 1))
    kept = {int(b[np.argmax(row[b])]) for b in bins for row in rows}
    return np.array(sorted(kept | {0, count - 1}))


_SAMPLES = 60
"""Points of a drawn curve: one for every four units of its width."""
_FLAT = 0.05
"""Part of a curve's size within which it is reported as the same everywhere."""
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


def curve_figure(diagnosis: Diagnosis, m: int, curve: JointCurve) -> Html:
    """Return a figure of a curve, with a band of one of the effects found, over what it runs over."""
    covariance = _spread(diagnosis, m)
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
        joint=diagnosis.model.robot.index(curve.joint) if curve.over == 'angle' else None,
    )


def _spread(diagnosis: Diagnosis, m: int) -> Array | None:
    """Return the covariance of the coordinates of a found effect, None where it is not known."""
    effect, posterior = diagnosis.model.found[m], diagnosis.posterior
    if posterior is None:
        return None
    what = posterior.directions
    starts = what.frame_count + np.concatenate([[0], np.cumsum(what.sizes)]).astype(int)
    for k, other in enumerate(what.effects):
        if (other.name, other.site, other.key) == (effect.name, effect.site, effect.key):
            rows = slice(starts[k], starts[k + 1])
            return np.asarray(posterior.covariance[rows, rows])
    return None


def furthest_off(diagnosis: Diagnosis, cause: Cause) -> tuple[int, JointCurve] | None:
    """Return which curve is furthest off of those that stand for a cause; a constant only alone."""
    result = diagnosis.model.found
    curves = {
        m: effect
        for m in cause.members
        if m < len(result) and isinstance(effect := result[m], JointCurve)
    }
    if not curves:
        return None

    def rank(item: tuple[int, JointCurve]) -> tuple[bool, float]:
        return item[1].over != 'constant', float(np.abs(item[1].values).max())

    return max(curves.items(), key=rank)


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


_SHARES = ('scale', 'ratio', 'difference')
"""Parameters of joints that are a share of an angle."""
_QUARTER = 90.0
"""Degrees for which such a share is given."""


def values(diagnosis: Diagnosis, cause: Cause, effects: Sequence[Effect]) -> list[str]:
    """Return how far off the effects of a cause are, the most telling first."""
    errors = {(f.effect.name, f.effect.site): f.std for f in diagnosis.effects}
    curve, rows = furthest_off(diagnosis, cause), []
    if curve is not None:
        rows.append(f'off by {furthest(curve[1])}')
    for effect in effects:
        if isinstance(effect, FrameCurve):
            rows.append(f'moves by {furthest_frame(effect)}')
        if effect.name in CURVES:
            continue
        if isinstance(effect, ServoLag):
            rows.append(_trail(diagnosis, effect))
        rows += _in_a_quarter(effect, diagnosis.model.robot)
        for name, value in short_rows(
            effect, errors.get((effect.name, effect.site), {}), diagnosis.model.robot
        ):
            rows.append(f'{parameter_word(name)} {value}')
    return rows


def _in_a_quarter(effect: Effect, robot: Robot) -> list[str]:
    """Return what an error that grows with the angle makes of a quarter turn, or of a metre."""
    share = next((getattr(effect, n) for n in _SHARES if hasattr(effect, n)), None)
    if share is None or effect.of != 'joint':
        return []
    if effect.on_slide(robot):
        return [f'off by {in_short(1e3 * float(share), None, 1.0, "mm")} in every metre']
    return [f'off by {in_short(_QUARTER * float(share), None, 1.0, "°")} in every 90°']


def _trail(diagnosis: Diagnosis, lag: ServoLag) -> str:
    """Return how far a joint trails its command where the recordings move it fastest."""
    robot = diagnosis.model.robot
    i = robot.index(lag.joint)
    speeds = [np.abs(r.joints.velocity[:, i]).max() for r in diagnosis.recordings]
    fastest = float(max(speeds, default=0.0))
    trail = fastest * float(lag.time_constant)
    if robot.prismatic[i]:
        return (
            f'{lag.joint} trails by {millimetres(trail)} at its fastest ({1e3 * fastest:.0f} mm/s)'
        )
    return f'{lag.joint} trails by {turned(trail)} at its fastest ({DEGREES * fastest:.0f} °/s)'
