# Copyright 2026 weld_twin contributors
# SPDX-License-Identifier: Apache-2.0
"""
Charts that a page draws by itself: lines over something, with ticks, hover values, linked cursors.

uPlot draws them; it is embedded, see `uplot/README.md`. A page with charts passes ``charts=True`` to
`html.document`.
"""

from __future__ import annotations

import json
from collections.abc import Sequence
from math import isfinite
from typing import Any, NamedTuple

import numpy as np

from weld_twin_core.arrays import Array
from weld_twin_msgs_py.files.whole_files import plain as finite

from .html import Html, tag

POINTS = 1200
"""Points of a line at most: two for each pixel of a chart as wide as the page."""
_DIGITS = 5
"""Digits kept of a number: a tenth of a pixel in a chart of a thousand."""


class Line(NamedTuple):
    """One line of a chart."""

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
    """
    Return JSON in a page that no name in it can end the script element with.

    What is not finite is null: JSON has no other word for it.
    """
    text = json.dumps(finite(data), separators=(',', ':')).replace('<', '\\u003c')
    return tag('script', Html(text), type='application/json', id_=id_)


def plain(values: Array) -> list[float | None]:
    """Return numbers as short as a picture allows; None for what is not finite."""
    return [
        float(f'{v:.{_DIGITS}g}') if isfinite(v) else None for v in np.asarray(values).tolist()
    ]


def thinned(rows: Sequence[Array], most: int = POINTS) -> np.ndarray:
    """
    Return an index of at most so many samples, the largest of every row among them.

    ``rows`` (shape (N,)): what must keep its peaks; at least one.
    """
    count = rows[0].size
    if count <= most:
        return np.arange(count)
    bins = np.array_split(np.arange(count), max(most // len(rows), 1))
    kept = {int(b[np.argmax(row[b])]) for b in bins for row in rows}
    return np.array(sorted(kept | {0, count - 1}))
