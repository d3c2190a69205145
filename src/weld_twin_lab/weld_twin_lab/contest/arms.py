# Copyright 2026 weld_twin contributors
# SPDX-License-Identifier: Apache-2.0
"""Cases from two measured arms, from few stations or a small region to half of all; and the page."""

from __future__ import annotations

import json
from collections.abc import Mapping
from dataclasses import replace
from pathlib import Path
from tempfile import TemporaryDirectory

import numpy as np

from weld_twin_core.arm import catalog
from weld_twin_core.arrays import Array
from weld_twin_core.recording import Recording
from weld_twin_msgs_py.files.markdown import table
from weld_twin_msgs_py.files.whole_files import read_json, write_text
from weld_twin_msgs_py.files.yaml_file import yaml_text

from ..real_arms.splits import Split, all_splits
from ..real_arms.unseen import ALIGN, plain_fit
from .course import Run
from .open_form import write_case

KINDS = ('n30', 'wrist_10deg', 'octant_0', 'odd')
"""Splits that are asked: few stations, two narrow regions that are asked about outside, and half
of all."""
MEASURED = 'measured.json'
"""Where the tool was at the times asked for, beside the cases and not in them."""
Errors = dict[str, dict[str, float]]
"""Mean errors [m] by method and case."""


def arm_cases(ur5: Path, ur10: Path, out: Path) -> dict[str, Array]:
    """
    Write the cases of both arms; return what was measured where they ask, (M, 3) [m], by name.

    Nobody measured base and tool frame; the nominal arm's are fitted on the stations of the case,
    the same for all methods. They are told as frames that are not known.

    ur5, ur10: directories of the published tables; see docs/real_arms.md.
    out: cases that are there already are left as they are.

    Raises DataError: a table is missing or cannot be read.
    """
    out.mkdir(parents=True, exist_ok=True)
    if (out / MEASURED).exists():
        return {name: np.array(rows) for name, rows in read_json(out / MEASURED).items()}
    measured: dict[str, Array] = {}
    for split in all_splits(ur5, ur10):
        if split.kind in KINDS:
            measured[split.name] = _written(split, out / split.name)
    content = {name: rows.tolist() for name, rows in measured.items()}
    write_text(out / MEASURED, json.dumps(content) + '\n')
    return measured


def _written(split: Split, folder: Path) -> Array:
    """Write a case; return what it asks for. Where a region was left, it is asked outside of it."""
    ask = split.inside if split.outside is None else split.outside
    assert ask is not None
    assert ask.measured is not None
    framed = plain_fit(split.train, catalog.load(split.robot), (), ALIGN)
    robot = framed.robot.with_frames(base=framed.bases[0])
    with TemporaryDirectory() as place:
        file = Path(place) / 'robot.yaml'
        write_text(file, yaml_text(robot.to_mapping()))
        said = {'align': sorted(ALIGN), 'exclude': [], 'known': ''}
        write_case(folder, file, (_places(split.train), ask), said)
    return np.asarray(ask.measured.position)


def _places(recording: Recording) -> Recording:
    """Return the recording without orientations: few methods can use them."""
    assert recording.measured is not None
    return recording.with_measured(replace(recording.measured, rotation=None))


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
