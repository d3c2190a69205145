# SPDX-FileCopyrightText: weld_twin contributors
# SPDX-License-Identifier: Apache-2.0
"""Lines over time, or over the length of a path, drawn in the colours of the page."""

from __future__ import annotations

from collections.abc import Mapping

import numpy as np

from weld_twin_core.arrays import Array

from .html import Html, tag
from .quantities import millimetres

_COLUMNS = 500
"""Columns a line is drawn in; samples denser than that become a band."""
_HEIGHT, _WIDTH = 100.0, 1000.0
"""Units of the drawing, which the page stretches to the room it has."""


def line_chart(
    title: str,
    label: str,
    x: Array,
    lines: Mapping[str, Array],
    ends: tuple[str, str],
    top: float,
    *,
    floor: float | None = None,
) -> Html:
    """
    Return a figure of lengths over something.

    Parameters
    ----------
    title, label : str
        Shown above, and read out instead of the picture.
    x : array, shape (N,)
    lines : mapping of name to array, shape (N,) [m]
        The name is a colour of the page: 'before' or 'after'.
    ends : tuple of two str
        What stands below the two ends of the axis.
    top : float [m]
        What the height of the chart stands for; what is larger is cut there.
    floor : float [m], optional
        Where a broken line is drawn.

    """
    parts = [_line(x, y, top, name) for name, y in lines.items()]
    if floor is not None:
        level = f'{_HEIGHT * (1.0 - min(floor / top, 1.0)):.2f}'
        parts.append(tag('line', x1='0', x2=f'{_WIDTH:.0f}', y1=level, y2=level, class_='floor'))
    picture = tag(
        'svg',
        *parts,
        viewBox=f'0 0 {_WIDTH:.0f} {_HEIGHT:.0f}',
        preserveAspectRatio='none',
        role='img',
        aria_label=label,
    )
    return tag(
        'figure',
        tag('figcaption', title),
        tag('div', tag('span', millimetres(top)), tag('span', '0'), class_='y'),
        picture,
        tag('div', tag('span', ends[0]), tag('span', ends[1]), class_='x'),
        class_='time',
    )


def _line(x: Array, y: Array, top: float, name: str) -> Html:
    """Return a line, or the band between least and most where samples are denser than pixels."""
    span = max(float(x[-1] - x[0]), 1e-12)
    across = _WIDTH * (x - x[0]) / span
    down = _HEIGHT * (1.0 - np.minimum(y / top, 1.0))
    if x.size <= 2 * _COLUMNS:
        return tag('path', d=_drawn(across, down), class_=name)
    bins = np.array_split(np.arange(x.size), _COLUMNS)
    middle = np.array([across[b].mean() for b in bins])
    low = np.array([down[b].min() for b in bins])
    high = np.array([down[b].max() for b in bins])
    outline = _drawn(np.append(middle, middle[::-1]), np.append(low, high[::-1]))
    return tag('path', d=f'{outline}Z', class_=f'{name} band')


def _drawn(x: Array, y: Array) -> str:
    return 'M' + 'L'.join(f'{a:.1f},{b:.2f}' for a, b in zip(x, y, strict=True))
