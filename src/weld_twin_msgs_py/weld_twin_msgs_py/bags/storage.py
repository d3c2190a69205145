# Copyright 2026 weld_twin contributors
# SPDX-License-Identifier: Apache-2.0
"""What a path to a bag stands for: its storage files, and what is said about them."""

import sqlite3
from contextlib import closing, suppress
from pathlib import Path, PurePath
from typing import Any, NamedTuple

import yaml
from mcap.reader import make_reader

from weld_twin_core.errors import DataError

from .growing import UNFINISHED, is_growing, unfinished
from .segment import INFORMATION, METADATA, SUFFIXES, recover_command

PACKED = '.zstd'
TABLES = ('.csv', '.tsv', '.txt')
SIZE_LIMIT = 16_000_000
"""Bytes of metadata.yaml; a bag of a thousand files has some hundred kilobytes."""
DEPTH_LIMIT = 50
"""Levels of metadata.yaml; it has six."""
_Loader: Any = getattr(yaml, 'CSafeLoader', yaml.SafeLoader)


class Bag(NamedTuple):
    """Where a bag lies."""

    files: list[Path]  # storage files, in the order they were written
    custom: dict[str, str]  # the ``custom_data`` of its metadata
    packed: bool = False  # messages are compressed one by one


def look(path: Path) -> Bag:
    """
    Return what a path to a bag stands for.

    Raises ValueError, KeyError, TypeError, OSError, yaml.YAMLError: its metadata is damaged.
    """
    refuse_unfinished(path)
    if path.suffix == '.bag' and not path.is_dir():
        raise DataError(f"'{path}' is a ROS 1 bag; convert it with rosbags-convert first")
    if path.is_file():
        if path.suffix not in SUFFIXES:
            hint = '; a table becomes one with weld-twin import' if path.suffix in TABLES else ''
            raise DataError(
                f"'{path}' is no bag: expected a rosbag2 directory, a .mcap or a .db3 file{hint}"
            )
        made = _information(path.parent)
        return Bag([path], _custom(made) if path.name in _named(made) else _within(path))
    if (path / METADATA).exists():
        return _listed(path)
    files = storage_files(path)
    if not files:
        raise DataError(
            f"'{path}' is no bag: it holds neither metadata.yaml nor a .mcap or .db3 file"
        )
    return Bag(files, _within(files[-1]))


def refuse_unfinished(path: Path) -> None:
    """Refuse what is not there, and say so if it is there under the name of a growing bag."""
    growing = path if is_growing(path) else unfinished(path)
    named = growing.with_name(growing.name.removesuffix(UNFINISHED))
    if growing.is_dir() and not (path.exists() and path != growing):
        raise DataError(
            f"the recording of '{named}' is still running or was cut short; what is on the disk "
            f"becomes a bag with '{recover_command(named, growing)}'"
        )
    if not path.exists():
        raise DataError(f"there is no bag at '{path}'")


def storage_files(folder: Path) -> list[Path]:
    """Return the storage files of a directory, the tenth after the ninth."""
    files = [file for file in folder.iterdir() if file.suffix in SUFFIXES and file.is_file()]
    return sorted(files, key=lambda file: (_number(file), file.name))


def _number(file: Path) -> int:
    digits = file.stem.rpartition('_')[2]
    return int(digits) if digits.isdecimal() and digits.isascii() else 0


def _listed(path: Path) -> Bag:
    """Return the files that the metadata lists; only their names count, never their folders."""
    made = _information(path)
    files = [path / name for name in _named(made)]
    for file in files:
        if not file.is_file():
            raise ValueError(f'metadata.yaml lists {file.name!r}, which is not there')
        if file.suffix not in (*SUFFIXES, PACKED):
            raise ValueError(f'metadata.yaml lists {file.name!r}, which is no storage file')
    mode = str(made.get('compression_mode') or '').lower()
    return Bag(files, _custom(made), mode == 'message')


def _named(made: dict[str, Any]) -> list[str]:
    """Return the names of the files that metadata lists."""
    return [PurePath(str(name)).name for name in made['relative_file_paths']] if made else []


def _custom(made: dict[str, Any]) -> dict[str, str]:
    custom = made.get('custom_data') or {}
    return custom if isinstance(custom, dict) else {}


def _within(file: Path) -> dict[str, str]:
    """Return the ``custom_data`` that a storage file has in itself, as rosbag2 writes it at its end."""
    with suppress(Exception):  # of what is damaged the messages tell, or there is nothing to tell
        if file.suffix == '.mcap':
            with file.open('rb') as stream:
                records = make_reader(stream).iter_metadata()
                texts = [each.metadata['serialized_metadata'] for each in records]
        else:
            with closing(sqlite3.connect(f'{file.absolute().as_uri()}?mode=ro', uri=True)) as base:
                texts = [
                    row[0] for row in base.execute('SELECT metadata FROM metadata ORDER BY id')
                ]
        return _custom(_parsed(texts[-1].encode()))
    return {}


def _information(folder: Path) -> dict[str, Any]:
    """Return what metadata.yaml of a directory says; nothing without one."""
    file = folder / METADATA
    if not file.is_file():
        return {}
    if file.stat().st_size > SIZE_LIMIT:
        raise ValueError(f'metadata.yaml is larger than {SIZE_LIMIT / 1e6:g} MB')
    made = _parsed(file.read_bytes())[INFORMATION]
    if not isinstance(made, dict):
        raise ValueError('metadata.yaml is no mapping')
    return made


def _parsed(data: bytes) -> Any:
    _refuse_deep(data)
    return yaml.load(data, Loader=_Loader)


def _refuse_deep(data: bytes) -> None:
    """Refuse nesting on which the fast loader would overflow the stack and end the process."""
    depth = 0
    for event in yaml.parse(data, Loader=_Loader):
        if isinstance(event, yaml.CollectionStartEvent):
            depth += 1
        elif isinstance(event, yaml.CollectionEndEvent):
            depth -= 1
        if depth > DEPTH_LIMIT:
            raise ValueError('metadata.yaml is nested too deeply')
