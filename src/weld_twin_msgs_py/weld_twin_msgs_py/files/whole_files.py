# Copyright 2026 weld_twin contributors
# SPDX-License-Identifier: Apache-2.0
"""Files that appear whole or not at all: texts, and JSON with null for what is not finite."""

import fcntl
import json
import os
from collections.abc import Iterator
from contextlib import contextmanager, suppress
from math import isfinite
from pathlib import Path
from typing import Any

import numpy as np

from weld_twin_core.errors import DataError


def followed(path: Path | str) -> Path:
    """Return where a path leads: to the place that a link names, which may not exist yet."""
    place = Path(path)
    return Path(os.path.realpath(place)) if place.is_symlink() else place


def write_text(path: Path | str, text: str, *, overwrite: bool = False) -> None:
    """Write a text file as `write_bytes` does, in UTF-8."""
    write_bytes(path, text.encode('utf-8'), overwrite=overwrite)


def write_bytes(path: Path | str, content: bytes, *, overwrite: bool = False) -> None:
    """Write a file beside its place, then move it there; a link is followed."""
    target = followed(path)
    if target.exists() and not overwrite:
        raise DataError(f"'{path}' exists already and is not overwritten; give another name")
    try:
        target.parent.mkdir(parents=True, exist_ok=True)
        with _beside(target) as (scratch, file):
            with open(file, 'wb', closefd=False) as stream:
                stream.write(content)
            os.fchmod(file, 0o644)
            os.replace(scratch, target)
    except OSError as error:
        raise DataError(f"'{path}' cannot be written: {error.strerror or error}") from None


@contextmanager
def _beside(target: Path) -> Iterator[tuple[Path, int]]:
    """
    Yield a hidden file beside another and its descriptor; it is gone afterwards unless it was moved.

    It has one name only: what a killed writer left is taken by the next one, and writers at the same
    time wait for each other.
    """
    scratch = target.with_name(f'.{target.name}.writing')
    while True:
        file = os.open(scratch, os.O_CREAT | os.O_RDWR | os.O_NOFOLLOW | os.O_CLOEXEC, 0o600)
        with suppress(OSError):  # a file system without locks
            fcntl.flock(file, fcntl.LOCK_EX)
        with suppress(FileNotFoundError):  # the one before has moved it away
            if os.path.samestat(os.fstat(file), os.stat(scratch)):
                break
        os.close(file)
    try:
        os.ftruncate(file, 0)
        yield scratch, file
    except BaseException:
        with suppress(OSError):
            os.unlink(scratch)
        raise
    finally:
        os.close(file)


def plain(value: Any) -> Any:
    """Return a value with lists for arrays, texts for keys, and None for what is not finite."""
    if isinstance(value, dict):
        return {str(key): plain(item) for key, item in value.items()}
    if isinstance(value, np.ndarray):
        value = value.tolist()
    if isinstance(value, list | tuple):
        # A posterior has rows of numbers by the hundred.
        if {*map(type, value)} == {float} and all(map(isfinite, value)):
            return [*value]
        return [plain(item) for item in value]
    if isinstance(value, np.generic):
        value = value.item()
    return None if isinstance(value, float) and not isfinite(value) else value


def json_text(value: Any) -> str:
    return json.dumps(plain(value), indent=1, allow_nan=False) + '\n'


def write_json(path: Path | str, value: Any, *, overwrite: bool = False) -> None:
    """Write a result as `write_text` writes a text."""
    write_text(path, json_text(value), overwrite=overwrite)


def read_json(path: Path | str) -> dict[str, Any]:
    """Return the mapping that a file holds."""
    try:
        content = json.loads(Path(path).read_text(encoding='utf-8'))
    except OSError as error:
        raise DataError(f"'{path}' cannot be read: {error.strerror}") from None
    except (ValueError, RecursionError) as error:
        raise DataError(f"'{path}' is not JSON: {error}") from None
    if not isinstance(content, dict):
        raise DataError(f"'{path}' is not what it should be: it holds no names and values")
    return content
