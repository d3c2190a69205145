# Copyright 2026 weld_twin contributors
# SPDX-License-Identifier: Apache-2.0
"""
A diagnosis in a process of its own, so that a node goes on listening meanwhile.

Run as a module it is that process: a `Job` comes in, a `Finding` or a sentence goes out.
"""

from __future__ import annotations

import os
import pickle
import subprocess
import sys
from collections.abc import Callable
from concurrent.futures import Future, wait
from typing import TYPE_CHECKING, Any, NamedTuple

from .work_beside import WorkBeside

if TYPE_CHECKING:
    from weld_twin_core.arm.robot import Robot
    from weld_twin_core.effects import Effect
    from weld_twin_core.recording import Recording
    from weld_twin_msgs_py.bags.images import Image
    from weld_twin_msgs_py.messages.topics import TopicNames

_MODULE = 'weld_twin_nodes.live.diagnosis_worker'
_NICENESS = 10
"""Added to that of the node: a diagnosis must not take time from the twin."""
_DEAD_WITHIN = 1.0
"""Seconds to wait for a process that was killed; one that writes to a dead disk may take for ever."""
_LAST = 2000
"""Characters of its standard error that are reported: a traceback has about as many."""


class Job(NamedTuple):
    """What to diagnose."""

    recording: Recording
    robot: Robot
    known: tuple[Effect, ...] = ()
    align: frozenset[str] = frozenset()
    exclude: tuple[str, ...] = ()
    images: tuple[Image, ...] = ()
    names: TopicNames | None = None


class Finding(NamedTuple):
    """What a diagnosis says, as plain values."""

    stamp: int  # of the last measurement looked at [ns]
    status: str
    sentence: str  # the verdict in words
    values: dict[str, Any]  # keys and values of the diagnostic message


class Worker:
    """Runs one job at a time in another process, and tells its errors; nothing waits here."""

    def __init__(self, tell: Callable[[str], object] = sys.stderr.write) -> None:
        self._tell = tell
        self._beside = WorkBeside()
        self._process: subprocess.Popen[bytes] | None = None
        self._doing: Future[Finding | str] | None = None

    @property
    def busy(self) -> bool:
        """Return whether a job is under way."""
        return self._doing is not None and not self._doing.done()

    def start(self, job: Job) -> None:
        """Begin a job; the one before must be finished."""
        self._process = subprocess.Popen(
            [sys.executable, '-m', _MODULE],
            stdin=subprocess.PIPE,
            stdout=subprocess.PIPE,
            stderr=subprocess.PIPE,
        )
        # Handing over the data waits for the other interpreter to be up: not in the caller's time.
        self._doing = self._beside.submit(self._exchange, self._process, job)

    def take(self) -> Finding | str | None:
        """Return the finding or the error of a finished job, once; else None."""
        if self._doing is None or self.busy:
            return None
        done, self._doing = self._doing, None
        return done.result()

    def stop(self) -> None:
        """End the job under way."""
        if self._process is not None:
            self._process.kill()
        if self._doing is not None:
            wait([self._doing], _DEAD_WITHIN)

    def _exchange(self, process: subprocess.Popen[bytes], job: Job) -> Finding | str:
        answer, said = process.communicate(pickle.dumps(job))
        if said and process.returncode >= 0:  # one that was stopped may say anything
            self._tell(f'the diagnosis says: {said.decode(errors="replace").strip()[-_LAST:]}')
        if process.returncode:
            return f'the diagnosis ended with code {process.returncode}'
        result: Finding | str = pickle.loads(answer)
        return result


def find(job: Job) -> Finding:
    from weld_twin_core.diagnosis import diagnose
    from weld_twin_msgs_py.bags.images import looking

    from ..wording.verdict import verdict
    from ..wording.words import effect_name

    recording = job.recording
    if job.images and job.names is not None:
        # Hundreds of images take seconds: here, where no node waits for them.
        recording = looking(recording, job.images, job.names, {})
    diagnosis = diagnose(
        [recording], job.robot, align=job.align, known=job.known, exclude=job.exclude
    )
    gap, shrink = diagnosis.gap, diagnosis.shrink
    values: dict[str, Any] = {
        'status': diagnosis.status,
        'confidence': diagnosis.confidence,
        'sure': diagnosis.sure,
        'gap_rms_m': gap.rms_m,
        'noise_floor_m': gap.noise_floor_m,
        'rms_after_m': shrink.rms_after_m,
        'shrink_ratio': shrink.ratio,
    }
    for item in diagnosis.unsound:
        values[f'unsound: {item.kind}'] = item.sentence
    for result in diagnosis.effects:
        entry = result.effect.to_mapping()
        values[effect_name(result)] = {
            key: value for key, value in entry.items() if key not in ('effect', 'joint')
        }
    measured = recording.measured
    last = float(measured.t[-1]) if measured is not None else 0.0
    stamp = job.recording.epoch_ns + round(last * 1e9)
    return Finding(stamp, diagnosis.status, ' '.join(verdict(diagnosis)), values)


def main() -> int:
    """Do one job from standard input."""
    from weld_twin_core.errors import TwinError

    # A node may run in real time; what it can wait for must not.
    os.sched_setscheduler(0, os.SCHED_OTHER, os.sched_param(0))
    os.nice(_NICENESS)
    answer_to = sys.stdout.buffer
    sys.stdout = sys.stderr
    job = pickle.load(sys.stdin.buffer)
    try:
        result: Finding | str = find(job)
    except TwinError as error:
        result = str(error)
    pickle.dump(result, answer_to)
    answer_to.flush()
    return 0


if __name__ == '__main__':
    # Pickle must find the classes under their real name, not under __main__.
    from .diagnosis_worker import main as _main

    raise SystemExit(_main())
