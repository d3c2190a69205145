# Copyright 2026 weld_twin contributors
# SPDX-License-Identifier: Apache-2.0
"""Output directories that appear whole or not at all."""

from __future__ import annotations

import shutil
import tempfile
from collections.abc import Iterator
from contextlib import contextmanager
from pathlib import Path

from weld_twin_core.errors import DataError


@contextmanager
def new_directory(path: Path | str, *, mark: str) -> Iterator[Path]:
    """
    Yield a hidden directory that becomes ``path`` when the block succeeds.

    Parameters
    ----------
    path : Path or str
        Must not exist, be empty, or be what the same command left there.
    mark : str
        Name of a file that tells the latter; the block makes it.

    Raises
    ------
    DataError
        Something else is there, or the place cannot be written.

    """
    target = Path(path)
    _refuse_foreign(target, mark)
    try:
        target.parent.mkdir(parents=True, exist_ok=True)
        scratch = Path(tempfile.mkdtemp(prefix=f'.{target.name}-', dir=target.parent))
    except OSError as error:
        raise DataError(f"'{target}' cannot be written: {error.strerror}") from None
    try:
        made = scratch / target.name
        made.mkdir()
        yield made
        _refuse_foreign(target, mark)
        if target.exists():
            target.rename(scratch / 'before')
        made.rename(target)
    finally:
        shutil.rmtree(scratch, ignore_errors=True)


def _refuse_foreign(target: Path, mark: str) -> None:
    """Refuse to replace what another command, or the user, has put there."""
    if not target.exists() or (target.is_dir() and (target / mark).is_file()):
        return
    if not target.is_dir() or any(target.iterdir()):
        raise DataError(f"'{target}' holds something else already; choose another place")
