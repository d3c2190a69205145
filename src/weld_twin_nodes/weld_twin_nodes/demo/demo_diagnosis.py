# Copyright 2026 weld_twin contributors
# SPDX-License-Identifier: Apache-2.0
"""The diagnosis: the twin was told nothing of the effects and has to find them in the bag."""

from __future__ import annotations

from weld_twin_core.diagnosis import diagnose
from weld_twin_msgs_py.files.input_files import hashed

from ..report.diagnosis_files import PAGE, write_results
from ..report.verdict import verdict
from .hand_over import Job, Progress

STEPS = 12
"""About as many things does a diagnosis of a short bag report."""


def find_causes(job: Job, progress: Progress) -> None:
    """Write the diagnosis, its page and the corrected model, and say the verdict."""
    told: list[str] = []

    def tell(text: str) -> None:
        told.append(text)
        progress(min(len(told) / STEPS, 0.99))

    found = diagnose([job.recording], job.robot, progress=tell)
    folder = job.folder / 'diagnosis'
    folder.mkdir()
    write_results(folder, found, [hashed('recording', job.bag)])
    job.lines += ['', *verdict(found), f'diagnosis/{PAGE} has the whole answer']
