# Copyright 2026 weld_twin contributors
# SPDX-License-Identifier: Apache-2.0
"""
Recordings that are no table with a header: C3D of motion capture, traces of KUKA, lists, positions.

A trace is a text, ``.dat``, in the form of DIAdem; it describes channels, and files beside it hold
their values. A list of points has names, then x, y, z, as SpatialAnalyzer and others write them. A
comparison has two points to a name, nominal and measured, and often what they differ by, which tells
the one from the other. Targets of joints in RAPID are a list, too.

Current positions of a FANUC controller, ``MD:CURPOS.DG``, stand one after the other in a file, which
the controller makes whenever it is fetched, by FTP or by its web page. Its joints are told to a
hundredth of a degree; where it takes its own tool to be is no measurement, and is left out.
"""

from __future__ import annotations

import re
import warnings
from collections.abc import Mapping, Sequence
from itertools import product
from pathlib import Path

import numpy as np

from weld_twin_core.arrays import Array
from weld_twin_core.errors import DataError

from ..files.csv_text import is_number
from .formats import Read, one_of

_LOOK = 40
"""Lines at the top in which a list is told."""
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
_JOINT_TARGET = re.compile(r'\[\s*\[([^\[\]]*)\]\s*,\s*\[([^\[\]]*)\]\s*\]')
_AXES = 6
"""Axes of an arm, and axes beside it, in a target of RAPID."""
_NO_AXIS = 1e8
"""9E9 stands for an external axis that is not there."""


def is_point_list(text: str) -> bool:
    """Return whether every line ends in numbers of points, with names before and no header."""
    rows = _rows(text, _LOOK)
    return bool(rows) and _layout(rows) is not None


def read_point_list(text: str, marker: str | None) -> Read:
    """
    Return the points of a list; of nominal and measured points the measured ones.

    Raises DataError: no point belongs to the group, or a line differs from the others.

    marker: the group of points that is meant.
    """
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


def is_joint_targets(text: str) -> bool:
    """Return whether a text holds targets of joints in RAPID, and is no program of moves."""
    lines = [line for line in text.splitlines() if line.strip()]
    result = sum(1 for line in lines if _joints(line))
    return result > 0 and ('jointtarget' in text.lower() or 2 * result >= len(lines))


def read_joint_targets(text: str) -> Read:
    """Return the targets of joints in the order in which they stand."""
    result = [
        (k, *axes) for k, line in enumerate(text.splitlines(), start=1) for axes in _joints(line)
    ]
    here = [k for k in range(_AXES) if all(abs(float(ext[k])) < _NO_AXIS for _, _, ext in result)]
    header = [f'rax_{k + 1} [deg]' for k in range(_AXES)] + [f'eax_{"abcdef"[k]}' for k in here]
    rows = [[*arm, *(ext[k] for k in here)] for _, arm, ext in result]
    said = ['read as targets of joints in RAPID, in the order of the file']
    return Read(header, rows, [k for k, _, _ in result], said)


def _joints(line: str) -> list[tuple[list[str], list[str]]]:
    """Return arm and external axes of every target in a line."""
    out = []
    for match in _JOINT_TARGET.finditer(line):
        arm, ext = ([cell.strip() for cell in part.split(',')] for part in match.groups())
        if len(arm) == len(ext) == _AXES and all(map(is_number, (*arm, *ext))):
            out.append((arm, ext))
    return out


_MARK = re.compile(r'^CURRENT JOINT POSITION', re.MULTILINE)
_GROUP = re.compile(r'^Group #:\s*(\d+)', re.MULTILINE)
_JOINT = re.compile(r'^Joint\s+(\d+):\s*(-?\d*\.?\d+)', re.MULTILINE)
_FIRST_LINES = 8000
"""Characters at the top in which such a file is told: a page of the controller has a heading."""
_ARM = '1'
"""Group of motion that is the arm; others are positioners and tables."""


def is_positions(text: str) -> bool:
    """Return whether a text holds current positions of a FANUC controller."""
    return bool(_MARK.search(text[:_FIRST_LINES]) and _JOINT.search(text[:_FIRST_LINES]))


def read_positions(path: Path, text: str) -> Read:
    """
    Return the joints of the arm, a row for each time that they were fetched.

    Raises DataError: a position lacks joints that another one has.
    """
    rows, lines = list[list[str]](), list[int]()
    starts = [result.start() for result in _MARK.finditer(text)]
    for start, end in zip(starts, [*starts[1:], len(text)], strict=True):
        groups = _GROUP.findall(text[:start])
        if groups and groups[-1] != _ARM:
            continue
        result = dict(_JOINT.findall(text[start:end]))
        rows.append([result[number] for number in sorted(result, key=int)])
        lines.append(text.count('\n', 0, start) + 1)
    if len({len(row) for row in rows}) != 1:
        raise DataError(
            f"'{path}' holds positions of {' and '.join(sorted({str(len(r)) for r in rows}))} "
            'joints; copy files of one arm into it'
        )
    said = ['read as current positions of FANUC (CURPOS.DG), joints to 0.01 deg']
    return Read([f'J{k} [deg]' for k in range(1, len(rows[0]) + 1)], rows, lines, said)


