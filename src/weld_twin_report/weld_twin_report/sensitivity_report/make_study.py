# Copyright 2026 weld_twin contributors
# SPDX-License-Identifier: Apache-2.0
"""From a setting to a directory of results."""

from __future__ import annotations

from collections.abc import Sequence
from contextlib import AbstractContextManager
from pathlib import Path

from weld_twin_core.arm.robot import Robot
from weld_twin_msgs_py.files.whole_files import write_text
from weld_twin_nodes.offline.output_directory import new_directory
from weld_twin_nodes.offline.task_pool import Pool, Runner, Tell

from .claims_table import SEAMS, run_claims
from .figures import Drawing, draw, drawable
from .setting import Setting
from .study_files import (
    FIGURES,
    PAGE,
    TASKS,
    study_directory,
    write_claims,
    write_drawing,
    write_study,
)
from .study_page import study_page
from .whole import run_study


def make_study(
    out: Path | str,
    pool: Pool,
    setting: Setting | None,
    *,
    claims_on: Sequence[Robot] = (),
    seams: Sequence[str] = SEAMS,
    tell: Tell | None = None,
    seed: int = 0,
    force: bool = False,
) -> Path:
    """
    Run a study, the claims, or both, write the results and return the page.

    Parameters
    ----------
    out : Path or str
        Directory of the results; one that was begun is continued.
    pool : Pool
        Where tasks run.
    setting : Setting, optional
        Left out, only the claims are studied.
    claims_on : sequence of Robot
        Robots the claims are measured on; none for no claims.
    seams : sequence of str
        Bundled seams the claims are measured on.
    tell : callable, optional
        Told about progress.
    seed : int
        Of the claims.
    force : bool
        As `new_directory` takes it.

    """
    place = study_directory(out)
    drawings: list[Drawing] = []
    with study_files(place, force) as made:

        def draw_all() -> None:
            assert setting is not None
            drawings.extend(make_figures(made / FIGURES, setting, drawable(setting)))

        with Runner(pool, place / TASKS, tell) as runner:
            study = None if setting is None else run_study(setting, runner, draw_all)
            claims = run_claims(runner, claims_on, seams, seed) if claims_on else None
        if setting is not None and study is not None:
            write_study(made, study, setting.tolerances)
        if claims is not None:
            write_claims(made, claims)
        write_text(made / PAGE, study_page(study, claims, drawings))
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
