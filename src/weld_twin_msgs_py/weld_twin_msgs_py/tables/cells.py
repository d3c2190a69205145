# Copyright 2026 weld_twin contributors
# SPDX-License-Identifier: Apache-2.0
"""Delimited text as header, rows and cells: delimiter, decimal sign, numbers as people write them."""

from __future__ import annotations

import csv
import re
from collections import Counter
from collections.abc import Iterable, Iterator, Mapping, Sequence
from contextlib import suppress
from dataclasses import dataclass, replace
from itertools import islice
from pathlib import Path
from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray

from weld_twin_core.arrays import Array
from weld_twin_core.errors import DataError

from ..files.csv_text import unguarded
from .formats import Rank, Read, forms
from .words import UNITS, bracketed, parted, shortened, unit_word

EMPTY = {'', 'nan', 'na', 'n/a', 'null', 'none', '-', '--', '#n/a', '#nv', '#na'}
"""What stands in a cell without a number."""
NUMBER = re.compile(r'^[-+\u2212]?(?:\d+[.,]?|[.,](?=\d))[\d.,]*(?:[eE][-+]?\d+)?$')
COMMA = re.compile(r'^[-+\u2212]?\d*,\d+(?:[eE][-+]?\d+)?$')
POINT = re.compile(r'^[-+\u2212]?\d*\.\d+(?:[eE][-+]?\d+)?$')
_GROUPED = {
    ',': re.compile(r'^[-+\u2212]?\d{1,3}(?:\.\d{3})+(?:,\d+)?$'),
    '.': re.compile(r'^[-+\u2212]?\d{1,3}(?:,\d{3})+(?:\.\d+)?$'),
}
"""Thousands in groups, by the decimal sign that goes with it."""
_GAP = re.compile(r"(?<=\d)[ \u00a0\u2009\u202f'\u2019](?=\d{3})")
"""What else may part the thousands."""
_WITH_UNIT = re.compile(r'^([-+\u2212]?[\d.,]*\d(?:[eE][-+]?\d+)?)\s*([^\d\s.,+-][^\d]*)$')


def number(text: str, decimal: str) -> float:
    """Return a cell as a number."""
    plain = _GAP.sub('', text).replace('\N{MINUS SIGN}', '-')
    if _GROUPED[decimal].match(plain):
        plain = plain.replace('.' if decimal == ',' else ',', '')
    if decimal == ',':
        if POINT.match(plain):
            raise ValueError(text)
        plain = plain.replace(',', '.')
    return float(plain)


def decimal_sign(path: Path, rows: Iterable[list[str]], delimiter: str | None) -> str:
    """Return the decimal sign of the numbers in rows; a comma that delimits cells is none."""
    if delimiter == ',':
        return '.'
    plain, either, grouped = set[str](), set[str](), set[str]()
    for cell in (cell for row in rows for cell in row if ',' in cell or '.' in cell):
        for sign, pattern, other in ((',', COMMA, '.'), ('.', POINT, ',')):
            if pattern.match(cell):
                # '1.234' may be a thousand and more where the decimal sign is a comma.
                (either if _GROUPED[other].match(cell) else plain).add(sign)
            elif sign in cell and _GROUPED[sign].match(cell):
                grouped.add(sign)
    if len(grouped) == 1 and plain <= grouped:
        return grouped.pop()
    signs = plain | either | grouped
    if len(signs) > 1:
        raise DataError(
            f"table '{path}' has numbers with a decimal comma and with a decimal point; "
            '--decimal decides'
        )
    return signs.pop() if signs else '.'


def without_units(
    path: Path, header: list[str], rows: list[list[str]], unit_of_name: dict[str, str | None]
) -> tuple[list[str], list[list[str]]]:
    """Return a table with units behind every number of a column taken into its header."""
    first = rows[0] if rows else []
    marked = [k for k, cell in enumerate(first) if _WITH_UNIT.match(cell)]
    for k in marked:
        parts = [_WITH_UNIT.match(row[k]) for row in rows if row[k].lower() not in EMPTY]
        units = {UNITS.get(unit_word(part[2])) if part else None for part in parts}
        unit = next(iter(units)) if len(units) == 1 else None
        if unit is None:
            continue
        given = unit_of_name.get(header[k])
        if given not in (None, unit):
            raise DataError(
                f"table '{path}': column {header[k]!r} has {unit} in its cells; make both alike"
            )
        header = [*header[:k], header[k] if given else f'{header[k]} [{unit}]', *header[k + 1 :]]
        for row in rows:
            part = _WITH_UNIT.match(row[k])
            row[k] = part[1] if part else row[k]
    return header, rows


