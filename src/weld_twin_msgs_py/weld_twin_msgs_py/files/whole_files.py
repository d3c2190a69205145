# Copyright 2026 weld_twin contributors
# SPDX-License-Identifier: Apache-2.0
"""Text files that appear whole or not at all."""

from __future__ import annotations

import os
import tempfile
from contextlib import suppress
from pathlib import Path

from weld_twin_core.errors import DataError


def write_text(path: Path | str, text: str, *, overwrite: bool = False) -> None:
    """
    Write a text file beside its place, then move it there.

    Raises
    ------
    DataError
        The file exists and ``overwrite`` is not set, or the place cannot be written.

    """
    target = Path(path)
    if target.exists() and not overwrite:
        raise DataError(f"'{target}' exists already and is not overwritten")
    scratch: str | None = None
    try:
        target.parent.mkdir(parents=True, exist_ok=True)
        with tempfile.NamedTemporaryFile(
            'w', encoding='utf-8', dir=target.parent, prefix=f'.{target.name}-', delete=False
        ) as file:
            scratch = file.name
            file.write(text)
        os.chmod(scratch, 0o644)
        os.replace(scratch, target)
    except OSError as error:
        if scratch is not None:
            with suppress(OSError):
                os.unlink(scratch)
        raise DataError(f"'{target}' cannot be written: {error.strerror or error}") from None
