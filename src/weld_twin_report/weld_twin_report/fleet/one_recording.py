# Copyright 2026 weld_twin contributors
# SPDX-License-Identifier: Apache-2.0
"""One recording of a list diagnosed, wherever the task runs, and what became of it as plain data."""

from __future__ import annotations

import shutil
import tempfile
import threading
from dataclasses import asdict
from pathlib import Path
from typing import Any

from weld_twin_core.errors import DataError, TwinError
from weld_twin_msgs_py.files.scratch import Scratch
from weld_twin_nodes.offline.output_directory import new_directory

from ..guarded import Guarded, Limits, Outcome
from ..history import entry_of
from ..history.runs import DONE, FAILED, REFUSED, UNSOUND, Run
from ..report.diagnosis_files import RESULT
from .listed import Listed

STATES = {0: DONE, 2: REFUSED, 3: UNSOUND}
"""By the exit code of ``diagnose``; any other is a failure."""
_mine = threading.local()


def diagnosed(listed: Listed, key: str, limits: Limits, keep: str) -> dict[str, Any]:
    """
    Return how a recording went, and its entry.

    ``key``: of the run. ``keep``: directory for what the command wrote; empty to keep nothing.
    """
    done, entry = Outcome(-1, '', 0.0), None
    try:
        with Scratch(Path(tempfile.gettempdir()), 'weld_twin-fleet-') as place:
            out = place / 'found'
            done = _warm(limits).run(listed.words(out))
            state, sentence, entry = _read(listed, done, out)
            if keep and out.is_dir():
                with new_directory(Path(keep) / key, mark=RESULT, force=True) as kept:
                    shutil.copytree(out, kept, dirs_exist_ok=True)
    except (OSError, DataError) as error:  # the disk is full: this can run again, the others go on
        said = str(error)
        if isinstance(error, OSError):
            where = f" '{error.filename}'" if error.filename else ''
            said = f'{error.strerror or error}{where}'
        state, sentence, entry = FAILED, said, None
    run = Run(key, listed.cell, listed.recording, state, sentence, done.seconds, done.memory)
    return {'run': asdict(run), 'entry': entry}


def _read(listed: Listed, done: Outcome, out: Path) -> tuple[str, str, dict[str, Any] | None]:
    """Return state, sentence and entry of what the command left."""
    state = STATES.get(done.code, FAILED)
    if done.disk_full:
        state = FAILED
    if state == UNSOUND:
        return state, _unsound(out), None
    if state != DONE:
        return state, done.said.removeprefix('weld-twin: '), None
    try:
        entry = entry_of(out, listed.date)
    except TwinError as error:
        return REFUSED, str(error).replace(f'{out}/diagnosis.json', listed.recording), None
    return state, entry.status, entry.plain()


def _unsound(out: Path) -> str:
    """Return what is wrong with data or set-up."""
    from weld_twin_msgs_py.files.diagnosis_model import read_diagnosis

    reported = read_diagnosis(out / 'diagnosis.json').get('unsound') or []
    return str(reported[0]['sentence']) if reported else 'data or set-up are wrong'


def _warm(limits: Limits) -> Guarded:
    """Return this thread's own warm process; it ends with the thread's process."""
    known: tuple[Limits, Guarded] | None = getattr(_mine, 'warm', None)
    if known is None or known[0] != limits:
        if known is not None:
            known[1].close()
        known = _mine.warm = (limits, Guarded(limits))
    return known[1]
