# Copyright 2026 weld_twin contributors
# SPDX-License-Identifier: Apache-2.0
"""Score on disk: JSON and page."""

from __future__ import annotations

from pathlib import Path

from weld_twin_core.errors import DataError
from weld_twin_msgs_py.files.yaml_file import read_yaml
from weld_twin_nodes.offline.output_directory import write_owned

from . import layout
from .score_page import score_page
from .scoring import Score


def write_score(out: Path, score: Score) -> None:
    """Write the score as JSON and as a page."""
    write_owned(out / layout.PAGE, score_page(score))
    write_owned(out / layout.SCORE, layout.text(layout.SCORE, score.as_dict()))


def read_reasons(path: str) -> dict[str, str]:
    """
    Return why cases went wrong, from a YAML file of names and sentences; empty for no file.

    Raises
    ------
    DataError
        The file holds something else.

    """
    if not path:
        return {}
    data = read_yaml(path, 'reasons file')
    if not isinstance(data, dict):
        raise DataError(f"reasons file '{path}' must map names of cases to sentences")
    return {str(name): str(sentence) for name, sentence in data.items()}
