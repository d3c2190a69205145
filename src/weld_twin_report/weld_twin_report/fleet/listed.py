# Copyright 2026 weld_twin contributors
# SPDX-License-Identifier: Apache-2.0
"""The list of a fleet: one recording a line, with its cell, its robot and its options."""

from __future__ import annotations

import csv
from collections.abc import Mapping
from dataclasses import dataclass, fields
from datetime import datetime
from pathlib import Path

from weld_twin_core import __version__
from weld_twin_core.errors import DataError, TwinError
from weld_twin_msgs_py.files.input_files import hashed
from weld_twin_msgs_py.robots.load import as_file
from weld_twin_nodes.offline.content_hash import digest

from ..history.entry import instant
from ..history.schema import not_a_cell

LONGEST = 1_000_000
"""Lines of a list; ten weeks of a hundred thousand cells."""
NEEDED = ('cell', 'recording', 'robot')
PATHS = ('recording', 'effects_known', 'contacts')
"""Columns that name files; relative to the folder of the list."""
YES = {'yes': True, 'true': True, '1': True, 'no': False, 'false': False, '0': False, '': False}


@dataclass(frozen=True)
class Listed:
    """One line of the list; every attribute is a column, and an option of ``diagnose``."""

    cell: str
    recording: str
    robot: str
    at: str = ''  # when it was recorded, ISO 8601; empty where the stamps are dates
    align: str = ''
    effects_known: str = ''
    base_link: str = ''
    tip_link: str = ''
    contacts: str = ''
    """Empty for none."""
    apply: bool = False  # whether a mistake in data or set-up is corrected

    @property
    def date(self) -> datetime | None:
        """Return the instant that `at` names, UTC where it does not say; None for none."""
        return instant(self.at) if self.at else None

    def words(self, out: Path) -> list[str]:
        """Return the words of the command that diagnoses it."""
        words = ['diagnose', self.recording, '--robot', self.robot, '--out', str(out)]
        for name in ('align', 'effects_known', 'base_link', 'tip_link', 'contacts'):
            if value := getattr(self, name):
                words += [f'--{name.replace("_", "-")}', value]
        return words + ['--apply'] * self.apply

    def key(self) -> str:
        """
        Return what tells this request from any other, content of its files included.

        A file that is not there is told by its name: once it is there, it is another request.
        """
        files = [self.recording, self.robot, self.effects_known, self.contacts]
        reported = [_content(name) for name in files]
        rest = (self.cell, self.at, self.align, self.base_link, self.tip_link, str(self.apply))
        return digest(__version__, *reported, *rest)


def _content(name: str) -> str:
    """Return what tells the content of a file; its name where there is none that can be read."""
    try:
        return hashed('recording', name).sha256 if name and Path(name).exists() else name
    except (OSError, TwinError):
        return name


def read_list(path: Path | str) -> list[Listed]:
    """
    Return the lines of a list.

    Raises DataError: it is no table with these columns; the sentence names line and column.
    """
    file = Path(path)
    names = [field.name for field in fields(Listed)]
    try:
        with file.open(newline='', encoding='utf-8-sig') as stream:
            rows = csv.DictReader(stream, strict=True)
            heads = list(rows.fieldnames or [])
            _check_heads(file, heads, names)
            out: list[Listed] = []
            for row in rows:
                if len(out) >= LONGEST:
                    raise DataError(f"'{file}' has more than {LONGEST} lines; split it")
                out.append(_line(file, rows.line_num, row))
    except (csv.Error, UnicodeDecodeError) as error:
        raise DataError(f"'{file}' is no table of text with commas: {error}") from None
    if not out:
        raise DataError(f"'{file}' names no recording")
    return out


def _check_heads(file: Path, heads: list[str], names: list[str]) -> None:
    for name in NEEDED:
        if name not in heads:
            raise DataError(f"'{file}' has no column {name!r}; it needs {', '.join(NEEDED)}")
    for name in heads:
        if name not in names:
            raise DataError(
                f"'{file}': column {name!r} is not known; there are {', '.join(names)}"
            )


def _line(file: Path, number: int, row: Mapping[str | None, str | None]) -> Listed:
    if None in row or None in row.values():
        raise DataError(f"'{file}' line {number} has not as many cells as the first line")
    reported = {str(name): str(value).strip() for name, value in row.items()}
    for name in NEEDED:
        if not reported[name]:
            raise DataError(f"'{file}' line {number} has no {name}")
    if why := not_a_cell(reported['cell']):
        raise DataError(f"'{file}' line {number}: {why}")
    for name in PATHS:
        if reported.get(name):
            reported[name] = str(file.parent / reported[name])
    if (file.parent / reported['robot']).is_file():
        reported['robot'] = str(file.parent / reported['robot'])
    else:
        reported['robot'] = as_file(reported['robot'])
    apply = YES.get(reported.pop('apply', '').lower())
    if apply is None:
        raise DataError(f"'{file}' line {number}: apply is yes or no")
    listed = Listed(**reported, apply=apply)
    try:
        _ = listed.date
    except DataError as error:
        raise DataError(f"'{file}' line {number}: {error}") from None
    return listed
