# Copyright 2026 weld_twin contributors
# SPDX-License-Identifier: Apache-2.0
"""Whether a program is what an earlier correction wrote: its points would be moved a second time."""

from __future__ import annotations

from collections.abc import Collection
from pathlib import Path

from weld_twin_core.errors import DataError
from weld_twin_msgs_py.files.whole_files import read_json

RESULT = 'correction.json'


def moved(folder: Path) -> str | None:
    """Return the name of the program of a folder whose points a correction moved; None for none."""
    try:
        content = read_json(folder / RESULT)
    except DataError:
        return None
    moves = content.get('moves', ())
    some = any(move.get('moved_m') or move.get('turned_rad') for move in moves)
    return content.get('program') if some else None


def holds(folder: Path, texts: Collection[bytes]) -> bool:
    """Tell whether a folder holds the files of a program, under whatever names, as corrected."""
    sizes = {len(text) for text in texts}
    try:
        files = [file for file in folder.iterdir() if file.is_file()]
        kept = {file.read_bytes() for file in files if file.stat().st_size in sizes}
    except OSError:
        return False
    return kept >= set(texts) and moved(folder) is not None


def twice(program: Path | str, why: str) -> DataError:
    """Return that a program was corrected already, and how that is known."""
    return DataError(
        f"'{program}' was corrected already: {why}; give the program as it was before, or its points "
        'are moved twice'
    )
