# Copyright 2026 weld_twin contributors
# SPDX-License-Identifier: Apache-2.0
"""
A command is killed while it changes what lies there already, and looked at; then it runs again.

Half of the kills come at a moment drawn between the start and the end of the command, half just before
one of its changes to files, drawn among them. A kill that came too late is drawn again.
"""

from __future__ import annotations

import os
import shutil
import signal
import subprocess
import sys
import time
from collections.abc import Callable, Mapping
from dataclasses import dataclass
from functools import partial
from pathlib import Path
from typing import TypedDict

import numpy as np

from weld_twin_core.errors import DataError

Words = tuple[object, ...]
"""Of a command, without the name of the program."""
Files = dict[str, bytes]
"""Contents by name."""
VICTIM = 'weld_twin_lab.campaigns.killing.victim'
PATIENCE = 300.0
"""Seconds after which a command that was not killed is taken to hang."""
EARLY = 0.2
"""Share of a command's time before which no kill is drawn: there Python itself is loaded."""
HIDDEN = ('.weld_twin_files.json', '.weld_twin-')
"""The list of our files, and scratch inside a folder; the next run answers for both."""
PERSON: Files = {'notes.txt': b'torch changed on Monday', 'photos/cell.jpg': b'\xff\xd8\xff\xe0'}
"""What lies beside the result, and nobody asked to be changed."""


class KillRow(TypedDict):
    """What came of a kill; `lost` and `half` are sentences, empty for none."""

    case: str
    how: str
    lost: str
    half: str
    mixed: bool


@dataclass(frozen=True)
class Kill:
    """When a command is killed: after seconds, or at a change to files; 0 for never."""

    seconds: float = 0.0
    change: int = 0

    @property
    def how(self) -> str:
        """Return it in words."""
        return f'at change {self.change}' if self.change else f'after {self.seconds:.3f} s'


def run_killed(words: Words, kill: Kill) -> bool:
    """
    Run a command and kill it; return whether it was still running.

    Raises
    ------
    DataError
        It ended with an error of its own.

    """
    process = _started(words, kill.change)
    try:
        _, err = process.communicate(timeout=kill.seconds or PATIENCE)
    except subprocess.TimeoutExpired:
        process.kill()
        process.communicate()
    if process.returncode == -signal.SIGKILL:
        return True
    if process.returncode:
        raise DataError(f'weld-twin {words[0]} ended with {process.returncode}: {err.strip()}')
    return False


def _started(words: Words, change: int) -> subprocess.Popen[str]:
    told = [sys.executable, '-m', VICTIM, str(change), *map(str, words)]
    one = {**os.environ, 'OMP_NUM_THREADS': '1', 'OPENBLAS_NUM_THREADS': '1'}
    return subprocess.Popen(
        told, stdout=subprocess.DEVNULL, stderr=subprocess.PIPE, text=True, env=one
    )


def measured(words: Words) -> tuple[float, int]:
    """Return how long a command takes [s], and how often it changes files."""
    began = time.monotonic()
    process = _started(words, 0)
    _, err = process.communicate(timeout=PATIENCE)
    if process.returncode:
        raise DataError(f'weld-twin {words[0]} ended with {process.returncode}: {err.strip()}')
    return time.monotonic() - began, int(err.split()[-1])


def drawn(rng: np.random.Generator, seconds: float, changes: int) -> Kill:
    """Return when to kill a command that takes so long and changes files so often."""
    if rng.random() < 0.5:
        return Kill(change=int(rng.integers(1, changes + 1)))
    return Kill(seconds=float(rng.uniform(EARLY * seconds, seconds)))


def files(folder: Path) -> Files:
    """Return what lies in a folder, but for what is ours and hidden."""
    found = {
        path.relative_to(folder).as_posix(): path.read_bytes()
        for path in sorted(folder.rglob('*'))
        if path.is_file()
    }
    return {name: what for name, what in found.items() if not name.startswith(HIDDEN)}


