# Copyright 2026 weld_twin contributors
# SPDX-License-Identifier: Apache-2.0
"""The diagnosis: the twin was told nothing of the effects and has to find them in the bag."""

from __future__ import annotations

import numpy as np

from weld_twin_core.diagnosis import diagnose
from weld_twin_core.diagnosis.result import Diagnosis
from weld_twin_core.effects import effects_from_list
from weld_twin_core.recording import Measurements, Recording
from weld_twin_core.twin.twin import Twin
from weld_twin_msgs_py.files.input_files import hashed
from weld_twin_nodes.wording.verdict import verdict

from ..report.diagnosis_files import PAGE, write_results
from .hand_over import Job, Progress

NOISE = 2e-5
"""Standard deviation of a measured coordinate [m], as the live injector has it."""
STEPS = 12
"""About as many things does a diagnosis of a short bag report."""


OPEN = (
    {'effect': 'backlash', 'joint': 'shoulder_pan_joint', 'width': 8e-4},
    {'effect': 'joint_offset', 'joint': 'elbow_joint', 'offset': 3e-4},
)
"""Errors of another robot on the same seam: what the elbow has, its zero or play that the load takes
up, moves the tool alike there."""


def find_causes(job: Job, progress: Progress) -> None:
    """Write the diagnosis, its page and the corrected model, and say the verdict."""
    result = _diagnosed(job, job.recording, progress)
    folder = job.folder / 'diagnosis'
    folder.mkdir()
    write_results(folder, result, [hashed('recording', job.bag)])
    job.lines += ['', *verdict(result), f'diagnosis/{PAGE} has the whole answer']


def leave_open(job: Job, progress: Progress) -> None:
    """Diagnose another robot, of which one seam does not tell everything, and say so."""
    commanded = job.recording.with_measured(None)
    real = Twin(job.robot, effects_from_list(list(OPEN), job.robot)).poses(commanded)
    noise = np.random.default_rng(job.seed).normal(scale=NOISE, size=real.position.shape)
    seen = Measurements(commanded.joints.t, real.position + noise, real.rotation)
    result = _diagnosed(job, commanded.with_measured(seen), progress)
    folder = job.folder / 'open'
    folder.mkdir()
    write_results(folder, result, [])
    job.lines += [
        '',
        'Another robot on the same seam:',
        *verdict(result),
        f'open/{PAGE} says more',
    ]


def _diagnosed(job: Job, recording: Recording, progress: Progress) -> Diagnosis:
    reported: list[str] = []

    def tell(text: str) -> None:
        reported.append(text)
        progress(min(len(reported) / STEPS, 0.99))

    return diagnose([recording], job.robot, progress=tell)
