# Copyright 2026 weld_twin contributors
# SPDX-License-Identifier: Apache-2.0
"""
Lists of points: names, then x, y, z, as SpatialAnalyzer and others write them, and no header.

A comparison has two points to a name, and often what they differ by, which tells them apart.
"""

from itertools import product
from pathlib import Path

import numpy as np

from weld_twin_core.arrays import Array
from weld_twin_core.errors import DataError

from ...files.csv_text import is_number
from ..formats import Form, Rank, Read, form

_LOOK = 40
"""Lines at the top by which a list is recognised."""
_NAMES = (1, 2, 3)
"""Names before the numbers: collection, group, point."""
_POINT = 3
"""Numbers of a point."""
_PAIR = 6
"""Numbers of a nominal and a measured point."""
_WITH_DIFFERENCE = (9, 10)
"""Numbers of both with what they differ by, and with its size."""
_ROUNDED = 2e-3
"""Points and their difference are rounded; in millimetres, to a micrometre and coarser."""


def is_point_list(text: str) -> bool:
    """Return whether every line ends in numbers of points, with names before and no header."""
    rows = _rows(text, _LOOK)
    return bool(rows) and _layout(rows) is not None


def read_point_list(path: Path, text: str, marker: str | None) -> Read:
    """Return the points of a list; of nominal and measured points the measured ones."""
    rows = _rows(text)
    layout = _layout(rows[:_LOOK])
    assert layout is not None
    names, first, sentence = layout
    count = len(rows[0][1])
    kept = []
    for line, cells in rows:
        if len(cells) != count:
            raise DataError(
                f'line {line} of the list of points has {len(cells)} cells, not {count}'
            )
        if marker is None or marker in cells[:names]:
            start = names + first
            kept.append((line, [' '.join(cells[:names]), *cells[start : start + _POINT]]))
    if not kept:
        raise DataError(f'no point belongs to {marker!r}; --marker names a group')
    said = ['read as a list of points (SpatialAnalyzer and others)', *sentence]
    return Read(['point', 'x', 'y', 'z'], [row for _, row in kept], [k for k, _ in kept], said)


def _rows(text: str, most: int | None = None) -> list[tuple[int, list[str]]]:
    """Return number and cells of the lines that are no remarks."""
    lines = [
        (k, line)
        for k, line in enumerate(text.splitlines()[:most], start=1)
        if line.strip() and not line.lstrip().startswith('//')
    ]
    comma = bool(lines) and ',' in lines[0][1]
    return [
        (k, [cell.strip() for cell in line.split(',')] if comma else line.split())
        for k, line in lines
    ]


def _layout(rows: list[tuple[int, list[str]]]) -> tuple[int, int, list[str]] | None:
    """Return how many names there are, at which number the point begins, and what to say."""
    cells = [row for _, row in rows]
    width = len(cells[0])
    if any(len(row) != width or is_number(row[0]) for row in cells):
        return None
    for names, count in product(_NAMES, (_POINT, _PAIR, *_WITH_DIFFERENCE)):
        if names + count != width or not all(is_number(c) for row in cells for c in row[names:]):
            continue
        values = np.array([[float(c) for c in row[names:]] for row in cells])
        result = _measured(values)
        if result is not None:
            return names, *result
    return None


def _measured(values: Array) -> tuple[int, list[str]] | None:
    """Return where in a row the measured point begins, and what to say of it."""
    count = values.shape[1]
    if count == _POINT:
        return 0, []
    if count == _PAIR:
        return _POINT, [
            'the first three numbers of a line are taken as nominal, the last three as measured'
        ]
    one, other, off = values[:, :3], values[:, 3:6], values[:, 6:9]
    room = _ROUNDED * max(1.0, float(np.abs(off).max()))
    for start, difference in ((_POINT, other - one), (0, one - other)):
        if np.abs(difference - off).max() <= room:
            return start, ['of nominal and measured points the measured ones are taken']
    return None


form(Form('list of points', Rank.POINTS, is_point_list, read_point_list))
