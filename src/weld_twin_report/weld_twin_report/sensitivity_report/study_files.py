# Copyright 2026 weld_twin contributors
# SPDX-License-Identifier: Apache-2.0
"""A study run, and its files, each written whole; one that was stopped finds its results again."""

from __future__ import annotations

from collections.abc import Callable, Iterator, Sequence
from contextlib import AbstractContextManager
from pathlib import Path
from typing import Any

from weld_twin_core import __version__
from weld_twin_core.errors import DataError
from weld_twin_core.sensitivity import Tolerance
from weld_twin_msgs_py.files.csv_text import csv_text
from weld_twin_msgs_py.files.whole_files import write_json, write_text
from weld_twin_msgs_py.files.yaml_file import yaml_text
from weld_twin_nodes.offline.output_directory import new_directory
from weld_twin_nodes.offline.task_pool import Pool, Runner, Tell

from .figures import Drawing, draw, drawable
from .setting import Setting
from .study_page import study_page
from .work import run_study

RESULT, CLAIMS, PAGE = 'sensitivity.json', 'claims.json', 'sensitivity.html'
TASKS, FIGURES = 'tasks', 'figures'
Claims = Callable[[Runner, Path], dict[str, Any]]
"""Measures the claims of the paper, writes their files to a folder, and returns them."""


def study_directory(path: Path | str) -> Path:
    """
    Return the directory of a study, with a place for the results of its tasks.

    Raises DataError: it holds something else.
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
    write_json(place / RESULT, {**result, 'version': __version__}, overwrite=True)


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


def make_study(
    out: Path | str,  # directory of the results; one that was begun is continued
    pool: Pool,  # where tasks run
    setting: Setting | None,  # left out, only the claims are studied
    *,
    claims: Claims | None = None,
    tell: Tell | None = None,  # told about progress
    force: bool = False,  # as `new_directory` takes it
) -> Path:
    """Run a study, the claims, or both, write the results and return the page."""
    place = study_directory(out)
    drawings: list[Drawing] = []
    with study_files(place, force) as made:

        def draw_all() -> None:
            assert setting is not None
            drawings.extend(make_figures(made / FIGURES, setting, drawable(setting)))

        with Runner(pool, place / TASKS, tell) as runner:
            study = None if setting is None else run_study(setting, runner, draw_all)
            measured = None if claims is None else claims(runner, made)
        if setting is not None and study is not None:
            write_study(made, study, setting.tolerances)
        write_text(made / PAGE, study_page(study, measured, drawings))
    return place / PAGE


def study_files(place: Path, force: bool) -> AbstractContextManager[Path]:
    """Return where to make files of a study; those that it has already, and does not make, stay."""
    return new_directory(place, mark=PAGE, force=force, adds=True, shared=True)


def make_figures(place: Path, setting: Setting, keys: Sequence[str]) -> list[Drawing]:
    """Draw figures and write them with their data."""
    result = [draw(setting, key) for key in keys]
    drawings = [drawing for drawing in result if drawing is not None]
    for drawing in drawings:
        write_drawing(place, drawing)
    return drawings
