# Copyright 2026 weld_twin contributors
# SPDX-License-Identifier: Apache-2.0
"""The cells of a delimited text file: delimiter, decimal sign, numbers."""

from __future__ import annotations

import csv
import re
from contextlib import suppress
from dataclasses import dataclass
from itertools import islice
from pathlib import Path

import numpy as np

from weld_twin_core.arrays import Array
from weld_twin_core.errors import DataError

from .current_positions import is_positions, read_positions
from .formats import Format, Read, read, recognised
from .recorded_files import TRACE_MARK, is_c3d, read_c3d, read_trace
from .words import UNITS

DELIMITERS = (';', '\t', ',')
_LOOK = 20
"""Lines from which the delimiter is read."""
_TITLE = 2
"""Cells that a line of a title or 'Date;22.11.2026' above the header may have; a row that lost cells
has more."""
_COMMENTS = ('//', '%', '!')
_SEP = re.compile(r'^"?sep=(.?|\\t)"?[;,]*$', re.IGNORECASE)
_EMPTY = {'', 'nan', 'na', 'n/a', 'null', 'none', '-'}
_NUMBER = re.compile(r'^[-+]?\d*[.,]?\d+(?:[eE][-+]?\d+)?$')
_COMMA_NUMBER = re.compile(r'^[-+]?\d+,\d+(?:[eE][-+]?\d+)?$')
_POINT_NUMBER = re.compile(r'^[-+]?\d*\.\d+(?:[eE][-+]?\d+)?$')


@dataclass(frozen=True)
class Cells:
    """
    The table as text.

    Attributes
    ----------
    path : Path
    header : list of str
    rows : list of list of str
    lines : list of int
        Line number of each row in the file.
    decimal : str
    said : list of str
        What was found out, one sentence each.

    """

    path: Path
    header: list[str]
    rows: list[list[str]]
    lines: list[int]
    decimal: str
    said: list[str]

    def column(self, name: str) -> list[str]:
        """
        Return a column as text.

        Raises
        ------
        DataError
            There is no such column; the message lists those there are.

        """
        if name not in self.header:
            raise DataError(
                f"table '{self.path}' has no column {name!r}; its columns are "
                + ', '.join(self.header)
            )
        k = self.header.index(name)
        return [row[k] for row in self.rows]

    def numbers(self, name: str) -> Array:
        """
        Return a column as numbers, shape (rows,); NaN where a cell is empty.

        Raises
        ------
        DataError
            A cell is no number; the message names line and column.

        """
        column = self.column(name)
        if self.decimal != ',':
            with suppress(ValueError):  # as all columns are that are plain numbers
                return np.array(list(map(float, column)))
        out = np.empty(len(self.rows))
        for k, text in enumerate(column):
            if text.lower() in _EMPTY:
                out[k] = np.nan
                continue
            try:
                out[k] = float(text.replace(',', '.') if self.decimal == ',' else text)
            except ValueError:
                raise DataError(
                    f"table '{self.path}' line {self.lines[k]}, column {name!r}: {text!r} is no "
                    f'number with decimal {self.decimal!r}; --decimal or --delimiter decides'
                ) from None
        return out

    def stack(self, names: tuple[str, ...]) -> Array:
        """Return columns side by side, shape (rows, len(names))."""
        return np.stack([self.numbers(name) for name in names], axis=1)


def read_cells(
    path: Path | str, delimiter: str | None, decimal: str | None, marker: str | None = None
) -> Cells:
    """
    Read a delimited text file with a header line, or a log or export in a form that is known.

    Parameters
    ----------
    path : Path or str
    delimiter, decimal : str, optional
        Left out, they are found.
    marker : str, optional
        What is meant, where an export holds several things that were tracked.

    Raises
    ------
    DataError
        No such file, no table, ragged rows, or a delimiter or decimal sign that is not clear.

    """
    path = Path(path)
    said: list[str] = []
    try:
        text = path.read_bytes()
    except OSError as error:
        raise DataError(f"table '{path}' cannot be read: {error.strerror or error}") from None
    if is_c3d(text):
        return _as_read(path, read_c3d(path, marker))
    decoded = _decoded(path, text)
    if decoded.startswith(TRACE_MARK):
        return _as_read(path, read_trace(path, decoded))
    if is_positions(decoded):
        return _as_read(path, read_positions(path, decoded))
    known = None if delimiter else recognised(decoded)
    if known is not None:
        return _of_known(path, known, decoded, marker)
    lines = _without_comments(decoded.splitlines())
    if sum(1 for line in lines if line.strip()) < 2:
        raise DataError(f"table '{path}' needs a header line and at least one row")
    if delimiter is None:
        delimiter = _excel(lines) or _delimiter(path, lines)
        said.append(f'columns are separated by {_spoken(delimiter)}')
    lines = _from_header(lines, delimiter, said)
    header, rows, numbers = _split(path, lines, delimiter)
    header, rows, numbers = _with_units(header, rows, numbers)
    if decimal is None:
        decimal = _decimal(path, rows, delimiter)
        if decimal == ',':
            said.append('the decimal sign is a comma')
    return Cells(path, header, rows, numbers, decimal, said)


def _of_known(path: Path, known: Format, text: str, marker: str | None) -> Cells:
    try:
        return _as_read(path, read(known, text, marker))
    except DataError as error:
        raise DataError(f"table '{path}': {error}") from None


def _as_read(path: Path, found: Read) -> Cells:
    header, rows, lines, said = found
    if not rows:
        raise DataError(f"table '{path}': there is a header and no row under it")
    comma = any(_COMMA_NUMBER.match(cell) for row in rows[:_LOOK] for cell in row)
    return Cells(path, header, rows, lines, ',' if comma else '.', said)


