# Copyright 2026 weld_twin contributors
# SPDX-License-Identifier: Apache-2.0
"""Sealed cases as methods see them, and every method run on them, each in its own process."""

from __future__ import annotations

import json
import shutil
import sys
from collections.abc import Callable, Sequence
from dataclasses import dataclass
from pathlib import Path
from typing import NamedTuple

from weld_twin_core.errors import DataError
from weld_twin_core.recording import Recording
from weld_twin_msgs_py.bags import read_recording
from weld_twin_msgs_py.files.whole_files import write_text
from weld_twin_msgs_py.robots import load_robot

from ..benchmark.costs import cost_of
from ..blind import layout
from .case import ContestAnswer, answer_at, case_at, case_of, put
from .entrants import ENTRANTS, entrant

ANSWER, SAID = 'answer', 'said.txt'
"""What a method answered, and what it printed while it worked."""
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
    """Of processor time, start of the interpreter included [s]."""
    memory_bytes: int
    trouble: str = ''
    """Why there is no answer."""


class Ended(NamedTuple):
    """How a run ended."""

    seconds: float
    """Of processor time, the start of the interpreter and its imports included [s]."""
    memory_bytes: int
    trouble: str = ''
    """The last that it said where it failed; empty where it did not."""


def opened(cases: Path, truths: Path, out: Path) -> list[str]:
    """
    Make sealed cases what methods see; return their names.

    cases, truths: as ``weld-twin lab blind make`` writes them. Of the truths, only what was
    commanded while the tool was measured is used.
    out: cases that are there already are left as they are.
    """
    names = [str(entry['name']) for entry in layout.read(cases / layout.CASES)['cases']]
    for name in names:
        if (out / name).exists():
            continue
        said = layout.read(cases / name / layout.CASE)
        robot = load_robot(str(cases / name / layout.ROBOT))
        train, ask = (
            _sent(read_recording(place / name / use, robot))
            for place, use in ((cases, layout.TRAIN), (truths, layout.TEST))
        )
        known = (cases / name / layout.KNOWN).resolve() if said['known'] else None
        exclude = tuple(said['exclude'])
        put(
            out / name,
            case_of(robot, train, ask, tuple(said['align']), exclude=exclude, known=known),
        )
    return names


def _sent(one: Recording) -> Recording:
    """Return what was commanded and measured in a recording, and nothing that a reader adds."""
    return Recording(
        one.name, one.joints, one.measured, one.wrench, one.wrench_frame, one.temperature
    )


def loaded(names: Sequence[str]) -> None:
    """
    Refuse methods that cannot take part.

    Raises DataError: there is no such entrant, or it cannot be loaded.
    """
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


def run_all(
    cases: Path,
    names: Sequence[str],
    methods: Sequence[str],
    out: Path,
    tell: Callable[[str], None],
) -> dict[str, dict[str, Run]]:
    """
    Return what every method said of every case, by method and case; all take turns.

    A method that has been run on a case is not run again: ``out`` keeps what came of it.
    """
    runs: dict[str, dict[str, Run]] = {method: {} for method in methods}
    for name in names:
        count = case_at(cases / name).times.size
        for method in methods:
            place = out / method / name
            if not (place / RUN).exists():
                shutil.rmtree(place, ignore_errors=True)
                place.mkdir(parents=True)
                end = ended([sys.executable, '-m', str(__package__), method], cases / name, place)
                write_text(place / RUN, json.dumps(end._asdict(), indent=1) + '\n')
            runs[method][name] = _kept(place, count)
        tell(name)
    return runs


def _kept(place: Path, count: int) -> Run:
    """Return what came of a run; an answer out of form is none."""
    end = Ended(**json.loads((place / RUN).read_text(encoding='utf-8')))
    used = end.seconds, end.memory_bytes
    if end.trouble:
        return Run(None, *used, end.trouble)
    try:
        return Run(answer_at(place / ANSWER, count), *used)
    except DataError as error:
        return Run(None, *used, str(error))


def ended(words: Sequence[str], case: Path, place: Path) -> Ended:
    """
    Have the answer to a case written to a place.

    words: what is started, with the case and where the answer goes after them.
    """
    with (place / SAID).open('w', encoding='utf-8') as said:
        code, cost = cost_of([*words, str(case), str(place / ANSWER)], said=said, limit=LIMIT)
    trouble = ''
    if code:
        lines = (place / SAID).read_text(encoding='utf-8').strip().splitlines()
        trouble = lines[-1] if lines else f'exit code {code}'
    return Ended(cost.cpu, int(cost.peak), trouble)
