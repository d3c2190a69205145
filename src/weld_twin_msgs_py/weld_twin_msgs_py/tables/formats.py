# Copyright 2026 weld_twin contributors
# SPDX-License-Identifier: Apache-2.0
"""
Logs of controllers and exports of instruments whose form is documented: each is a file in `forms/`.

A `Form` says how to recognise such a file, and what reads it. Where a line names the columns, a
`Format` is all that is needed. What it does not name is left out: a controller's own idea of the
pose is no measurement.
"""

from __future__ import annotations

import csv
import re
from collections.abc import Callable, Sequence
from dataclasses import dataclass
from enum import IntEnum
from functools import cache
from importlib import import_module
from pathlib import Path
from pkgutil import iter_modules
from typing import Any, NamedTuple

from weld_twin_core.errors import DataError

from ..files.csv_text import is_number

_HEAD = 40
"""Lines at the top by which a format is recognised and its header is found."""


@dataclass(frozen=True)
class Format:
    """One kind of file."""

    name: str  # for people
    mark: str  # pattern that the top of such a file matches, and no other
    header: str  # pattern of the line that names the columns
    names: tuple[tuple[str, str], ...]
    """Pattern of a joined name and what it is called; ``{unit}`` is the file's unit of length. A
    group ``what`` is the marker or body that a column belongs to."""
    delimiter: str = ','  # blank for any white space
    above: int = 0
    below: int = 0
    """Lines over the header that belong to it, and lines under it that are no rows."""
    unit: str = ''
    """Pattern with the unit of length as its group; empty where ``names`` say it."""
    rate: str = ''
    """Pattern with the frames per second as its group, where there is no column of times."""
    named_by: str = ''
    """Pattern with a list of names, three columns each, where there is no header."""
    gap: str = ''  # what stands for a coordinate that was not seen

    def tells(self, text: str) -> bool:
        """Return whether a text begins so."""
        top = '\n'.join(text.splitlines()[:_HEAD]) + '\n'
        return re.search(self.mark, top) is not None

    def read(self, path: Path, text: str, marker: str | None) -> Read:
        """Return the columns that mean something here; see `headed`."""
        return headed(self, text, marker)


class Read(NamedTuple):
    """Header, rows as text, the line in the file of each, and sentences."""

    header: list[str]
    rows: list[list[str]]
    lines: list[int]
    said: list[str]


class Rank(IntEnum):
    """How surely a form is recognised; those of a lower rank are asked first."""

    BYTES = 0
    """By its first bytes: it is no text."""
    MARK = 1
    """By a mark that no table has, whatever delimiter was asked for."""
    HEADER = 2
    """By a header that no other maker writes."""
    TARGETS = 3
    POINTS = 4
    """By what stands in its lines: lists of joints, and of points, which are the least certain."""


@dataclass(frozen=True)
class Form:
    """One kind of file that is no table like any other."""

    name: str  # for people, as docs/tables.md has it
    rank: Rank
    tells: Callable[[Any], bool]  # takes the text, or the bytes of a file that is no text
    read: Callable[[Path, Any, str | None], Read]
    """Takes path, text or bytes, and the marker that is meant."""


_FORMS: list[Form] = []


def form(known: Form | Format) -> None:
    """Make a form known; a file in `forms/` calls it once."""
    if isinstance(known, Format):
        known = Form(known.name, Rank.HEADER, known.tells, known.read)
    _FORMS.append(known)


@cache
def forms() -> tuple[Form, ...]:
    """Return the forms of all files in `forms/`, in the order in which they are asked."""
    folder = import_module(f'{__package__}.forms')
    for file in iter_modules(folder.__path__):
        import_module(f'{folder.__name__}.{file.name}')
    return tuple(sorted(_FORMS, key=lambda each: (each.rank, each.name)))


_UNITS = {'meters': 'm', 'millimeters': 'mm', 'centimeters': 'cm', 'm': 'm', 'mm': 'mm'}


