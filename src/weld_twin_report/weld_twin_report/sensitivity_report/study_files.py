# Copyright 2026 weld_twin contributors
# SPDX-License-Identifier: Apache-2.0
"""The files of a study, each written whole; a study that was stopped finds its results again."""

from __future__ import annotations

import json
from collections.abc import Iterator, Sequence
from math import isfinite
from pathlib import Path
from typing import Any

import numpy as np

from weld_twin_core import __version__
from weld_twin_core.errors import DataError
from weld_twin_core.sensitivity import Tolerance
from weld_twin_msgs_py.files.csv_text import csv_text
from weld_twin_msgs_py.files.whole_files import write_text
from weld_twin_msgs_py.files.yaml_file import yaml_text

from .claims_table import cases_csv, claims_csv, claims_markdown
from .figures import Drawing

RESULT, CLAIMS, PAGE = 'sensitivity.json', 'claims.json', 'sensitivity.html'
TASKS, FIGURES = 'tasks', 'figures'


def study_directory(path: Path | str) -> Path:
    """
    Return the directory of a study, with a place for the results of its tasks.

    Raises
    ------
    DataError
        It holds something else.

    """
    place = Path(path)
    if place.exists() and not place.is_dir():
        raise DataError(f"'{place}' is a file; choose another place")
    ours = any((place / name).exists() for name in (TASKS, RESULT, CLAIMS))
    if place.is_dir() and any(place.iterdir()) and not ours:
        raise DataError(f"'{place}' holds something else already; choose another place")
    try:
        (place / TASKS).mkdir(parents=True, exist_ok=True)
    except OSError as error:
        raise DataError(f"'{place}' cannot be written: {error.strerror}") from None
    return place


def write_drawing(place: Path, drawing: Drawing) -> None:
    """Write a figure and its data."""
    write_text(place / f'{drawing.name}.svg', drawing.svg, overwrite=True)
    write_text(place / f'{drawing.name}.csv', drawing.csv, overwrite=True)


def write_study(place: Path, result: dict[str, Any], tolerances: Sequence[Tolerance]) -> None:
    """Write the results of a study, its tolerances and its indices."""
    entries = [tolerance.to_mapping() for tolerance in tolerances]
    write_text(place / 'tolerances.yaml', yaml_text(entries), overwrite=True)
    write_text(place / 'indices.csv', indices_csv(result), overwrite=True)
    write_text(place / RESULT, json_text(result), overwrite=True)


def write_claims(place: Path, result: dict[str, Any]) -> None:
    """Write the claims table in every form, and the measurements behind it."""
    write_text(place / 'claims.csv', claims_csv(result), overwrite=True)
    write_text(place / 'claims-cases.csv', cases_csv(result), overwrite=True)
    write_text(place / 'claims.md', claims_markdown(result), overwrite=True)
    write_text(place / CLAIMS, json_text(result), overwrite=True)


def json_text(value: dict[str, Any]) -> str:
    """Return JSON text; what is not a finite number is null."""
    return json.dumps(_finite({**value, 'version': __version__}), indent=1) + '\n'


def _finite(value: Any) -> Any:
    if isinstance(value, dict):
        return {str(key): _finite(item) for key, item in value.items()}
    if isinstance(value, list | tuple | np.ndarray):
        return [_finite(item) for item in value]
    if isinstance(value, np.generic):
        value = value.item()
    return None if isinstance(value, float) and not isfinite(value) else value


def indices_csv(result: dict[str, Any]) -> str:
    """Return every index of every motion, grouping and output, a row each."""
    header = ('motion', 'by', 'output', 'name', 'S1', 'S1_half', 'ST', 'ST_half')
    return csv_text(header, _rows(result))


def _rows(result: dict[str, Any]) -> Iterator[list[Any]]:
    for motion, outcome in result['motions'].items():
        for by, outputs in outcome['global']['sobol'].items():
            for output, indices in outputs.items():
                for row in indices['indices']:
                    values = [row[key] for key in ('name', 'S1', 'S1_half', 'ST', 'ST_half')]
                    yield [motion, by, output, *values]
