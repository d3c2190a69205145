# Copyright 2026 weld_twin contributors
# SPDX-License-Identifier: Apache-2.0
"""A log of the joints and a table of the instrument, brought together by time or row by row."""

from dataclasses import replace
from pathlib import Path

import numpy as np
from numpy.typing import NDArray

from weld_twin_core.arm.robot import Robot
from weld_twin_core.arrays import Array
from weld_twin_core.errors import DataError
from weld_twin_core.recording import JointMotion

from .build import BEYOND, LAST_STAMP, Table, own_epoch, table_and_units
from .cells import Cells, number, read_cells
from .header import joint_columns, time_columns, unit_of
from .joint_readings import JointColumns
from .unit_guess import later_rows, stamps
from .words import TableOptions

STREAM = 0.2
"""Median step of a log [s] below which it follows the motion, not stations."""
SINCE_1970 = 1e8
"""Stamps beyond this [s] are dates; two files with dates share a clock."""


def read_two_tables(
    joints: Path | str,
    measured: Path | str,
    robot: Robot,
    options: TableOptions | None = None,
    offset: float = 0.0,
) -> Table:
    """
    Read the joints from one file and what was measured from another.

    Parameters
    ----------
    joints, measured : Path or str
        A log of the controller, and an export of the instrument.
    offset : float [s]
        Added to the stamps of the instrument.

    Raises
    ------
    DataError
        A file cannot be read, or nothing says which rows belong together.

    """
    options = options or TableOptions()
    log = read_cells(joints, options.delimiter, options.decimal)
    seen = read_cells(measured, options.delimiter, options.decimal, options.marker)
    said = [f'{c.path.name}: {text}' for c in (log, seen) for text in c.said]
    names = joint_columns(log.header, robot, options)
    result = list[str]()
    stream = _later(_whole(log, names, result), options, result)
    points = _later(seen, options, result)
    times, own = _stamps(stream, options, result), _stamps(points, options, result)
    if times is None or own is None or not _stream(times):
        paired = _paired(log, seen, names, options, said)
        return table_and_units(paired, robot, replace(options, time_column=None), said)[0]
    said += result
    dated = bool(min(times[0], own[0]) > SINCE_1970)
    if dated and max(times[-1], own[-1]) >= LAST_STAMP:
        times, own, dated = times - times[0], own - times[0], False
        said.append(BEYOND)
    elif not dated:
        times, own = times - times[0], own - own[0]
        said.append(
            'both clocks are taken to begin with the first row of their file; --clock-offset '
            "shifts the instrument's"
        )
    # What was measured is read as one table first, to find out its units; both share a clock now.
    options = replace(options, time_column=None)
    both = _between(stream, points, names, times, own + offset)
    (one, notes), units = table_and_units(both, robot, options, said)
    q = JointColumns(robot, names, options, []).angles(stream, units)
    epoch = one.epoch_ns if dated else own_epoch(stream.path)
    motion = JointMotion(times - one.epoch_ns * 1e-9, q)
    return Table(replace(one, joints=motion, epoch_ns=epoch, notes=notes), notes)


def _paired(
    log: Cells, seen: Cells, names: tuple[str, ...], options: TableOptions, said: list[str]
) -> Cells:
    """Return one table of stations: by a name or number that both files have, else row by row."""
    how = 'rows of both files are paired in their order'
    if (named := _named_alike(log, seen, names)) is not None:
        column, one, other = named
        out = len(log.rows) - one.size, len(seen.rows) - other.size
        log, seen = log.taken(one), seen.taken(other)
        how = f'rows of both files are paired by {column!r}'
        if any(out):
            how += f'; {out[0]} of the joints and {out[1]} of the instrument have no partner'
    if len(log.rows) != len(seen.rows):
        raise DataError(
            f"'{log.path}' has {len(log.rows)} rows and '{seen.path}' {len(seen.rows)}, and "
            'nothing says which belong together; give both files stamps of a motion, or a row '
            'for each station'
        )
    own = _stamps(seen, options, said)
    said.append(how)
    return _joined(log, seen, names, log.stack(names), own)


