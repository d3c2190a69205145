# Copyright 2026 weld_twin contributors
# SPDX-License-Identifier: Apache-2.0
"""A study part by part: each is kept as soon as it is there, so that one that was stopped goes on."""

from __future__ import annotations

import json
from collections.abc import Callable
from pathlib import Path
from typing import Any

from weld_twin_core.errors import DataError
from weld_twin_msgs_py.files.whole_files import write_text
from weld_twin_nodes.offline.output_directory import write_owned

Tell = Callable[[str], None]
"""Told what is being done."""


class Parts:
    """
    The parts of a study, a file each.

    Parameters
    ----------
    folder : Path
        Made where it is not there.
    tell : callable
        Told the name of each part that is made.

    """

    def __init__(self, folder: Path, tell: Tell = lambda text: None) -> None:
        self._folder, self._tell = folder, tell
        folder.mkdir(parents=True, exist_ok=True)

    def __call__(self, name: str, make: Callable[[], dict[str, Any]]) -> dict[str, Any]:
        """Return one part, from its file where there is one; else made, and kept."""
        path = self._folder / f'{name}.json'
        if not path.is_file():
            self._tell(name)
            write_text(path, json.dumps(make(), indent=1, default=float) + '\n')
        kept: dict[str, Any] = json.loads(path.read_text(encoding='utf-8'))
        return kept


def refuse_foreign(out: Path, *ours: str) -> None:
    """
    Refuse a folder that holds something else than a study.

    Raises
    ------
    DataError
        It holds another name than ``ours``, or is no folder.

    """
    if out.exists() and not (out.is_dir() and all(p.name in ours for p in out.iterdir())):
        raise DataError(f"'{out}' holds something else already; choose another place")


def write_results(place: Path, result: Any) -> None:
    """Write the results of a study as JSON."""
    write_owned(place, json.dumps(result, indent=1) + '\n')
