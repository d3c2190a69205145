# Copyright 2026 weld_twin contributors
# SPDX-License-Identifier: Apache-2.0
"""Files that somebody dropped, written into a folder: few, small enough, under plain names."""

from __future__ import annotations

import re
import unicodedata
from collections.abc import Mapping, Sequence
from pathlib import Path
from typing import Any, Protocol

from weld_twin_core.errors import DataError
from weld_twin_msgs_py.programs.languages import LANGUAGES
from weld_twin_msgs_py.robots import robot_names

from ..history.entry import instant
from .fields import CORRECT, DIAGNOSE, IMPORT, given
from .job import DIAGNOSIS, OTHERS, TABLES, Asked, title

BAGS = ('.mcap', '.db3', '.bag', '.zstd')
"""Suffixes of a bag's files."""
PROGRAMS = tuple(suffix for one in LANGUAGES.values() for suffix in (*one.extensions, *one.beside))
"""Suffixes of programs."""
NAME_BYTES = 200
"""Bytes of a file's name; systems take 255, and some are added."""
PIECE = 1 << 20
"""Bytes copied at once."""
CELL = 80
"""Characters of a cell's name."""


class Upload(Protocol):
    """A file of a form."""

    filename: str | None

    async def read(self, size: int = -1) -> bytes:
        """Return so many bytes of it."""


async def save(uploads: Sequence[Upload], place: Path, most: int) -> tuple[str, ...]:
    """
    Write the files of a recording into a new folder of their title, and return their names.

    ``most``: files allowed. Raises DataError: there are none, too many, or one is of no kind that
    is read.
    """
    names = _names(uploads, BAGS + TABLES + OTHERS, 'a bag, a table nor a robot file', most)
    if not names:
        raise DataError('choose a recording first: a bag, or a table of angles and positions')
    if not any(name.lower().endswith(BAGS + TABLES) for name in names):
        raise DataError(
            'no recording is among these: a bag ends in .mcap or .db3, a table in .csv'
        )
    await _write(uploads, names, place / title(names))
    return names


async def save_program(
    uploads: Sequence[Upload], model: Sequence[Upload], place: Path, beside: Path
) -> tuple[str, ...]:
    """
    Write a program, and what it is corrected by, and return the names of the program's files.

    ``model``: a ``diagnosis.json``, and a robot file; none where a recording's are taken.
    ``place`` and ``beside``: for the program, in a new folder of its title; for the model.
    Raises DataError: there is no program, or a file is of no kind that is read.
    """
    names = _names(uploads, PROGRAMS, 'a program nor a file that belongs to one', 8)
    if not names:
        raise DataError('choose a program first')
    models = _names(model, (*OTHERS, '.json'), 'a diagnosis nor a robot file', 2)
    await _write(uploads, names, place / title(names))
    reported = [DIAGNOSIS if name.lower().endswith('.json') else name for name in models]
    await _write(model, reported, beside)
    return names


def _names(
    uploads: Sequence[Upload], suffixes: tuple[str, ...], kind: str, most: int
) -> tuple[str, ...]:
    names = tuple(_name(upload.filename, suffixes, kind) for upload in _chosen(uploads))
    if len(names) > most:
        raise DataError(f'{len(names)} files are too many; {most} are taken')
    if len({name.casefold() for name in names}) < len(names):
        raise DataError('two files have the same name; drop one recording at a time')
    return names


def _chosen(uploads: Sequence[Upload]) -> list[Upload]:
    return [upload for upload in uploads if upload.filename]


async def _write(uploads: Sequence[Upload], names: Sequence[str], place: Path) -> None:
    place.mkdir(parents=True)
    for name, upload in zip(names, _chosen(uploads), strict=True):
        with (place / name).open('xb') as stream:
            while piece := await upload.read(PIECE):
                stream.write(piece)


def _name(given: str | None, suffixes: tuple[str, ...], kind: str) -> str:
    """Return the last part of a name, refused where it cannot be shown, or is of another kind."""
    name = re.split(r'[/\\]', given or '')[-1].strip()
    hidden = any(unicodedata.category(sign)[0] in 'CZ' and sign != ' ' for sign in name)
    if hidden or name.startswith(('.', '-')) or len(name.encode()) > NAME_BYTES:
        raise DataError(
            'a file has a name that is too long, begins with a dot or a dash, or has signs that '
            'cannot be seen; rename it'
        )
    if not name.lower().endswith(suffixes):
        raise DataError(f'{name!r} is neither {kind}')
    return name


def asked_of(form: Mapping[str, Any], names: Sequence[str]) -> Asked:
    """
    Return what a form asks of a recording; its robot is empty where none was chosen.

    ``names``: of the files dropped. Raises DataError: a field holds something that is no choice.
    """
    reported = given(_texts(form), (IMPORT, DIAGNOSE))
    tables = [name for name in names if name.lower().endswith(TABLES)]
    if 'joint_signs' in reported and not tables:
        raise DataError('signs are those of a table; the joints of a bag have their own')
    at, cell = _text(form, 'at'), _text(form, 'cell')[:CELL]
    if at:
        instant(at)
    if not cell.isprintable():
        raise DataError("a cell's name has signs that cannot be shown")
    robot = _robot(form, [name for name in names if name.lower() != 'metadata.yaml'])
    return Asked(robot, _text(form, 'apply') == 'yes', cell, at, reported)


def asked_of_program(form: Mapping[str, Any], names: Sequence[str]) -> Asked:
    """
    Return what a form asks of a program.

    ``names``: of the files of its model. Raises DataError: a field holds something that is no
    choice.
    """
    return Asked(_robot(form, names), told=given(_texts(form), (CORRECT,)))


def _robot(form: Mapping[str, Any], names: Sequence[str]) -> str:
    own = [name for name in names if name.lower().endswith(OTHERS)]
    robot = _text(form, 'robot') or (own[0] if own else '')
    if robot and robot not in own and robot.lower() not in map(str.lower, robot_names()):
        raise DataError(
            'the robot is none of those bundled or on this machine; drop its file with the recording'
        )
    return robot


def _texts(form: Mapping[str, Any]) -> dict[str, str]:
    return {name: _text(form, name) for name in form}


def _text(form: Mapping[str, Any], name: str) -> str:
    value = form.get(name, '')
    return value.strip() if isinstance(value, str) else ''