def _named_alike(
    log: Cells, seen: Cells, joints: tuple[str, ...]
) -> tuple[str, NDArray[np.intp], NDArray[np.intp]] | None:
    """Return a column of both files that tells their rows apart, and the rows that it pairs."""
    headers = [name.casefold() for name in seen.header]
    values = {*joints, *time_columns(log.header)}
    for k, name in enumerate(log.header):
        if name in values or name.casefold() not in headers:
            continue
        at = headers.index(name.casefold())
        own, others = [row[k] for row in log.rows], {row[at]: i for i, row in enumerate(seen.rows)}
        both = [(i, others[text]) for i, text in enumerate(own) if text and text in others]
        single = len(set(own)) == len(own) and len(others) == len(seen.rows)
        if single and 2 * len(both) > min(len(own), len(others)):
            one, other = np.array(both, dtype=np.intp).T
            return name, one, other
    return None


def _between(log: Cells, seen: Cells, names: tuple[str, ...], times: Array, own: Array) -> Cells:
    """Return one table of what was measured in a motion, with the joints at its stamps [s]."""
    inside = np.flatnonzero((own >= times[0]) & (own <= times[-1]))
    if not inside.size:
        late = own[0] - times[0]
        raise DataError(
            f"no row of '{seen.path}' lies within the time of '{log.path}': it begins "
            f'{abs(late):.1f} s {"after" if late > 0.0 else "before"} it; where that is a zone of the '
            'time, --clock-offset takes it off (in seconds, added to the clock of the instrument)'
        )
    q = np.column_stack([np.interp(own[inside], times, column) for column in log.stack(names).T])
    return _joined(log, seen.taken(inside), names, q, own[inside])


def _pointed(text: str) -> str:
    """Return a number with a decimal comma, perhaps with thousands in groups, as one with a point."""
    try:
        return repr(number(text, ','))
    except ValueError:
        return text


def _joined(log: Cells, seen: Cells, names: tuple[str, ...], q: Array, t: Array | None) -> Cells:
    """Return one table of the joints of one file and all but times of the other."""
    remaining = [
        k for k, name in enumerate(seen.header) if name not in (*time_columns(seen.header), *names)
    ]
    rows = []
    for k, (joints, row) in enumerate(zip(q, seen.rows, strict=True)):
        stamp = [] if t is None else [repr(float(t[k]))]
        others = [_pointed(row[i]) if seen.decimal == ',' else row[i] for i in remaining]
        rows.append([*stamp, *(repr(float(v)) for v in joints), *others])
    header = [*([] if t is None else ['time [s]']), *names, *(seen.header[i] for i in remaining)]
    return Cells(log.path, header, rows, seen.lines, '.', [])


def _whole(log: Cells, names: tuple[str, ...], said: list[str]) -> Cells:
    """Return a log without rows in which a joint is missing."""
    gaps = ~np.isfinite(log.stack(names)).all(axis=1)
    return _kept(log, np.flatnonzero(~gaps), said, 'in which a joint is missing')


def _later(cells: Cells, options: TableOptions, said: list[str]) -> Cells:
    """Return a table without rows whose stamp is not later than those before."""
    result = later_rows(cells, *_clock(cells, options))
    if result is None:
        return cells
    return _kept(cells, result, said, 'whose stamp repeats one before')


def _kept(cells: Cells, keep: NDArray[np.intp], said: list[str], why: str) -> Cells:
    out = len(cells.rows) - keep.size
    if not out:
        return cells
    if not keep.size:
        raise DataError(f"table '{cells.path}' has no complete row")
    said.append(f'{cells.path.name}: {out} rows are left out {why}')
    return cells.taken(keep)


def _clock(cells: Cells, options: TableOptions) -> tuple[str | None, str | None]:
    if options.time_column in cells.header:
        return options.time_column, None
    date, clock = time_columns(cells.header)
    return clock, date


def _stream(times: Array) -> bool:
    return times.size > 2 and float(np.median(np.diff(times))) < STREAM


def _stamps(cells: Cells, options: TableOptions, said: list[str]) -> Array | None:
    """Return the stamps of a file, None where it has none that are good for anything."""
    clock, date = _clock(cells, options)
    t, sentence = stamps(cells, clock, None if clock is None else unit_of(clock), date)
    said.append(f'{cells.path.name}: {sentence}')
    return t
