# Copyright 2026 weld_twin contributors
# SPDX-License-Identifier: Apache-2.0
"""How a method is started: cold, as any program; or warm, a fork of one that has its libraries."""

from __future__ import annotations

import json
import os
import resource
import subprocess
import sys
import time
from collections.abc import Callable, Sequence
from pathlib import Path
from typing import NamedTuple, Protocol

from weld_twin_core.errors import DataError

from ..benchmark.costs import cost_of

SAID = 'said.txt'
"""What a method printed while it worked."""
LIMIT = 300.0
"""Seconds an answer may take; a fit that has not ended by then has lost its way."""
_KIB = 1024 if sys.platform != 'darwin' else 1
"""What the system counts memory in [bytes]."""
_PAUSE = 0.02
"""Seconds between two looks whether a method has ended."""


class Ended(NamedTuple):
    """
    How a run ended.

    Attributes
    ----------
    seconds : float [s]
        Of processor time, the start of the interpreter and its imports included.
    memory_bytes : int
    trouble : str
        The last that it said where it failed; empty where it did not.

    """

    seconds: float
    memory_bytes: int
    trouble: str = ''


class Starter(Protocol):
    """What runs a method on one case."""

    def run(self, case: Path, place: Path) -> Ended:
        """Have the answer to a case written to a place."""

    def close(self) -> None:
        """Let go of what is kept between cases."""


class Cold:
    """
    A program that is started anew for every case.

    Parameters
    ----------
    words : sequence of str
        Its command, with {case} and {out} in it.

    """

    def __init__(self, words: Sequence[str]) -> None:
        self._words = words

    def run(self, case: Path, place: Path) -> Ended:
        """Have the answer to a case written to a place."""
        filled = [word.format(case=case, out=place) for word in self._words]
        with (place / SAID).open('w', encoding='utf-8') as said:
            code, cost = cost_of(filled, said=said, limit=LIMIT)
        return Ended(cost.cpu, int(cost.peak), _trouble(place, code))

    def close(self) -> None:
        """Do nothing: no process is kept."""


class Warm:
    """
    A program that loads its libraries once and answers every case in a fork of its own.

    What the libraries took to load is counted with every case, as if each had loaded them.

    Parameters
    ----------
    words : sequence of str
        Its command; see `serve`.

    """

    def __init__(self, words: Sequence[str]) -> None:
        self._words = words
        self._process: subprocess.Popen[str] | None = None
        self._start = 0.0

    def run(self, case: Path, place: Path) -> Ended:
        """Have the answer to a case written to a place."""
        if self._process is None:
            self._process = subprocess.Popen(
                self._words, stdin=subprocess.PIPE, stdout=subprocess.PIPE, text=True
            )
            self._start = float(self._line()[0])
        assert self._process.stdin is not None
        self._process.stdin.write(json.dumps([str(case), str(place)]) + '\n')
        self._process.stdin.flush()
        code, seconds, memory = self._line()
        return Ended(self._start + float(seconds), int(memory), _trouble(place, int(code)))

    def _line(self) -> list[float]:
        """Return the next thing the program tells; it is asked for one at a time."""
        assert self._process is not None
        assert self._process.stdout is not None
        told = self._process.stdout.readline()
        if not told:
            code = self._process.wait()
            raise DataError(
                f'the method {self._words[-1]!r} ended with {code} before it could answer; run '
                "pip install 'weld-twin[bench,contest]', or leave it out of --entrants"
            )
        out: list[float] = json.loads(told)
        return out

    def close(self) -> None:
        """End the program."""
        if self._process is not None:
            self._process.communicate()
            self._process = None


def serve(answer: Callable[[Path, Path], None]) -> None:
    """
    Answer cases, each in a fork, until nobody asks any more.

    Reads a line ``[case, out]`` of JSON for each from stdin. Tells in lines of JSON on stdout what
    it took to get here, and of each answer exit code, processor seconds and bytes.

    Parameters
    ----------
    answer : callable
        Reads a case, a directory, and writes the answer to another.

    """
    own = resource.getrusage(resource.RUSAGE_SELF)
    print(json.dumps([own.ru_utime + own.ru_stime]), flush=True)
    for line in sys.stdin:
        case, place = (Path(part) for part in json.loads(line))
        pid = os.fork()
        if pid == 0:
            _in_fork(answer, case, place)
        print(json.dumps(waited(pid)), flush=True)


def _in_fork(answer: Callable[[Path, Path], None], case: Path, place: Path) -> None:
    """Answer one case and end; what is printed goes to a file."""
    code = 1
    said = os.open(place / SAID, os.O_WRONLY | os.O_CREAT | os.O_TRUNC, 0o644)
    os.dup2(said, 1)
    os.dup2(said, 2)
    try:
        answer(case, place)
        code = 0
    except BaseException as error:  # whatever it is, it ends this case alone
        print(f'{type(error).__name__}: {error}', file=sys.stderr)
    sys.stdout.flush()
    sys.stderr.flush()
    os._exit(code)


def waited(pid: int) -> tuple[int, float, int]:
    """
    Wait for a process and end it at the limit.

    Returns
    -------
    tuple of int, float and int
        Exit code, processor time [s] and largest memory [bytes].

    """
    end = time.monotonic() + LIMIT
    while True:
        done, status, used = os.wait4(pid, os.WNOHANG)
        if done:
            code = os.waitstatus_to_exitcode(status)
            return code, used.ru_utime + used.ru_stime, used.ru_maxrss * _KIB
        if time.monotonic() > end:
            os.kill(pid, 9)
            end = float('inf')
        time.sleep(_PAUSE)


def _trouble(place: Path, code: int) -> str:
    """Return the last line that a program said before it failed; nothing where it did not."""
    if code == 0:
        return ''
    lines = (place / SAID).read_text(encoding='utf-8').strip().splitlines()
    return lines[-1] if lines else f'exit code {code}'
