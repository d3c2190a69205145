# Copyright 2026 weld_twin contributors
# SPDX-License-Identifier: Apache-2.0
"""Sealed cases put into the open form, and every method run on them, each in its own process."""

from __future__ import annotations

import shlex
import shutil
import sys
from collections.abc import Callable, Mapping, Sequence
from dataclasses import dataclass, replace
from importlib import import_module
from pathlib import Path
from typing import Any

from weld_twin_core.errors import DataError
from weld_twin_msgs_py.bags import read_recording
from weld_twin_msgs_py.files.whole_files import read_json, write_json
from weld_twin_msgs_py.robots import load_robot

from ..benchmark.costs import cost_of
from ..blind import layout
from .open_form import ContestAnswer, read_answer, write_case

ENTRANTS = (
    'weld_twin',
    'geometry',
    'zero_offset',
    'sparse_regression',
    'gaussian_process',
    'bayesian_linear',
    'bootstrap',
    'boosted_trees',
    'never_knows',
)
"""Methods of the repository, a file each in `entrants`."""
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
    names = [str(entry['name']) for entry in layout.read(cases / layout.CASES)['cases']]
    for name in names:
        if (out / name).exists():
            continue
        said = layout.read(cases / name / layout.CASE)
        file = cases / name / layout.ROBOT
        robot = load_robot(str(file))
        train = read_recording(cases / name / layout.TRAIN, robot)
        ask = read_recording(truths / name / layout.TEST, robot)
        known = (cases / name / layout.KNOWN).read_text(encoding='utf-8') if said['known'] else ''
        write_case(
            out / name,
            file,
            (train, ask),
            {'align': said['align'], 'exclude': said['exclude'], 'known': known},
        )
    return names


def commands(names: list[str], entered: list[str]) -> dict[str, list[str]]:
    """
    Return the command of every method, with {case} and {out} in it.

    names: of `ENTRANTS`.
    entered: others, as NAME=COMMAND.

    Raises DataError: there is no such entrant, or it cannot be loaded, or a command does not say
    where case and answer go.
    """
    out: dict[str, list[str]] = {}
    for name in names:
        if name not in ENTRANTS:
            raise DataError(f'no entrant is called {name!r}; there are {", ".join(ENTRANTS)}')
        try:
            import_module(f'{__package__}.entrants.{name}')
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
    """
    Return what every method said of every case, by method and case; all take turns.

    A method that has been run on a case is not run again: ``out`` keeps what came of it.
    """
    runs: dict[str, dict[str, Run]] = {method: {} for method in methods}
    for name in names:
        for method, words in methods.items():
            place = out / method / name
            if not (place / RUN).exists():
                _start(words, cases / name, place)
            runs[method][name] = _kept(place, counts[name])
        tell(name)
    return runs


def _start(words: Sequence[str], case: Path, place: Path) -> None:
    """Have a case answered, and keep what that took."""
    shutil.rmtree(place, ignore_errors=True)
    place.mkdir(parents=True)
    write_json(place / RUN, ended(words, case, place))


def _kept(place: Path, count: int) -> Run:
    """Return what came of a run; an answer out of form is none."""
    run = Run(None, **read_json(place / RUN))
    try:
        return run if run.trouble else replace(run, answer=read_answer(place, count))
    except DataError as error:
        return replace(run, trouble=str(error))


def ended(words: Sequence[str], case: Path, place: Path) -> dict[str, Any]:
    """
    Have the answer to a case written to a place; return what a `Run` says of it beside the answer.

    words: the command of a method, with {case} and {out} in it.
    """
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