DELIMITERS = (';', '\t', ',')
LOOK = 20
"""Lines from which the delimiter is read."""
_TITLE = 2
"""Cells that a line of a title or 'Date;22.11.2026' above the header may have; a row that lost cells
has more."""
_COMMENTS = ('//', '%', '!')
_SEP = re.compile(r'^"?sep=(.?|\\t)"?[;,]*$', re.IGNORECASE)


class Lines(NamedTuple):
    """Header, rows as text, and the line in the file of each row."""

    header: list[str]
    rows: list[list[str]]
    numbers: list[int]


def split_lines(path: Path, text: str, delimiter: str | None, said: list[str]) -> Lines:
    """Return the header and the rows of a text, and say in ``said`` how they were found."""
    lines = _without_comments(re.split(r'\r\n|\r|\n', text))
    if sum(1 for line in lines if line.strip()) < 2:
        raise DataError(f"table '{path}' needs a header line and at least one row")
    if delimiter is None:
        delimiter = _excel(lines)
        if delimiter is None:
            lines, delimiter, spoken = _delimited(path, lines)
        else:
            spoken = _spoken(delimiter)
        said.append(f'columns are separated by {spoken}')
    return _whole(path, list(_read(path, lines, delimiter)), said)


class _Row(NamedTuple):
    """Cells of a row, and its first and last line in the file."""

    cells: list[str]
    first: int
    last: int

    @property
    def width(self) -> int:
        """Return how many cells there are to the last that is not empty."""
        return max((k + 1 for k, cell in enumerate(self.cells) if cell), default=0)


def _read(path: Path, lines: Sequence[str], delimiter: str) -> Iterator[_Row]:
    reader = csv.reader(lines, delimiter=delimiter)
    first = 1
    endless = (
        "table '{}' line {}: a cell has no end; look for a quotation mark that is not closed, or "
        'for another delimiter (--delimiter)'
    )
    try:
        for row in reader:
            last = reader.line_num
            if last > first and ''.join(lines[first - 1 : last]).count('"') % 2:
                raise DataError(endless.format(path, first))
            cells = [unguarded(' '.join(cell.split())) for cell in row]
            if any(cells):
                yield _Row(cells, first, last)
            first = last + 1
    except csv.Error:
        raise DataError(endless.format(path, first)) from None


def _whole(path: Path, rows: list[_Row], said: list[str]) -> Lines:
    """Return the table without what stands over its header."""
    if not rows:
        raise DataError(f"table '{path}' needs a header line and at least one row")
    start = _header_at([row.width for row in rows[:LOOK]])
    if start:
        passed = sum(row.last - row.first + 1 for row in rows[:start])
        said.append(f'{passed} lines before the header are passed over')
    header, rows = rows[start].cells, rows[start + 1 :]
    while rows and _names_columns(header, rows[0].cells):
        header, rows = _joined(header, rows[0].cells), rows[1:]
    if all(NUMBER.match(cell) for cell in header if cell):
        raise DataError(
            f"table '{path}' has numbers in its first line; put a header line above that names "
            'the columns, such as J1,J2,J3,J4,J5,J6,x,y,z'
        )
    counts = Counter(header)
    twice = sorted(name for name, count in counts.items() if count > 1 and name)
    if twice:
        raise DataError(f"table '{path}' has two columns called {twice[0]!r}; rename one")
    for row in rows:
        surplus = row.cells[len(header) :]
        if any(surplus) or any(header[len(row.cells) :]):
            raise DataError(
                f"table '{path}' line {row.first} has {len(row.cells)} cells, the header has "
                f'{len(header)}'
            )
    # A column that nobody named and nobody filled is a delimiter too many at the end of lines.
    width = max((k + 1 for k, name in enumerate(header) if name), default=0)
    count = max([width, *(row.width for row in rows)])
    whole = [(row.cells + [''] * count)[:count] for row in rows]
    return Lines((header + [''] * count)[:count], whole, [row.first for row in rows])


