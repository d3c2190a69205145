# Copyright 2026 weld_twin contributors
# SPDX-License-Identifier: Apache-2.0
"""Sealed cases put into the open form, and every method run on them, each in its own process."""

from __future__ import annotations

import json
import shlex
import shutil
import sys
from collections.abc import Callable, Mapping, Sequence
from dataclasses import dataclass, replace
from pathlib import Path
from tempfile import TemporaryDirectory
from typing import Any

import numpy as np

from weld_twin_core.arm import catalog
from weld_twin_core.arrays import Array
from weld_twin_core.errors import DataError
from weld_twin_core.recording import Recording
from weld_twin_msgs_py.bags import read_recording
from weld_twin_msgs_py.files.markdown import table
from weld_twin_msgs_py.files.whole_files import read_json, write_json, write_text
from weld_twin_msgs_py.files.yaml_file import yaml_text
from weld_twin_msgs_py.robots import load_robot

from ..benchmark.costs import cost_of
from ..blind import seal
from ..real_arms.sources import Split, all_splits
from ..real_arms.unseen import ALIGN, plain_fit
from .entrants import ENTRANTS, entrant
from .open_form import ContestAnswer, read_answer, write_case

SAID = 'said.txt'
"""What a method printed while it worked."""
LIMIT = 300.0
"""Seconds an answer may take; a fit that has not ended by then has lost its way."""
RUN = 'run.json'
"""What a run took, beside its answer: a contest that was stopped goes on from there."""


@dataclass(frozen=True)
class Run:
    """One method on one case."""

    answer: ContestAnswer | None
    """None where it gave none."""
    seconds: float
    """Of processor time, the start of the interpreter and its imports included [s]."""
    memory_bytes: int
    trouble: str = ''
    """Why there is no answer: the last that it said where it failed."""


def opened(cases: Path, truths: Path, out: Path) -> list[str]:
    """
    Put sealed cases into the open form; return their names.

    cases, truths: as ``weld-twin lab blind make`` writes them. Of the truths, only what was
    commanded while the tool was measured is used.
    out: cases that are there already are left as they are.
    """
    names = [str(entry['name']) for entry in seal.read(cases / seal.CASES)['cases']]
    for name in names:
        if (out / name).exists():
            continue
        said = seal.read(cases / name / seal.CASE)
        file = cases / name / seal.ROBOT
        robot = load_robot(str(file))
        train = read_recording(cases / name / seal.TRAIN, robot)
        ask = read_recording(truths / name / seal.TEST, robot)
        known = (cases / name / seal.KNOWN).read_text(encoding='utf-8') if said['known'] else ''
        write_case(
            out / name,
            file,
            (train, ask),
            {'align': said['align'], 'exclude': said['exclude'], 'known': known},
        )
    return names


def commands(names: list[str], entered: list[str]) -> dict[str, list[str]]:
    """
    Return the command of every entrant, and of others entered as NAME=COMMAND, with {case} and {out}.

    Raises DataError: there is no such entrant, it cannot be loaded, or a command lacks a place.
    """
    out: dict[str, list[str]] = {}
    for name in names:
        if name not in ENTRANTS:
            raise DataError(f'no entrant is called {name!r}; there are {", ".join(ENTRANTS)}')
        try:
            entrant(name)
        except ImportError as error:
            raise DataError(
                f'the method {name!r} cannot be loaded ({error}); run '
                "pip install 'weld-twin[bench,contest]', or leave it out of --entrants"
            ) from None
        out[name] = [sys.executable, '-m', str(__package__), name, '{case}', '{out}']
    for text in entered:
        name, _, command = text.partition('=')
        if not name or '{case}' not in command or '{out}' not in command:
            raise DataError(f'--enter takes NAME=COMMAND with {{case}} and {{out}}, got {text!r}')
        out[name] = shlex.split(command)
    return out


def run_all(
    cases: Path,
    names: list[str],
    methods: Mapping[str, Sequence[str]],
    out: Path,
    counts: Mapping[str, int],
    tell: Callable[[str], None],
) -> dict[str, dict[str, Run]]:
    """Return what every method said of every case; all take turns, and ``out`` keeps what came of it."""
    runs: dict[str, dict[str, Run]] = {method: {} for method in methods}
    for name in names:
        for method, words in methods.items():
            place = out / method / name
            if not (place / RUN).exists():
                shutil.rmtree(place, ignore_errors=True)
                place.mkdir(parents=True)
                write_json(place / RUN, ended(words, cases / name, place))
            runs[method][name] = _kept(place, counts[name])
        tell(name)
    return runs


def _kept(place: Path, count: int) -> Run:
    """Return what came of a run; an answer out of form is none."""
    run = Run(None, **read_json(place / RUN))
    try:
        return run if run.trouble else replace(run, answer=read_answer(place, count))
    except DataError as error:
        return replace(run, trouble=str(error))


def ended(words: Sequence[str], case: Path, place: Path) -> dict[str, Any]:
    """Have a command answer a case; return what a `Run` says of it beside the answer."""
    filled = [word.replace('{case}', str(case)).replace('{out}', str(place)) for word in words]
    with (place / SAID).open('w', encoding='utf-8') as said:
        code, cost = cost_of(filled, said=said, limit=LIMIT)
    used = {'seconds': cost.cpu, 'memory_bytes': int(cost.peak)}
    return {**used, 'trouble': _trouble(place, code)}


def _trouble(place: Path, code: int) -> str:
    """Return the last line that a program said before it failed; nothing where it did not."""
    if code == 0:
        return ''
    lines = (place / SAID).read_text(encoding='utf-8').strip().splitlines()
    return lines[-1] if lines else f'exit code {code}'


KINDS = ('n30', 'wrist_10deg', 'octant_0', 'odd')
"""Splits that are asked: few stations, two narrow regions that are asked about outside, and half
of all."""
MEASURED = 'measured.json'
"""Where the tool was at the times asked for, beside the cases and not in them."""
Errors = dict[str, dict[str, float]]
"""Mean errors [m] by method and case."""


def arm_cases(ur5: Path, ur10: Path, out: Path) -> dict[str, Array]:
    """
    Write the cases of both arms, or keep them; return what was measured where they ask, (M, 3) [m].

    Nobody measured base and tool frame; the nominal arm's are fitted on the stations of the case,
    the same for all methods. They are told as frames that are not known.

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
    """Return the page: the table of sealed cases, and errors on measured arms where these were asked."""
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
