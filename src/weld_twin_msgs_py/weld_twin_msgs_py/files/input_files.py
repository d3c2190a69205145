# Copyright 2026 weld_twin contributors
# SPDX-License-Identifier: Apache-2.0
"""Which data a result comes from: names and hashes of the inputs."""

import hashlib
from collections.abc import Iterator
from pathlib import Path
from typing import NamedTuple

from weld_twin_core.errors import DataError

_PIECE = 1 << 20
"""Bytes read at once."""


class InputFile(NamedTuple):
    """One input: what it was used as, where it was, and the SHA-256 of its content."""

    use: str
    path: str
    sha256: str

    def as_dict(self) -> dict[str, str]:
        """Return the entry of diagnosis.json."""
        return self._asdict()


def hashed(use: str, path: Path | str) -> InputFile:
    """Return an input with its hash; of a directory, over names and contents of its files in order."""
    place = Path(path)
    digest = hashlib.sha256()
    try:
        for file in _files(place):
            if place.is_dir():
                digest.update(file.relative_to(place).as_posix().encode() + b'\0')
            with file.open('rb') as stream:
                while piece := stream.read(_PIECE):
                    digest.update(piece)
    except OSError as error:
        raise DataError(f"'{path}' cannot be read: {error.strerror or error}") from None
    return InputFile(use, str(path), digest.hexdigest())


def _files(place: Path) -> Iterator[Path]:
    if place.is_dir():
        yield from sorted(file for file in place.rglob('*') if file.is_file())
    else:
        yield place
