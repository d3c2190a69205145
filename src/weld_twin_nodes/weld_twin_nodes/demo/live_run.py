# SPDX-FileCopyrightText: weld_twin contributors
# SPDX-License-Identifier: Apache-2.0
"""The live part: generator, injector, twin, analyzer and recorder as processes over DDS."""

from __future__ import annotations

from weld_twin_core.errors import TwinError
from weld_twin_msgs_py.files.yaml_file import yaml_text

from ..harness import Cell, Tap
from .hand_over import Job, Progress

LIMIT = 120.0
"""Seconds the run may take on a slow machine."""


def run_live(job: Job, progress: Progress) -> None:
    """
    Run the motion through the nodes, at the speed they keep up with, and record it.

    Raises
    ------
    TwinError
        A node failed or took too long; the message has its log.

    """
    job.bag = job.folder / 'bag'
    samples = job.plan.motion.t.size
    try:
        with Cell() as cell:
            deviations = _start(cell, job)

            def told() -> bool:
                progress(len(deviations) / samples)
                return len(deviations) == samples

            cell.wait(told, f'{samples} deviations', limit=LIMIT)
            cell.wait_recorded({'/joint_states': samples, '/deviation': samples})
            recorder = cell.processes[0]
            recorder.interrupt()
            if recorder.end() != 0:
                raise TwinError(f'the recorder failed: {recorder.log}')
    except TimeoutError as error:
        raise TwinError(str(error)) from None


def _start(cell: Cell, job: Job) -> Tap:
    """Start the nodes; what listens comes before what speaks, and each waits for the next."""
    common = {'robot': job.robot.name, 'reliable_inputs': True}
    cell.start('recorder', out=str(job.bag), reliable_inputs=True)
    cell.start('deviation_analyzer', path_length=job.plan.length, wait_for_subscribers=2, **common)
    cell.start('forward_kinematics_twin', wait_for_subscribers=2, **common)
    effects = yaml_text([effect.to_mapping() for effect in job.effects])
    cell.start('error_injector', effects=effects, seed=job.seed, wait_for_subscribers=2, **common)
    deviations = cell.collect('/deviation')
    cell.start(
        'trajectory_generator',
        robot=job.robot.name,
        path=job.seam,
        rate=job.rate,
        playback=0.0,
        follow='/deviation',
        wait_for_subscribers=3,
        exit_when_done=True,
    )
    return deviations