def _header_at(widths: list[int]) -> int:
    """Return the first of the lines, by their numbers of cells, that is no title."""
    usual = max(widths, key=widths.count)
    start = next(k for k, width in enumerate(widths) if width == usual)
    return start if all(width <= min(_TITLE, usual - 1) for width in widths[:start]) else 0


def _names_columns(header: Sequence[str], below: Sequence[str]) -> bool:
    """Return whether the line under a header belongs to it: units, or names under groups."""
    if any(NUMBER.match(cell) for cell in below):
        return False
    units = [cell for cell in below if cell not in ('', '-')]
    if units and all(unit_word(unit) in UNITS for unit in units):
        return True
    names = list(header) + [''] * (len(below) - len(header))
    return len(units) > 1 and ('' in names or len(set(names)) < len(names))


def _joined(header: Sequence[str], below: Sequence[str]) -> list[str]:
    """Return names of columns from two lines; a name may stand over the first of its columns."""
    count = max(len(header), len(below))
    over, under = ([*line, *[''] * (count - len(line))] for line in (header, below))
    out = list[str]()
    group = ''
    for name, own in zip(over, under, strict=True):
        group = name or group
        if own in ('', '-'):
            out.append(name)
        elif unit_word(own) in UNITS and not bracketed(name):
            out.append(f'{name} [{unit_word(own)}]')
        elif bracketed(group) and parted(own)[1] is None:
            words, unit = bracketed(group) or ('', '')
            out.append(f'{words} {own} [{unit}]')
        else:
            out.append(f'{group} {own}'.strip())
    return out


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


def _spoken(delimiter: str) -> str:
    return 'tabs' if delimiter == '\t' else f'{delimiter!r}'


def _delimited(path: Path, lines: list[str]) -> tuple[list[str], str, str]:
    """Return the lines, the one delimiter that cuts the first of them evenly, and its name."""
    head = list(islice((line for line in lines if line.strip()), LOOK))
    even = {}
    for sign in DELIMITERS:
        counts = _counts(head, sign)
        start = _header_at(counts) if counts else 0
        if counts and counts[start] > 1 and len(set(counts[start:])) == 1:
            even[sign] = start
    first = min(even.values(), default=0)
    signs = [sign for sign, start in even.items() if start == first]
    in_header = signs[:1]
    if len(signs) != 1:
        in_header = [sign for sign in signs or DELIMITERS if sign in head[first]]
    if len(in_header) == 1:
        return lines, in_header[0], _spoken(in_header[0])
    blanks = {len(line.split()) for line in head}
    if not in_header and len(blanks) == 1 and blanks.pop() > _TITLE:
        return ['\t'.join(line.split()) for line in lines], '\t', 'blanks'
    raise DataError(
        f"table '{path}': no single delimiter (comma, semicolon or tab) cuts its lines "
        'evenly; --delimiter decides'
    )


def _counts(head: list[str], sign: str) -> list[int]:
    """Return how many cells a delimiter makes of each line; none where a cell has no end."""
    try:
        return [len(row) for row in csv.reader(head, delimiter=sign)]
    except csv.Error:
        return []


