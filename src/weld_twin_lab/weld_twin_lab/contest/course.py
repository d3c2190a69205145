# Copyright 2026 weld_twin contributors
# SPDX-License-Identifier: Apache-2.0
"""Sealed cases put into the open form, and every method run on them, each in its own process."""

from __future__ import annotations

import os
import shlex
import subprocess
import sys
import time
from collections.abc import Callable, Mapping
from dataclasses import dataclass
from pathlib import Path

from weld_twin_core.errors import DataError
from weld_twin_msgs_py.bags import read_recording
from weld_twin_msgs_py.robots import load_robot

from ..blind import layout
from .open_form import Answer, read_answer, write_case

ENTRANTS = (
    'weld_twin',
    'geometry',
    'zero_offset',
    'sparse_regression',
    'gaussian_process',
    'boosted_trees',
    'never_knows',
)
"""Methods of the repository, a file each in `entrants`."""
LIMIT = 300.0
"""Seconds an answer may take; a fit that has not ended by then has lost its way."""
_KIB = 1024 if sys.platform != 'darwin' else 1
"""What the system counts memory in [bytes]."""


@dataclass(frozen=True)
class Run:
    """
    One method on one case.

    Attributes
    ----------
    answer : Answer, optional
        None where it gave none.
    seconds : float [s]
        Of processor time, start of the interpreter included.
    memory_bytes : int
    trouble : str
        Why there is no answer.

    """

    answer: Answer | None
    seconds: float
    memory_bytes: int
    trouble: str = ''


def opened(cases: Path, truths: Path, out: Path) -> list[str]:
    """
    Put sealed cases into the open form; return their names.

    Parameters
    ----------
    cases, truths : Path
        As ``weld-twin blind make`` writes them. Of the truths, only what was commanded while the
        tool was measured is used.
    out : Path
        Cases that are there already are left as they are.

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

    Parameters
    ----------
    names : list of str
        Of `ENTRANTS`.
    entered : list of str
        Others, as NAME=COMMAND.

    Raises
    ------
    DataError
        There is no such entrant, or a command does not say where case and answer go.

    """
    out: dict[str, list[str]] = {}
    for name in names:
        if name not in ENTRANTS:
            raise DataError(f'no entrant is called {name!r}; there are {", ".join(ENTRANTS)}')
        out[name] = [sys.executable, '-m', __package__, name, '{case}', '{out}']
    for text in entered:
        name, _, command = text.partition('=')
        if not name or '{case}' not in command or '{out}' not in command:
            raise DataError(f'--enter takes NAME=COMMAND with {{case}} and {{out}}, got {text!r}')
        out[name] = shlex.split(command)
    return out


def run_all(
    cases: Path,
    names: list[str],
    methods: Mapping[str, list[str]],
    out: Path,
    counts: Mapping[str, int],
    tell: Callable[[str], None],
) -> dict[str, dict[str, Run]]:
    """Return what every method said of every case, by method and case; all take turns."""
    runs: dict[str, dict[str, Run]] = {method: {} for method in methods}
    for name in names:
        for method, words in methods.items():
            place = out / method / name
            runs[method][name] = _one(words, cases / name, place, counts[name])
        tell(name)
    return runs


def _one(words: list[str], case: Path, place: Path, count: int) -> Run:
    place.mkdir(parents=True, exist_ok=True)
    filled = [word.format(case=case, out=place) for word in words]
    with (place / 'said.txt').open('w', encoding='utf-8') as said:
        process = subprocess.Popen(filled, stdout=said, stderr=subprocess.STDOUT)
        used = _waited(process)
    if process.returncode != 0:
        lines = (place / 'said.txt').read_text(encoding='utf-8').strip().splitlines()
        return Run(None, *used, lines[-1] if lines else f'exit code {process.returncode}')
    try:
        return Run(read_answer(place, count), *used)
    except DataError as error:
        return Run(None, *used, str(error))


def _waited(process: subprocess.Popen[bytes]) -> tuple[float, int]:
    """Wait for a process, end it at the limit; return its processor time [s] and memory [bytes]."""
    end = time.monotonic() + LIMIT
    while True:
        done, status, used = os.wait4(process.pid, os.WNOHANG)
        if done:
            process.returncode = os.waitstatus_to_exitcode(status)
            return used.ru_utime + used.ru_stime, used.ru_maxrss * _KIB
        if time.monotonic() > end:
            process.kill()
            end = float('inf')
        time.sleep(0.02)
