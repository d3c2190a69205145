# Copyright 2026 weld_twin contributors
# SPDX-License-Identifier: Apache-2.0
"""Reading many broken files, each within bounds of time and memory."""

from __future__ import annotations

import faulthandler
import os
import resource
import signal
import tempfile
import traceback
import warnings
from collections.abc import Callable, Iterator
from contextlib import contextmanager
from dataclasses import dataclass
from multiprocessing import get_context
from multiprocessing.connection import Connection
from pathlib import Path
from random import Random
from typing import Any

from weld_twin_core.errors import TwinError

from .mutate import mutate
from .targets import Target, targets

CPU_LIMIT = 10.0
"""Seconds of computing a file may cost."""
WALL_LIMIT = 120.0
"""Seconds after which a reader that computes nothing is taken to hang."""
MEMORY_LIMIT = 1_000_000_000
"""Bytes a file may cost."""
BATCH = 400
"""Files read by one process."""


class Hang(BaseException):
    """The file has cost too much time; no `except Exception` takes it for damage."""


@dataclass
class Finding:
    """What a file did that it should not."""

    target: str
    case: int
    """With the seed of the campaign it makes the same file again."""
    what: str
    """Exception and the place in this project's code where it came from."""
    times: int = 1


@dataclass
class Tally:
    """How many files were read, refused in a sentence, or went wrong."""

    right: int = 0
    refused: int = 0
    wrong: int = 0


def case_bytes(target: Target, seed: int, name: str, case: int) -> bytes:
    """Return the broken file of a number."""
    rng = Random(f'{seed}/{name}/{case}')
    return mutate(rng, rng.choice(target.seeds), target.kind)


def hunt(name: str, seed: int, cases: int, known: dict[str, Finding]) -> Tally:
    """Read so many broken files of a kind; add what went wrong to what is known."""
    tally = Tally()
    done = 0
    while done < cases:
        last = min(done + BATCH, cases)
        with forked(_batch, name, seed, done, last) as here:
            done = _follow(here, name, done, last, tally, known)
    return tally


@contextmanager
def forked(work: Callable[..., None], *given: Any) -> Iterator[Connection]:
    """Yield what a process of its own sends; it gets the other end as its last argument."""
    context = get_context('fork')
    here, there = context.Pipe(duplex=False)
    process = context.Process(target=work, args=(*given, there))
    process.start()
    there.close()
    try:
        yield here
    finally:
        process.kill()
        process.join()


def next_outcome(here: Connection) -> str:
    """Return what a process sends next, or why nothing came."""
    try:
        return str(here.recv()) if here.poll(WALL_LIMIT) else 'hangs without computing'
    except EOFError:
        return 'ends the process'


def _follow(
    here: Connection, name: str, case: int, last: int, tally: Tally, known: dict[str, Finding]
) -> int:
    """Take the results of a process until it ends; return the next case."""
    while case < last:
        outcome = next_outcome(here)
        if outcome == 'right':
            tally.right += 1
        elif outcome == 'refused':
            tally.refused += 1
        else:
            tally.wrong += 1
            finding = known.setdefault(f'{name}: {outcome}', Finding(name, case, outcome, 0))
            finding.times += 1
        case += 1
        if outcome.startswith(('hangs', 'ends', 'takes')):
            return case
    return case


def _batch(name: str, seed: int, first: int, last: int, out: Connection) -> None:
    target = targets()[name]
    guard()
    before = peak()
    with tempfile.TemporaryDirectory() as place:
        path = Path(place) / f'case{target.suffix}'
        for case in range(first, last):
            path.write_bytes(case_bytes(target, seed, name, case))
            outcome = read(target, path)
            if peak() - before > MEMORY_LIMIT:
                outcome = f'takes more than {MEMORY_LIMIT / 1e6:.0f} MB'
            out.send(outcome)
            if outcome.startswith('takes'):
                break
    out.close()
    os._exit(0)


def guard() -> None:
    """Bound what this process may take from now on."""
    faulthandler.disable()
    os.dup2(os.open(os.devnull, os.O_WRONLY), 2)  # the URDF parser comments on what it passes over
    warnings.simplefilter('ignore')
    signal.signal(signal.SIGPROF, _stop)
    pages = int(Path('/proc/self/statm').read_text().split()[0])
    limit = MEMORY_LIMIT * 2 + pages * resource.getpagesize()
    resource.setrlimit(resource.RLIMIT_AS, (limit, limit))


def read(target: Target, path: Path) -> str:
    """Return 'right' or 'refused', or what is wrong with how the file was taken."""
    signal.setitimer(signal.ITIMER_PROF, CPU_LIMIT)
    try:
        target.read(path)
    except TwinError as error:
        text = str(error)
        if '\n' in text or not text:
            return f'is refused in more than a sentence: {text[:80]!r}'
        return 'refused'
    except Hang:
        return f'hangs for {CPU_LIMIT:g} s of computing'
    except Exception as error:
        return f'{type(error).__name__} at {_place(error)}'
    finally:
        signal.setitimer(signal.ITIMER_PROF, 0.0)
    return 'right'


def _place(error: BaseException) -> str:
    """Return the last line of this project's own code in a traceback."""
    own = [
        frame
        for frame in traceback.extract_tb(error.__traceback__)
        if 'weld_twin' in frame.filename and 'fuzzing' not in frame.filename
    ]
    if not own:
        return 'an unknown place'
    return f'{Path(own[-1].filename).name}:{own[-1].lineno} {own[-1].name}'


def _stop(*_: Any) -> None:
    raise Hang


def peak() -> int:
    """Return the most memory this process has held [bytes]."""
    return resource.getrusage(resource.RUSAGE_SELF).ru_maxrss * 1024
