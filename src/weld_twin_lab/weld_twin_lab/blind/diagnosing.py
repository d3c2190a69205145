# Copyright 2026 weld_twin contributors
# SPDX-License-Identifier: Apache-2.0
"""Diagnose cases from their recordings alone, and keep what was said."""

from __future__ import annotations

import json
import resource
import sys
import time
from pathlib import Path
from typing import Any

from weld_twin_core import __version__
from weld_twin_core.diagnosis import Diagnosis, diagnose
from weld_twin_core.errors import DataError
from weld_twin_msgs_py.bags import read_recording
from weld_twin_msgs_py.files.whole_files import write_text
from weld_twin_msgs_py.robots import load_robot
from weld_twin_nodes.offline.given_twin import build_twin
from weld_twin_nodes.offline.task_pool import Runner, Task
from weld_twin_report.report.diagnosis_files import diagnosis_text

from ..study import engine_digest
from . import seal

_KIB = 1024 if sys.platform != 'darwin' else 1
"""What getrusage counts memory in [bytes]."""


def diagnose_cases(
    cases: Path,
    out: Path,
    runner: Runner,
    *,
    allow_readable: bool = False,
    with_holdout: bool = True,
) -> list[dict[str, Any]]:
    """
    Diagnose all cases, write what was said, and return it case by case.

    with_holdout: judge the shrink on the held-out recording, not on stretches of the training's.

    Raises DataError: truths lie within reach and may not, or the directory holds no cases.
    """
    readable = _truths_readable(cases, allow_readable)
    listed = seal.read(cases / seal.CASES)
    tasks = [
        Task(
            diagnose_case,
            (str(cases / entry['name']), entry['case'], with_holdout),
            entry['name'],
        )
        for entry in listed['cases']
    ]
    verdicts = [_written(out, verdict) for verdict in runner.run(tasks)]
    seal.write(
        out / seal.VERDICTS,
        {
            'seal': listed['seal'],
            'engine': engine_digest(),
            'version': __version__,
            'with_holdout': with_holdout,
            'truths_readable': readable,
            'verdicts': verdicts,
        },
        overwrite=True,
    )
    return verdicts


def _written(out: Path, verdict: dict[str, Any]) -> dict[str, Any]:
    """Write the diagnosis of one case; return what was said of it without that."""
    content = verdict.pop('diagnosis')
    if content is not None:
        file = out / verdict['name'] / seal.DIAGNOSIS
        write_text(file, json.dumps(content, indent=1) + '\n', overwrite=True)
    return verdict


def _truths_readable(cases: Path, allowed: bool) -> bool:
    """Return whether truths lie within reach; refuse that where it is not allowed."""
    truths = seal.truths_within_reach(cases)
    if truths is not None and not allowed:
        raise DataError(
            f"the truths in '{truths}' can be read from here, so this would not be blind; move "
            'them away, or say --allow-readable'
        )
    return truths is not None


def diagnose_case(place: str, digest: str, with_holdout: bool) -> dict[str, Any]:
    """
    Return the diagnosis of one case, how long it took and the memory it needed.

    A case that cannot be diagnosed says so in place of a verdict, so that one case does not stop
    the others; the digest only tells this task from others.
    """
    directory = Path(place)
    start = time.perf_counter()
    answer, failure = None, None
    try:
        diagnosis = diagnosis_of(directory, with_holdout)
        answer = dict(json.loads(diagnosis_text(diagnosis, ())))
    except Exception as error:
        failure = f'{type(error).__name__}: {error}'
    return {
        'name': directory.name,
        'diagnosis': answer,
        'error': failure,
        'seconds': time.perf_counter() - start,
        'memory_bytes': resource.getrusage(resource.RUSAGE_SELF).ru_maxrss * _KIB,
    }


def diagnosis_of(directory: Path, with_holdout: bool = True) -> Diagnosis:
    """Return the diagnosis of the case of a directory; its held-out recording judges the shrink."""
    case = seal.read(directory / seal.CASE)
    known = directory / seal.KNOWN if case['known'] else ''
    twin = build_twin(load_robot(str(directory / seal.ROBOT)), known)
    holdout = [seal.HOLDOUT] if with_holdout else []
    train, *held_out = (
        read_recording(directory / use, twin.robot) for use in (seal.TRAIN, *holdout)
    )
    return diagnose(
        [train],
        twin.robot,
        align=frozenset(case['align']),
        known=twin.effects,
        exclude=case['exclude'],
        holdout=held_out,
    )
