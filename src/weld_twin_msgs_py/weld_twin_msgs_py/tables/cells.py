# Copyright 2026 weld_twin contributors
# SPDX-License-Identifier: Apache-2.0
"""The cells of a delimited text file: delimiter, decimal sign, numbers."""

from __future__ import annotations

import re
from collections.abc import Iterable, Mapping, Sequence
from contextlib import suppress
from dataclasses import dataclass, replace
from pathlib import Path

import numpy as np
from numpy.typing import NDArray

from weld_twin_core.arrays import Array
from weld_twin_core.errors import DataError

from .formats import Rank, Read, forms
from .lines import COMMA, EMPTY, LOOK, decimal_sign, number, split_lines, without_units
from .words import parted, shortened


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