def _without_comments(lines: list[str]) -> list[str]:
    """Return the lines with those of a comment emptied; a header may begin with '#'."""
    first = next((k for k, line in enumerate(lines) if line.strip()), 0)
    out = ['' if line.lstrip().startswith(_COMMENTS) else line for line in lines]
    if not out[first:] or not out[first].lstrip().startswith('#'):
        return out
    after = [line for line in out[first + 1 :] if line.strip() and not line.startswith('#')]
    for sign in DELIMITERS:  # '# time,x,y' names the columns, '# made on Monday' does not
        if after and out[first].count(sign) == after[0].count(sign) > 0:
            out[first] = out[first].lstrip().lstrip('# ')
            return out
    return ['' if line.startswith('#') else line for line in out]


def _excel(lines: list[str]) -> str | None:
    """Return the delimiter of a first line ``sep=;`` as Excel writes it, and empty that line."""
    first = next((k for k, line in enumerate(lines) if line.strip()), 0)
    match = _SEP.match(lines[first].strip())
    if match is None:
        return None
    lines[first] = ''
    return '\t' if match[1] in ('\\t', '') else match[1]


def _from_header(lines: list[str], delimiter: str, said: list[str]) -> list[str]:
    """Return the lines with those before the header emptied: titles, dates, names of jobs."""
    filled = ((k, row) for k, row in enumerate(csv.reader(lines, delimiter=delimiter)) if row)
    rows = list(islice(filled, _LOOK))
    first = _header_at([len(row) for _, row in rows])
    if not first:
        return lines
    start = rows[first][0]
    passed = sum(1 for line in lines[:start] if line.strip())
    said.append(f'{passed} lines before the header are passed over')
    return ['' if k < start else line for k, line in enumerate(lines)]


def _header_at(counts: list[int]) -> int:
    """Return the first of the lines, by their numbers of cells, that is no title."""
    usual = max(counts, key=counts.count)
    start = next(k for k, count in enumerate(counts) if count == usual)
    return start if all(count <= min(_TITLE, usual - 1) for count in counts[:start]) else 0


def _with_units(
    header: list[str], rows: list[list[str]], numbers: list[int]
) -> tuple[list[str], list[list[str]], list[int]]:
    """Return the table with a row of units under the header taken into the header."""
    if not rows:
        return header, rows, numbers
    units = [cell.strip('[]() ') for cell in rows[0]]
    named = [unit for unit in units if unit not in ('', '-')]
    if not named or any(unit.lower() not in UNITS for unit in named):
        return header, rows, numbers
    joined = [
        f'{name} [{unit}]' if unit not in ('', '-') else name
        for name, unit in zip(header, units, strict=True)
    ]
    return joined, rows[1:], numbers[1:]


def _decoded(path: Path, data: bytes) -> str:
    if b'\0' in data[:4096]:
        raise DataError(f"table '{path}' is no text; save it as CSV (UTF-8) first")
    try:
        return data.decode('utf-8-sig')
    except UnicodeDecodeError:
        return data.decode('latin-1')  # a degree sign from a Windows instrument


def _spoken(delimiter: str) -> str:
    return 'tabs' if delimiter == '\t' else f'{delimiter!r}'


def _delimiter(path: Path, lines: list[str]) -> str:
    """Return the one delimiter that cuts the first lines into equally many cells."""
    head = list(islice((line for line in lines if line.strip()), _LOOK))
    even = {}
    for sign in DELIMITERS:
        counts = [len(row) for row in csv.reader(head, delimiter=sign)]
        start = _header_at(counts)
        if counts[start] > 1 and len(set(counts[start:])) == 1:
            even[sign] = start
    first = min(even.values(), default=0)
    signs = [sign for sign, start in even.items() if start == first] or DELIMITERS
    in_header = [sign for sign in signs if sign in head[first]]
    if len(in_header) != 1:
        raise DataError(
            f"table '{path}': no single delimiter (comma, semicolon or tab) cuts its lines "
            'evenly; --delimiter decides'
        )
    return in_header[0]


def _split(
    path: Path, lines: list[str], delimiter: str
) -> tuple[list[str], list[list[str]], list[int]]:
    header: list[str] = []
    rows: list[list[str]] = []
    numbers: list[int] = []
    for k, row in enumerate(csv.reader(lines, delimiter=delimiter), start=1):
        cells = [cell.strip() for cell in row]
        if not any(cells):
            continue
        if not header:
            header = cells
            continue
        if len(cells) != len(header):
            raise DataError(
                f"table '{path}' line {k} has {len(cells)} cells, the header has {len(header)}"
            )
        rows.append(cells)
        numbers.append(k)
    _check_header(path, header)
    return header, rows, numbers


def _check_header(path: Path, header: list[str]) -> None:
    twice = sorted({name for name in header if header.count(name) > 1 and name})
    if twice:
        raise DataError(f"table '{path}' has two columns called {twice[0]!r}; rename one")
    if all(_NUMBER.match(cell) for cell in header):
        raise DataError(
            f"table '{path}' has numbers in its first line; put a header line above that names "
            'the columns'
        )


def _decimal(path: Path, rows: list[list[str]], delimiter: str) -> str:
    if delimiter == ',':
        return '.'
    comma = any(_COMMA_NUMBER.match(cell) for row in rows for cell in row)
    point = any(_POINT_NUMBER.match(cell) for row in rows for cell in row)
    if comma and point:
        raise DataError(
            f"table '{path}' has numbers with a decimal comma and with a decimal point; "
            '--decimal decides'
        )
    return ',' if comma else '.'
