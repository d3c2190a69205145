# Copyright 2026 weld_twin contributors
# SPDX-License-Identifier: Apache-2.0
"""Traces of KUKA: a text, ``.dat``, in the form of DIAdem, and files of values beside it."""

import re
from collections.abc import Mapping, Sequence
from pathlib import Path

import numpy as np

from weld_twin_core.arrays import Array
from weld_twin_core.errors import DataError

from ..formats import Form, Rank, Read, form

TRACE_MARK = 'DIAEXTENDED'
"""The first line of a trace."""
MOST = 50_000_000
"""Values of a channel: fourteen hours at 1 kHz; more is a digit too many."""
NAME, KIND, UNIT, FILE, STORED, TYPE = '200', '210', '202', '211', '213', '214'
COUNT, FIRST, BEGIN, STEP = '220', '221', '240', '241'
"""Entries of a channel in the header of DIAdem: number of values, place of the first one counted
from 1, and what is added to every value and multiplied with it (start and step of a time)."""


def read_trace(path: Path, text: str, marker: str | None) -> Read:
    """Return the channels of a trace, those as long as its time."""
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


form(Form('trace of KUKA', Rank.MARK, lambda text: str(text).startswith(TRACE_MARK), read_trace))
