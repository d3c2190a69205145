# SPDX-FileCopyrightText: weld_twin contributors
# SPDX-License-Identifier: Apache-2.0
"""Stamps of a table, where they are good for anything."""

from __future__ import annotations

from datetime import datetime, timezone

import numpy as np

from weld_twin_core.arrays import Array
from weld_twin_core.errors import DataError

from .cells import Cells

_SECONDS = {'s': 1.0, 'ms': 1e-3, 'us': 1e-6, 'ns': 1e-9}
"""Units a clock may count in."""
_LARGEST = (('s', 1e11), ('ms', 1e14), ('us', 1e17), ('ns', np.inf))
"""Beyond these, stamps since 1970 must be in the next finer unit."""


def stamps(cells: Cells, column: str | None, unit: str | None) -> tuple[Array | None, str]:
    """
    Return stamps of the rows, shape (rows,) [s], and a sentence; None when they are no use.

    Stamps that are missing, rounded until they repeat, or not increasing say nothing that the
    order of the rows does not.
    """
    order = 'rows are taken in their order, one station per second'
    if column is None:
        return None, f'the table has no stamps; {order}'
    values = _parsed(cells, column)
    if values is None:
        return None, f'stamps in {column!r} cannot be read; {order}'
    if np.isnan(values).any() or (values.size > 1 and np.diff(values).min() <= 0.0):
        return None, f'stamps in {column!r} do not increase from row to row; {order}'
    chosen = unit or next(name for name, top in _LARGEST if abs(values).max() < top)
    return values * _SECONDS[chosen], f'stamps in {column!r} are in {chosen}'


def _parsed(cells: Cells, column: str) -> Array | None:
    try:
        return cells.numbers(column)
    except DataError:
        pass
    try:
        times = [datetime.fromisoformat(text) for text in cells.column(column)]
    except ValueError:
        return None
    return np.array(
        [(t if t.tzinfo else t.replace(tzinfo=timezone.utc)).timestamp() for t in times]
    )
