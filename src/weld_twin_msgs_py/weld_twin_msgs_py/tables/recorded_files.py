# Copyright 2026 weld_twin contributors
# SPDX-License-Identifier: Apache-2.0
"""
Recordings that are no text: C3D of motion capture, and traces of KUKA in the form of DIAdem.

A trace is a text, ``.dat``, that describes channels, and files beside it that hold their values.
"""

from __future__ import annotations

import re
import warnings
from collections.abc import Mapping, Sequence
from pathlib import Path

import numpy as np

from weld_twin_core.arrays import Array
from weld_twin_core.errors import DataError

from .formats import Read, one_of

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
    rows = [_placed((number - first) / rate, points[at]) for number, points in frames]
    header = ['time [s]', *(f'{axis} [{unit}]' for axis in 'xyz')]
    said = [f'read as C3D; measured is {labels[at]!r}']
    return Read(header, rows, list(range(1, len(rows) + 1)), said)


def _placed(time: float, point: Array) -> list[str]:
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