@dataclass(frozen=True)
class Cells:
    """The table as text."""

    path: Path
    header: list[str]
    rows: list[list[str]]
    lines: list[int]  # line number of each row in the file
    decimal: str
    said: list[str]  # what was found out, one sentence each

    def column(self, name: str) -> list[str]:
        """Return a column as text."""
        if name not in self.header:
            raise DataError(
                f"table '{self.path}' has no column {name!r}; its columns are "
                + shortened(self.header)
            )
        k = self.header.index(name)
        return [row[k] for row in self.rows]

    def numbers(self, name: str) -> Array:
        """Return a column as numbers, shape (rows,); NaN where a cell is empty."""
        column = self.column(name)
        if self.decimal != ',':
            with suppress(ValueError):  # as all columns are that are plain numbers
                return np.array(list(map(float, column)))
        out = np.empty(len(self.rows))
        for k, text in enumerate(column):
            if text.lower() in EMPTY:
                out[k] = np.nan
                continue
            try:
                out[k] = number(text, self.decimal)
            except ValueError:
                raise DataError(
                    f"table '{self.path}' line {self.lines[k]}, column {name!r}: {text!r} is no "
                    f'number with decimal {self.decimal!r}; --decimal or --delimiter decides'
                ) from None
        return out

    def stack(self, names: tuple[str, ...]) -> Array:
        """Return columns side by side, shape (rows, len(names))."""
        return np.stack([self.numbers(name) for name in names], axis=1)

    def taken(self, rows: Iterable[int]) -> Cells:
        """Return the table with some of its rows, counted from 0."""
        kept = [int(k) for k in rows]
        return replace(
            self, rows=[self.rows[k] for k in kept], lines=[self.lines[k] for k in kept]
        )

    def by_words(self, words: Mapping[str, set[str]], but: Sequence[str] = ()) -> dict[str, str]:
        """Return the columns by use, by the first word of their names; a unit is no part of it."""
        out: dict[str, str] = {}
        for name in self.header:
            first = re.split(r'[^0-9a-zäöüß]+', name.lower())[0]
            for use, known in words.items():
                if first in known and name not in but:
                    out.setdefault(use, name)
        return out

    def alike(self, names: Sequence[str]) -> tuple[NDArray[np.intp], list[int]]:
        """Return the group of every row, those alike in some columns, and the first row of each."""
        keys = list(zip(*(self.column(name) for name in names), strict=True))
        first: dict[tuple[str, ...], int] = {}
        for k, key in enumerate(keys):
            first.setdefault(key, k)
        number = {key: i for i, key in enumerate(first)}
        return np.array([number[key] for key in keys]), list(first.values())


def read_cells(
    path: Path | str, delimiter: str | None, decimal: str | None, marker: str | None = None
) -> Cells:
    """
    Read a delimited text file with a header line, or a log or export in a form that is known.

    marker: what is meant, where an export holds several things that were tracked.
    """
    path = Path(path)
    said: list[str] = []
    try:
        data = path.read_bytes()
    except OSError as error:
        raise DataError(f"table '{path}' cannot be read: {error.strerror or error}") from None
    result = _known(path, data, marker, Rank.BYTES, Rank.BYTES)
    if result is None:
        decoded = _decoded(path, data)
        last = Rank.POINTS if delimiter is None else Rank.MARK
        result = _known(path, decoded, marker, Rank.MARK, last)
    if result is not None:
        return result
    table = split_lines(path, decoded, delimiter, said)
    units = {name: parted(name)[1] for name in table.header}
    header, rows = without_units(path, table.header, table.rows, units)
    if decimal is None:
        commas = said[:1] == ["columns are separated by ','"] or delimiter == ','
        decimal = decimal_sign(path, rows, ',' if commas else None)
        if decimal == ',':
            said.append('the decimal sign is a comma')
    return Cells(path, header, rows, table.numbers, decimal, said)


def _known(
    path: Path, content: str | bytes, marker: str | None, first: Rank, last: Rank
) -> Cells | None:
    """Return what is in a form of some ranks; None where it is in none of them."""
    for form in forms():
        if not first <= form.rank <= last or not form.tells(content):
            continue
        try:
            return _as_read(path, form.read(path, content, marker))
        except DataError as error:
            if form.rank <= Rank.MARK:
                raise  # it names the file
            raise DataError(f"table '{path}': {error}") from None
    return None


def _as_read(path: Path, result: Read) -> Cells:
    header, rows, lines, said = result
    if not rows:
        raise DataError(f"table '{path}': there is a header and no row under it")
    comma = any(COMMA.match(cell) for row in rows[:LOOK] for cell in row)
    return Cells(path, header, rows, lines, ',' if comma else '.', said)


def _decoded(path: Path, data: bytes) -> str:
    if data[:2] in (b'\xff\xfe', b'\xfe\xff'):  # "Unicode text" of Excel
        return data.decode('utf-16', errors='replace')
    if b'\0' in data[:4096]:
        raise DataError(f"table '{path}' is no text; save it as CSV (UTF-8) first")
    try:
        return data.decode('utf-8-sig')
    except UnicodeDecodeError:
        return data.decode('latin-1')  # a degree sign from a Windows instrument