def folder_case(
    name: str, place: Path, words: Callable[[int, Path], Words]
) -> Callable[[np.random.Generator], KillRow]:
    """
    Return what kills a command that writes a folder, which holds an older result and a person's files.

    Parameters
    ----------
    name : str
    place : Path
        To work in.
    words : callable
        Takes 0 for the older result, 1 for the newer one, and the folder; returns the command.

    """
    old, new = (place / key / 'out' for key in ('old', 'new'))
    measured(words(0, old))
    measured(words(1, new))
    before, after = files(old), files(new)
    for file, what in PERSON.items():
        (old / file).parent.mkdir(parents=True, exist_ok=True)
        (old / file).write_bytes(what)
    shutil.copytree(old, place / 'again/out')
    took = measured(
        words(1, place / 'again/out')
    )  # where files are in the way there is more to do
    return partial(_kill_folder, name, place / 'out', words, old, before, after, took)


def _kill_folder(
    name: str,
    place: Path,
    words: Callable[[int, Path], Words],
    old: Path,
    before: Files,
    after: Files,
    took: tuple[float, int],
    rng: np.random.Generator,
) -> KillRow:
    out = place / 'found'
    there = bool(rng.random() < 0.75)
    while True:
        shutil.rmtree(place, ignore_errors=True)
        place.mkdir()
        if there:
            shutil.copytree(old, out)
        kill = drawn(rng, *took)
        if run_killed(words(1, out), kill):
            break
    person = PERSON if there else {}
    left = files(out)
    row = KillRow(
        case=name,
        how=kill.how + ('' if there else ', into a new folder'),
        lost=_lost(left, person),
        half=_half({k: v for k, v in left.items() if k not in person}, before, after, there),
        mixed=there and not _is_one(left, before, after),
    )
    run_killed(words(1, out), Kill())
    if files(out) != {**after, **person}:
        row['lost'] = row['lost'] or 'the next run does not make the whole result'
    if [path.name for path in place.iterdir()] != ['found'] or list(out.glob('.weld_twin-*')):
        row['half'] = row['half'] or 'scratch is left after the next run'
    return row


def _lost(left: Mapping[str, bytes], person: Mapping[str, bytes]) -> str:
    gone = [name for name, what in person.items() if left.get(name) != what]
    return f"a person's files are gone or changed: {', '.join(gone)}" if gone else ''


def _half(left: Files, before: Files, after: Files, there: bool) -> str:
    """Return what is neither of the older result nor of the newer one, or lacks."""
    if not there:
        return '' if left in ({}, after) else 'a new folder holds a part of the result'
    odd = [name for name, what in left.items() if what not in (before.get(name), after.get(name))]
    odd += [name for name in before.keys() & after.keys() if name not in left]
    return f'neither of the older nor of the newer result: {", ".join(odd)}' if odd else ''


def _is_one(left: Files, before: Files, after: Files) -> bool:
    ours = {name: what for name, what in left.items() if name not in PERSON}
    return ours in (before, after)


def file_case(
    name: str,
    place: Path,
    old: Path,
    words: Callable[[Path], Words],
    told: Callable[[Path], str],
) -> Callable[[np.random.Generator], KillRow]:
    """
    Return what kills a command that changes one file, such as a database.

    Parameters
    ----------
    name : str
    place : Path
        To work in.
    old : Path
        The file before; it stays as it is.
    words : callable
        Takes the file; returns the command.
    told : callable
        Takes the file; returns what it holds, as text.

    """
    new = place / 'new.db'
    shutil.copy(old, new)
    took = measured(words(new))
    before, after = told(old), told(new)

    def once(rng: np.random.Generator) -> KillRow:
        folder = place / 'out'
        while True:
            shutil.rmtree(folder, ignore_errors=True)
            folder.mkdir()
            shutil.copy(old, folder / 'file')
            kill = drawn(rng, *took) if took[1] else Kill(took[0] * rng.uniform(EARLY, 1.0))
            if run_killed(words(folder / 'file'), kill):
                break
        half = '' if told(folder / 'file') in (before, after) else 'neither the old nor the new'
        run_killed(words(folder / 'file'), Kill())
        lost = '' if told(folder / 'file') == after else 'the next run does not make it whole'
        return KillRow(case=name, how=kill.how, lost=lost, half=half, mixed=False)

    return once