C3D_MARK = b'\x50'
"""The second byte of every C3D file."""
TRACE_MARK = 'DIAEXTENDED'
"""The first line of a trace."""
MOST = 50_000_000
"""Values of a channel: fourteen hours at 1 kHz; more is a digit too many."""
NAME, KIND, UNIT, FILE, STORED, TYPE = '200', '210', '202', '211', '213', '214'
COUNT, FIRST, BEGIN, STEP = '220', '221', '240', '241'
"""Entries of a channel in the header of DIAdem: number of values, place of the first one counted
from 1, and what is added to every value and multiplied with it (start and step of a time)."""


def read_c3d(path: Path, marker: str | None) -> Read:
    """
    Return time and place of one marker of a C3D file.

    Raises DataError: the library for it is missing, the file is damaged, or several markers were
    tracked.
    """
    try:
        import c3d
    except ImportError:
        raise DataError(
            f"'{path}' is C3D; install its reader with: pip install 'weld-twin[mocap]'"
        ) from None
    try:
        with path.open('rb') as file, warnings.catch_warnings():
            warnings.simplefilter('ignore')  # that a file has no force plates is no news here
            reader = c3d.Reader(file)
            labels = [str(label).strip() for label in reader.point_labels]
            unit = reader.get('POINT.UNITS').string_value.strip() or 'mm'
            rate, first = float(reader.point_rate), int(reader.first_frame)
            frames = [(number, points) for number, points, *_ in reader.read_frames()]
    except (AttributeError, AssertionError, ValueError, KeyError, EOFError) as error:
        raise DataError(f"'{path}' cannot be read as C3D: {error}") from None
    at = labels.index(one_of(labels, marker))
    rows = [_row((number - first) / rate, points[at]) for number, points in frames]
    header = ['time [s]', *(f'{axis} [{unit}]' for axis in 'xyz')]
    said = [f'read as C3D; measured is {labels[at]!r}']
    return Read(header, rows, list(range(1, len(rows) + 1)), said)


def _row(time: float, point: Array) -> list[str]:
    """Return a row; a residual below zero says that the marker was not seen."""
    seen = point[3] >= 0.0 and bool(np.isfinite(point[:3]).all())
    return [f'{time:.9g}', *(f'{v:.9g}' if seen else '' for v in point[:3])]


def read_trace(path: Path, text: str) -> Read:
    """
    Return the channels of a trace, those as long as its time.

    Raises DataError: a file of values is missing or holds another number of them, or is of another
    type.
    """
    result = [
        dict(re.findall(r'^\s*(\d{3}),\s*(.*?)\s*$', block, re.M))
        for block in re.findall(r'#BEGINCHANNELHEADER(.*?)#ENDCHANNELHEADER', text, re.S)
    ]
    names, columns = [], []
    for channel in result:
        unit = channel.get(UNIT, '')
        names.append(f'{channel.get(NAME, "?")} [{unit}]' if unit else channel.get(NAME, '?'))
        try:
            columns.append(_values(path, channel, result))
        except (ValueError, OverflowError):
            raise DataError(
                f"trace '{path}': channel {names[-1]!r} has an entry that is no number"
            ) from None
    if not columns:
        raise DataError(f"trace '{path}' describes no channel")
    count = len(columns[0])
    same = [k for k, column in enumerate(columns) if len(column) == count]
    rows = [[repr(float(columns[k][row])) for k in same] for row in range(count)]
    said = ['read as a trace of KUKA (header of DIAdem)']
    return Read([names[k] for k in same], rows, list(range(1, count + 1)), said)


def _values(path: Path, channel: Mapping[str, str], all_: Sequence[Mapping[str, str]]) -> Array:
    """Return the values of a channel, a time counted up or numbers from a file."""
    count = int(channel.get(COUNT, '0'))
    if not 0 <= count <= MOST:
        raise DataError(f"trace '{path}' says that a channel has {count} values")
    begin, step = float(channel.get(BEGIN, '0')), float(channel.get(STEP, '1'))
    if channel.get(KIND, '').startswith('IMPLI'):
        return np.asarray(begin + step * np.arange(count))
    if channel.get(TYPE) != 'REAL64':
        raise DataError(f"trace '{path}': values of type {channel.get(TYPE)} are not read")
    beside = path.with_name(Path(channel.get(FILE, '').replace('\\', '/')).name)
    if not beside.is_file():
        raise DataError(f"trace '{path}' needs '{beside}' beside it; copy all files of the trace")
    own = [c for c in all_ if c.get(FILE) == channel.get(FILE)]
    numbers = np.fromfile(beside, '<f8')
    if numbers.size != sum(int(c.get(COUNT, '0')) for c in own):
        raise DataError(f"'{beside}' does not hold the values that '{path}' describes")
    return np.asarray(begin + step * _picked(path, numbers, channel, own, count))


def _picked(
    path: Path,
    numbers: Array,
    channel: Mapping[str, str],
    own: Sequence[Mapping[str, str]],
    count: int,
) -> Array:
    """Return a channel's share of a file: in turn with the others, or one after the other."""
    first = int(channel.get(FIRST, '1')) - 1
    places = sorted(int(c.get(FIRST, '1')) for c in own)
    if places == list(range(1, len(own) + 1)):
        return numbers[first :: len(own)]
    if places == [1 + k * count for k in range(len(own))]:
        return numbers[first : first + count]
    raise DataError(f"trace '{path}' stores its channels in a way that is not known")


def is_c3d(data: bytes) -> bool:
    """Return whether the first bytes are those of a C3D file."""
    return len(data) > 512 and data[1:2] == C3D_MARK and b'\0' in data[:512]