def headed(known: Format, text: str, marker: str | None) -> Read:
    """Return the columns of a known format that mean something here, of one marker or body."""
    lines = text.splitlines()
    at = next((k for k, line in enumerate(lines) if re.search(known.header, line)), -1)
    if at < 0:
        raise DataError(
            f'it begins as the {known.name} writes it, and the names of columns are gone'
        )
    split = [_split(line, known) for line in lines]
    header = _names(known, lines, split, at)
    first = at + 1 + known.below
    if known.named_by and first < len(split) and split[first] and not is_number(split[first][0]):
        header, first = split[first], first + 1  # QTM writes names over the columns if asked to
    result, said = _meant(known, header, text, marker)
    rows, numbers = [], []
    for k in range(first, len(lines)):
        cells = split[k]
        if len(cells) >= len(header) and any(cells):
            rows.append(_seen([cells[i] for i, _ in result], known))
            numbers.append(k + 1)
    names = [name for _, name in result]
    if known.rate and not any(name.startswith('time') for name in names):
        match = re.search(known.rate, text, re.M)
        rate = float(match[1]) if match else 1.0
        rows = [[f'{k / rate:.9g}', *row] for k, row in enumerate(rows)]
        names = ['time [s]', *names]
    return Read(names, rows, numbers, said)


def _split(line: str, known: Format) -> list[str]:
    if known.delimiter == ' ':
        return line.split()
    sign = ';' if known.delimiter == ',' and ';' in line and ',' not in line else known.delimiter
    try:
        return [cell.strip() for cell in next(csv.reader([line], delimiter=sign), [])]
    except csv.Error:
        raise DataError(
            'a cell has no end; look for a quotation mark that is not closed'
        ) from None


def _names(known: Format, lines: Sequence[str], split: list[list[str]], at: int) -> list[str]:
    """Return the names of the columns, joined from all lines of the header."""
    if known.named_by:
        match = re.search(known.named_by, '\n'.join(lines[:_HEAD]), re.M)
        markers = [cell for cell in (match[1] if match else '').split('\t') if cell.strip()]
        return [f'{marker} {axis}' for marker in markers for axis in 'XYZ']
    count = len(split[at])
    over = [(row + [''] * count)[:count] for row in split[max(at - known.above, 0) : at]]
    if known.below:  # a name stands over the first of its columns
        over = [_filled(row) for row in over]
    own = list(split[at])
    return [
        ' '.join(row[k] for row in [*over, own] if row[k] and row[k] not in ('Type', 'Name', 'ID'))
        for k in range(count)
    ]


def _filled(row: list[str]) -> list[str]:
    """Return a row in which an empty cell says what the cell before it does."""
    out = list[str]()
    for cell in row:
        out.append(cell or (out[-1] if out else ''))
    return out


def _meant(
    known: Format, header: list[str], text: str, marker: str | None
) -> tuple[list[tuple[int, str]], list[str]]:
    """Return place and name of the columns that mean something, of one marker alone."""
    match = re.search(known.unit, text, re.M) if known.unit else None
    unit = _UNITS.get((match[1] if match else 'mm').lower(), 'mm')
    plain = list[tuple[int, str]]()
    owned = dict[str, list[tuple[int, str]]]()
    for k, name in enumerate(header):
        for pattern, called in known.names:
            result = re.search(pattern, name)
            if result is None:
                continue
            new = result.expand(called.replace('{unit}', unit))
            what = result.groupdict().get('what')
            (plain if what is None else owned.setdefault(what, [])).append((k, new))
            break
    said = [f'read as the {known.name} writes it']
    if not owned:
        return plain, said
    chosen = one_of(list(owned), marker)
    said.append(f'measured is {chosen!r}')
    return [*(p for p in plain if p[1] != 'frame'), *owned[chosen]], said


def one_of(names: list[str], marker: str | None) -> str:
    """Return the thing that is meant."""
    if marker in names:
        return str(marker)
    if marker is None and len(names) == 1:
        return names[0]
    asked = 'several things were tracked' if marker is None else f'there is no {marker!r}'
    raise DataError(f'{asked}; --marker takes one of {", ".join(names)}')


def _seen(cells: list[str], known: Format) -> list[str]:
    """Return a row with a place that was not seen left empty."""
    if known.gap and [is_number(c) and float(c) == 0.0 for c in cells[-3:]] == [True] * 3:
        return [*cells[:-3], '', '', '']
    return cells
