# Copyright 2026 weld_twin contributors
# SPDX-License-Identifier: Apache-2.0
"""A bag from what is whole of another: of one whose recorder died, or that was damaged since."""

from __future__ import annotations

import json
import os
import shutil
from collections import Counter
from collections.abc import Iterator
from contextlib import contextmanager, suppress
from dataclasses import dataclass
from pathlib import Path

from weld_twin_core.errors import DataError

from ..files.whole_files import followed
from ..messages.typestore import TYPES, decode
from .growing import NOTES, UNFINISHED, is_growing, lock, unfinished
from .salvage import Damage, Found
from .salvage_mcap import salvage_mcap
from .salvage_sqlite import salvage_sqlite
from .segment import SUFFIXES, clear_write_errors, sync
from .segments import Segments
from .storage import look, storage_files
from .writer import custom_data

_STORAGE = {'.mcap': ('mcap', salvage_mcap), '.db3': ('sqlite3', salvage_sqlite)}
_SCRATCH = '.recovering'


@dataclass(frozen=True)
class Recovery:
    """What was recovered."""

    source: Path
    path: Path
    """Where from, and the new bag."""
    messages: dict[str, int]
    """How many of each topic."""
    damage: tuple[str, ...]
    """What was wrong, a sentence each."""


def recover(path: Path | str, out: Path | str | None = None) -> Recovery:
    """
    Make a bag of all messages that are whole; the source stays as it is.

    Parameters
    ----------
    path : Path or str
        What the recorder was told to write, its unfinished directory, or any broken bag.
    out : Path or str, optional
        Must not exist. Left out, the name the recorder was to give, or ``NAME_recovered``.

    Raises
    ------
    DataError
        Nothing is there, it is still being recorded, it holds no whole message, or the place
        cannot be written.

    """
    source = _source(Path(path))
    target = _target(source) if out is None else followed(out)
    if target.exists():
        raise DataError(f"'{target}' exists already and is not overwritten; choose with --out")
    damage = Damage()
    with _held(source), clear_write_errors(target, _elsewhere), _scratch(target) as folder:
        counts = _copy(source, folder, target.name, damage)
        if not counts:
            said = '; '.join(damage.sentences) or 'there is none'
            raise DataError(f"'{source}' holds no whole message: {said}")
        if target.exists():
            raise DataError(f"'{target}' has appeared meanwhile and is not overwritten")
        folder.rename(target)
        sync(target.parent)
    return Recovery(source, target, dict(counts), tuple(damage.sentences))


def _elsewhere() -> str:
    """Return what may help where the copy cannot be written."""
    return '; say a place on another disk with --out'


def _source(path: Path) -> Path:
    if not path.exists() and unfinished(path).is_dir():
        return unfinished(path)
    if not path.exists():
        raise DataError(f"there is no bag at '{path}'")
    if path.is_file() and path.suffix not in SUFFIXES:
        raise DataError(f"'{path}' is no bag: expected a directory, a .mcap or a .db3 file")
    return path


def _target(source: Path) -> Path:
    name = source.stem if source.is_file() else source.resolve().name
    if name.endswith(UNFINISHED):
        return source.resolve().with_name(name[: -len(UNFINISHED)])
    return source.resolve().with_name(f'{name}_recovered')


def _files(source: Path) -> list[Path]:
    """Return the storage files; the last of a growing bag lies in a directory of its own."""
    if source.is_file():
        return [source]
    files = storage_files(source)
    if is_growing(source):
        folders = (item for item in source.iterdir() if item.is_dir())
        files += [file for folder in folders for file in storage_files(folder)]
    if not files:
        raise DataError(f"'{source}' is no bag: it holds no .mcap or .db3 file")
    return files


@contextmanager
def _held(source: Path) -> Iterator[None]:
    """Keep the recorder, and another recovery, off an unfinished bag."""
    held = lock(source) if is_growing(source) else -1
    try:
        yield
    finally:
        if held >= 0:
            os.close(held)


@contextmanager
def _scratch(target: Path) -> Iterator[Path]:
    """Yield a new hidden directory, which is gone afterwards unless it was renamed."""
    target.parent.mkdir(parents=True, exist_ok=True)
    folder = target.with_name(f'.{target.name}{_SCRATCH}')
    shutil.rmtree(folder, ignore_errors=True)
    folder.mkdir()
    try:
        yield folder
    finally:
        shutil.rmtree(folder, ignore_errors=True)


def _copy(source: Path, folder: Path, name: str, damage: Damage) -> Counter[str]:
    """Copy what is whole, file by file."""
    counts: Counter[str] = Counter()
    files = _files(source)
    storage = _STORAGE[files[0].suffix][0]
    segments = Segments(folder, name, storage)
    try:
        for k, file in enumerate(files):
            if k:
                segments.split()
            for result in _STORAGE[file.suffix][1](file, damage):
                _write(segments, result, file, counts, damage)
        segments.finish(_provenance(source, damage))
    finally:
        segments.abort()
    return counts


def _write(
    segments: Segments, result: Found, file: Path, counts: Counter[str], damage: Damage
) -> None:
    channel, log_ns, data = result
    try:
        if channel.type in TYPES.types:
            decode(data, channel.type)
    except Exception:  # half a message surfaces as anything
        damage.tell(file, 'holds broken messages, which are left out')
        return
    try:
        segments.write(channel, data, log_ns)
    except DataError as error:
        damage.tell(file, f'is recovered without some of its messages: {error}')
    else:
        counts[channel.topic] += 1


def _provenance(source: Path, damage: Damage) -> dict[str, str]:
    """Return what was noted about the making of the bag, and that it was recovered."""
    custom: dict[str, str] = {}
    with suppress(Exception):  # it is beside a broken bag and may be broken itself
        if (source / NOTES).is_file():
            custom = custom_data(json.loads((source / NOTES).read_bytes()))
        else:
            custom = {str(key): str(value) for key, value in look(source).custom.items()}
    return custom | custom_data({'recovered': damage.sentences})
