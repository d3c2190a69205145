# Copyright 2026 weld_twin contributors
# SPDX-License-Identifier: Apache-2.0
"""Stamps of a table, where they are good for anything."""

from __future__ import annotations

from collections.abc import Callable
from datetime import datetime, timezone
from functools import partial

import numpy as np
from numpy.typing import NDArray

from weld_twin_core.arrays import Array
from weld_twin_core.errors import DataError

from .cells import Cells
from .unit_guess import factor

_SECONDS = {'s': 1.0, 'ms': 1e-3, 'us': 1e-6, 'ns': 1e-9, 'min': 60.0, 'h': 3600.0}
"""Units a clock may count in."""
_LARGEST = (('s', 1e11), ('ms', 1e14), ('us', 1e17), ('ns', np.inf))
"""Beyond these, stamps since 1970 must be in the next finer unit."""


_MOSTLY = 0.9
"""Share of the rows that are in order at least, for the others to be repeats and no other order."""
_DATES = ('%d.%m.%Y', '%Y/%m/%d', '%d-%b-%Y', '%Y-%m-%d', '%m/%d/%Y', '%d/%m/%Y', '')
"""Dates as instruments and spreadsheets write them, American before British; or none."""
_CLOCKS = ('%H:%M:%S.%f', '%H:%M:%S', '%H:%M', '%I:%M:%S.%f %p', '%I:%M:%S %p', '%I.%M.%S.%f %p')


def stamps(
    cells: Cells, column: str | None, unit: str | None, date: str | None = None
) -> tuple[Array | None, str]:
    """
    Return stamps of the rows, shape (rows,) [s], and a sentence; None when they are no use.

    ``date`` is the column of the day, where the time of day has a column of its own. Stamps that
    are missing, rounded until they repeat, or not increasing say nothing that the order of the
    rows does not.
    """
    order = 'rows are taken in their order, one station per second'
    if column is None:
        return None, f'the table has no stamps; {order}'
    values = _parsed(cells, column, date)
    if values is None:
        return None, f'stamps in {column!r} cannot be read; {order}'
    if np.isnan(values).any() or (values.size > 1 and np.diff(values).min() <= 0.0):
        return None, f'stamps in {column!r} do not increase from row to row; {order}'
    chosen = unit or next(name for name, top in _LARGEST if abs(values).max() < top)
    scale = factor(_SECONDS, chosen, column, 'the time')
    return values * scale, f'stamps in {column!r} are in {chosen}'


def later_rows(
    cells: Cells, column: str | None, date: str | None = None
) -> NDArray[np.intp] | None:
    """
    Return the rows whose stamp is later than all before; None where the stamps are no use.

    A stream whose stamps are rounded repeats some of them, and says no less for it.
    """
    values = None if column is None else _parsed(cells, column, date)
    if values is None or np.isnan(values).any():
        return None
    before = np.concatenate([[-np.inf], np.maximum.accumulate(values)[:-1]])
    later = np.flatnonzero(values > before)
    return later if later.size >= _MOSTLY * values.size else None


def _parsed(cells: Cells, column: str, date: str | None) -> Array | None:
    if date is None:
        try:
            return cells.numbers(column)
        except DataError:
            pass
    texts = cells.column(column)
    if date is not None:
        texts = [f'{day} {clock}' for day, clock in zip(cells.column(date), texts, strict=True)]
    read = _reader(texts)
    if read is None:
        return None
    times = [read(text) for text in texts]
    zoned = [t if t.tzinfo else t.replace(tzinfo=timezone.utc) for t in times]
    return np.array([t.timestamp() for t in zoned])


def _reader(texts: list[str]) -> Callable[[str], datetime] | None:
    """Return what reads every one of the texts as a date with a time, or a time alone."""
    formats = [f'{day} {clock}'.strip() for day in _DATES for clock in _CLOCKS]
    readers: list[Callable[[str], datetime]] = [datetime.fromisoformat]
    readers += [partial(_by_format, form=form) for form in formats]
    for read in readers:
        try:
            for text in texts:
                read(text)
        except ValueError:
            continue
        return read
    return None


def _by_format(text: str, form: str) -> datetime:
    # A comma before the fraction of a second, as German spreadsheets have it.
    result = datetime.strptime(text.replace(',', '.').strip(), form)
    return result if '%Y' in form else result.replace(year=2000)
