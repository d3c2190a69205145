# Copyright 2026 weld_twin contributors
# SPDX-License-Identifier: Apache-2.0
"""Files that somebody dropped, written into a folder: few, small enough, under plain names."""

from __future__ import annotations

import re
from collections.abc import Mapping, Sequence
from datetime import datetime
from pathlib import Path
from typing import Any, Protocol

from weld_twin_core.arm import catalog
from weld_twin_core.errors import DataError

from .job import OTHERS, TABLES, Asked, title

BAGS = ('.mcap', '.db3', '.bag', '.zstd')
"""Suffixes of a bag's files."""
PLAIN = re.compile(r'[A-Za-z0-9][A-Za-z0-9._ -]{0,120}')
PIECE = 1 << 20
"""Bytes copied at once."""
ALIGN = ('', 'base', 'tool', 'base,tool')
UNITS = {'length_unit': ('', 'm', 'mm'), 'angle_unit': ('', 'rad', 'deg')}
CELL = 80
"""Characters of a cell's name."""


class Upload(Protocol):
    """A file of a form."""

    filename: str | None

    async def read(self, size: int = -1) -> bytes:
        """Return so many bytes of it."""


async def save(uploads: Sequence[Upload], place: Path, most: int) -> tuple[str, ...]:
    """
    Write files into a new folder of their title, and return their names.

    Parameters
    ----------
    uploads : sequence of Upload
    place : Path
    most : int
        Files allowed.

    Raises
    ------
    DataError
        There are none, too many, or one is of no kind that is read.

    """
    names = [_name(upload.filename) for upload in uploads if upload.filename]
    if not names:
        raise DataError('choose a recording first: a bag, or a table of angles and positions')
    if len(names) > most:
        raise DataError(f'{len(names)} files are too many; a bag has at most {most}')
    if len(set(names)) < len(names):
        raise DataError('two files have the same name; drop one recording at a time')
    if not any(name.lower().endswith(BAGS + TABLES) for name in names):
        raise DataError(
            'no recording is among these: a bag ends in .mcap or .db3, a table in .csv'
        )
    place = place / title(names)
    place.mkdir(parents=True)
    for name, upload in zip(names, (u for u in uploads if u.filename), strict=True):
        with (place / name).open('xb') as stream:
            while piece := await upload.read(PIECE):
                stream.write(piece)
    return tuple(names)


def _name(given: str | None) -> str:
    """Return the last part of a name, refused where it is none of a recording."""
    name = re.split(r'[/\\]', given or '')[-1]
    if not PLAIN.fullmatch(name):
        raise DataError(
            'a file has a name with signs that are not letters, digits, - or _; rename it'
        )
    if not name.lower().endswith(BAGS + TABLES + OTHERS):
        raise DataError(f'{name!r} is neither a bag, a table nor a robot file')
    return name


def asked_of(form: Mapping[str, Any], names: Sequence[str]) -> Asked:
    """
    Return what a form asks for; its robot is empty where none was chosen.

    Parameters
    ----------
    form : mapping
    names : sequence of str
        Of the files dropped.

    Raises
    ------
    DataError
        A field holds something that is no choice.

    """
    robots = [n for n in names if n.lower().endswith(OTHERS) and n.lower() != 'metadata.yaml']
    robot = _text(form, 'robot') or (robots[0] if robots else '')
    if robot and robot not in robots and robot.lower() not in catalog.names():
        raise DataError('the robot is none of those bundled; drop its file with the recording')
    choices = {'align': ALIGN, **UNITS}
    told = {name: _text(form, name) for name in choices}
    for name, value in told.items():
        if value not in choices[name]:
            raise DataError(f'{name.replace("_", " ")} cannot be {value!r}')
    at = _text(form, 'at')
    try:
        _ = at and datetime.fromisoformat(at)
    except ValueError:
        raise DataError(f'{at!r} is no date; write 2026-03-31T14:05') from None
    cell = _text(form, 'cell')[:CELL]
    if not cell.isprintable():
        raise DataError("a cell's name has signs that cannot be shown")
    apply = _text(form, 'apply') == 'yes'
    return Asked(robot=robot, apply=apply, cell=cell, at=at, **told)


def _text(form: Mapping[str, Any], name: str) -> str:
    value = form.get(name, '')
    return value.strip() if isinstance(value, str) else ''
