# Copyright 2026 weld_twin contributors
# SPDX-License-Identifier: Apache-2.0
"""Cases from two measured arms, from few stations or a small region to half of all; and the page."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import replace
from pathlib import Path

import numpy as np

from weld_twin_core.arm import catalog
from weld_twin_core.arrays import Array
from weld_twin_core.recording import Recording
from weld_twin_msgs_py.files.markdown import table

from ..blind.achieved import measured_of
from ..real_arms.splits import all_splits
from ..real_arms.unseen import ALIGN, plain_fit
from .case import case_of, put
from .course import Run

KINDS = ('n30', 'wrist_10deg', 'octant_0', 'odd')
"""Splits that are asked: few stations, two narrow regions that are asked about outside, and half
of all."""
Errors = dict[str, dict[str, float]]
"""Mean errors [m] by method and case."""


def arm_cases(ur5: Path, ur10: Path, out: Path) -> dict[str, Array]:
    """
    Write the cases of both arms; return what was measured where they ask, (M, 3) [m], by name.

    Nobody measured base and tool frame; the nominal arm's are fitted on the stations of the case,
    the same for all methods. They are told as frames that are not known. Where a region was left, it
    is asked outside of it.

    ur5, ur10: directories of the published tables; see docs/real_arms.md.

    Raises DataError: a table is missing or cannot be read.
    """
    measured = {}
    for split in all_splits(ur5, ur10):
        if split.kind in KINDS:
            ask = split.inside if split.outside is None else split.outside
            assert ask is not None
            framed = plain_fit(split.train, catalog.load(split.robot), (), ALIGN)
            robot = framed.robot.with_frames(base=framed.bases[0])
            put(out / split.name, case_of(robot, _places(split.train), ask, tuple(sorted(ALIGN))))
            measured[split.name] = measured_of(ask).position
    return measured


def _places(recording: Recording) -> Recording:
    """Return the recording without orientations: few methods can use them."""
    return recording.with_measured(replace(measured_of(recording), rotation=None))


def lefts(runs: Mapping[str, Mapping[str, Run]], measured: Mapping[str, Array]) -> Errors:
    """Return the mean error [m] of every method on every case that it answered."""
    return {
        method: {
            name: float(np.linalg.norm(measured[name] - run.answer.predicted, axis=1).mean())
            for name, run in said.items()
            if run.answer is not None
        }
        for method, said in runs.items()
    }


def arm_table(by_method: Mapping[str, Mapping[str, float]], names: list[str]) -> str:
    """Return mean errors in millimetres, a row for each method, the least bold, in Markdown."""
    best = {
        name: min((errors[name] for errors in by_method.values() if name in errors), default=0.0)
        for name in names
    }
    rows: list[list[object]] = [['method', *names]]
    for method, errors in by_method.items():
        cells = [_millimetres(errors.get(name), best[name]) for name in names]
        rows.append([method, *cells])
    return table(*rows)


def _millimetres(error: float | None, best: float) -> str:
    """Return an error [m] in millimetres; '-' where there is none, bold where it is the least."""
    if error is None:
        return '-'
    return f'**{1e3 * error:.3f}**' if error == best else f'{1e3 * error:.3f}'


def page(table: str, errors: Errors, measured: Mapping[str, Array]) -> str:
    """
    Return the page in Markdown.

    table: all methods on the sealed cases, as `scores.page` gives it.
    errors: on the measured arms, as `arms.lefts` gives them; empty where these were not asked.
    measured: what was measured there, shape (M, 3) [m].
    """
    parts = [f'## On sealed cases\n\n{table}']
    if errors:
        parts.append(_on_arms(errors, measured))
    return '\n'.join(parts)


def _on_arms(errors: Errors, measured: Mapping[str, Array]) -> str:
    asked = ', '.join(f'{name} {len(rows)}' for name, rows in measured.items())
    return (
        '## On two measured arms\n\nMean error [mm] on the stations asked for; the least on every '
        'split is bold. `n30` is thirty stations, `wrist_10deg` and `octant_0` are narrow regions '
        f'asked about outside of them, `odd` is every second station.\n\n'
        f'{arm_table(errors, list(measured))}\nStations asked for: {asked}.\n'
    )
