# Copyright 2026 weld_twin contributors
# SPDX-License-Identifier: Apache-2.0
"""The text of a message type that only the package it comes from knows."""

from __future__ import annotations

import sys
from collections.abc import Callable, Iterator
from contextlib import suppress
from pathlib import Path

from ament_index_python.packages import PackageNotFoundError, get_package_share_directory

from weld_twin_core.errors import DataError

RULE = '=' * 80
"""The line between the parts of a definition, as rosbag2 writes it."""
_SIZES = (8, 16, 32, 64)
"""Bits of the whole numbers there are."""
BUILT_IN = (
    *('bool', 'byte', 'char', 'float32', 'float64', 'string', 'wstring'),
    *(f'int{size}' for size in _SIZES),
    *(f'uint{size}' for size in _SIZES),
)
"""Primitive types of the interface definition language."""


def definition(kind: str) -> str:
    """
    Return the definition of a message type and of all it is made of, as bags hold it.

    Raises DataError: its package, or one it needs, is not installed with its .msg files.
    """
    parts: dict[str, str] = {}
    _gather(kind, parts, _installed)
    first, *others = parts.items()
    return first[1] + ''.join(f'{RULE}\nMSG: {_short(name)}\n{text}' for name, text in others)


def _gather(kind: str, parts: dict[str, str], read: Callable[[str], str]) -> None:
    """Add a type and what its fields need."""
    if kind in parts:
        return
    text = parts[kind] = read(kind).rstrip() + '\n'
    package = kind.split('/')[0]
    for line in text.splitlines():
        words = line.split('#')[0].split()
        base = words[0].split('[')[0].split('<')[0] if len(words) > 1 else ''
        if not base or base in BUILT_IN:
            continue
        *owner, name = base.split('/')
        _gather(f'{owner[0] if owner else package}/msg/{name}', parts, read)


def _installed(kind: str) -> str:
    package, _, name = kind.split('/')
    for share in _shares(package):
        file = Path(share, 'msg', f'{name}.msg')
        if file.is_file():
            return file.read_text(encoding='utf-8')
    raise DataError(
        f'the definition of {kind} is not installed here; install the package {package}'
    )


def _shares(package: str) -> Iterator[str]:
    """Yield where a package may keep its files; wheels keep them without telling the index."""
    with suppress(PackageNotFoundError, LookupError, OSError):
        yield get_package_share_directory(package)
    yield f'{sys.prefix}/share/{package}'


def _short(kind: str) -> str:
    return kind.replace('/msg/', '/')
