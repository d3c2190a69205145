# Copyright 2026 weld_twin contributors
# SPDX-License-Identifier: Apache-2.0
"""Numbers as people and spreadsheets write them: decimal signs, groups of thousands, units behind."""

from __future__ import annotations

import re
from collections.abc import Iterable
from pathlib import Path

from weld_twin_core.errors import DataError

from .words import UNITS, unit_word

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
    """
    Return a cell as a number.

    Raises ValueError: it is none.

    decimal: '.' or ','.
    """
    plain = _GAP.sub('', text).replace('\N{MINUS SIGN}', '-')
    if _GROUPED[decimal].match(plain):
        plain = plain.replace('.' if decimal == ',' else ',', '')
    if decimal == ',':
        if POINT.match(plain):
            raise ValueError(text)
        plain = plain.replace(',', '.')
    return float(plain)


def decimal_sign(path: Path, rows: Iterable[list[str]], delimiter: str | None) -> str:
    """
    Return the decimal sign of the numbers in some rows.

    Raises DataError: some numbers have a comma and some a point, and no group of thousands tells
    why.

    path: for the message.
    delimiter: between the cells; a comma there is no decimal sign.
    """
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
    """
    Return a table with units that stand behind every number of a column taken into its header.

    Raises DataError: the header gives another unit than the cells.

    path: for the message.
    unit_of_name: units that the header gives already.
    """
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
