# Copyright 2026 weld_twin contributors
# SPDX-License-Identifier: Apache-2.0
"""Robots of one's own: a file dropped in a folder is a robot by its name, as a bundled one is."""

from __future__ import annotations

import os
from collections.abc import Iterator
from pathlib import Path

from weld_twin_core.arm import catalog
from weld_twin_core.errors import ModelError

FOLDERS = 'WELD_TWIN_ROBOTS'
"""Variable of the environment: one folder, or several as in PATH."""
SUFFIXES = ('.yaml', '.yml', '.urdf')
"""Of the files that are taken for robots."""


def folders() -> tuple[Path, ...]:
    """Return where robots of one's own lie: what the environment says, else the user's settings."""
    reported = os.environ.get(FOLDERS, '')
    if reported:
        return tuple(Path(part).expanduser() for part in reported.split(os.pathsep) if part)
    home = os.environ.get('XDG_CONFIG_HOME') or os.path.join(os.path.expanduser('~'), '.config')
    return (Path(home, 'weld_twin', 'robots'),)


def own_files() -> tuple[Path, ...]:
    """Return the files of one's own robots, by their names."""
    return tuple(sorted(_files(), key=lambda file: (file.stem.lower(), file)))


def _files() -> Iterator[Path]:
    for folder in folders():
        if folder.is_dir():
            yield from (file for file in folder.iterdir() if file.suffix.lower() in SUFFIXES)


def robot_names() -> tuple[str, ...]:
    """Return the names of the bundled robots, then of one's own."""
    own = dict.fromkeys(file.stem for file in own_files())
    return (*catalog.names(), *(name for name in own if name.lower() not in catalog.names()))


def own_robot(spec: str) -> Path | None:
    """
    Return the file of a robot of one's own, None where the name is none of theirs.

    Raises ModelError: several robots have the name; none of them is taken for the other.

    spec: a name without a suffix, in capital or small letters.
    """
    result = [str(file) for file in own_files() if file.stem.lower() == spec.lower()]
    if result and spec.lower() in catalog.names():
        result.insert(0, 'the bundled one')
    if len(result) > 1:
        raise ModelError(
            f'{spec!r} is the name of several robots: {", ".join(result)}; rename all files but one'
        )
    return Path(result[0]) if result else None


def as_file(spec: str) -> str:
    """Return the path of a robot's file where a name is that of one's own; else what was given."""
    if Path(spec).is_file():
        return spec
    own = own_robot(spec)
    return spec if own is None else str(own)


def looked_in() -> str:
    """Return in which folders was looked, and which are none."""
    return ' and '.join(
        f"'{folder}'" + ('' if folder.is_dir() else ', which is no folder') for folder in folders()
    )
