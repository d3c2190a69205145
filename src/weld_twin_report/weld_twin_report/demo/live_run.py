# Copyright 2026 weld_twin contributors
# SPDX-License-Identifier: Apache-2.0
"""The live part: generator, injector, twin, analyzer and recorder as processes over DDS."""

from __future__ import annotations

from weld_twin_core.errors import TwinError
from weld_twin_msgs_py.bags import bag_info
from weld_twin_msgs_py.files.yaml_file import yaml_text
from weld_twin_msgs_py.messages.topics import (
    ACTUAL_JOINT_STATES,
    DEVIATION,
    JOINT_STATES,
    MEASURED_POSE,
    TWIN_POSE,
)
from weld_twin_nodes.harness import Cell, Tap

from .hand_over import Job, Progress

LIMIT = 120.0
"""Seconds the run may stand still on a slow machine."""
EACH = (JOINT_STATES, ACTUAL_JOINT_STATES, MEASURED_POSE, TWIN_POSE, DEVIATION)
"""Topics with one message for each joint state."""


def run_live(job: Job, progress: Progress) -> None:
    """
    Run the motion through the nodes, at the speed they keep up with, and record it.

    Raises TwinError: a node failed or stood still, or the recording is not complete; the message
    says what is missing.
    """
    job.bag = job.folder / 'bag'
    samples = job.plan.motion.t.size
    try:
        with Cell() as cell:
            deviations = _start(cell, job)

            def told() -> bool:
                progress(len(deviations) / samples)
                return len(deviations) == samples

            cell.wait(
                told,
                lambda: f'the deviations: {len(deviations)} of {samples} are here',
                limit=LIMIT,
                progress=lambda: len(deviations),
            )
            cell.wait_recorded({topic.name: samples for topic in EACH})
            recorder = cell.processes[0]
            recorder.interrupt()
            if recorder.end() != 0:
                raise TwinError(f'the recorder failed: {recorder.log}')
    except TimeoutError as error:
        raise TwinError(str(error)) from None
    lacking = bag_info(job.bag).incomplete
    if lacking:
        raise TwinError(f'the recording is not complete: {"; ".join(lacking)}')


def _start(cell: Cell, job: Job) -> Tap:
    """
    Start the nodes; what listens comes before what speaks, and each waits for the next.

    The deviations have three listeners: the recorder, the harness, and the generator, which
    sends as fast as they come. Measured and twin poses have the analyzer and the recorder, joint
    states the injector, the twin and the recorder.
    """
    common = {'robot': job.robot.name, 'reliable_inputs': True}
    cell.start('recorder', out=str(job.bag), reliable_inputs=True)
    cell.start('deviation_analyzer', path_length=job.plan.length, wait_for_subscribers=3, **common)
    cell.start('forward_kinematics_twin', wait_for_subscribers=2, **common)
    effects = yaml_text([effect.to_mapping() for effect in job.effects])
    cell.start('error_injector', effects=effects, seed=job.seed, wait_for_subscribers=2, **common)
    deviations = cell.collect(DEVIATION.name)
    cell.start(
        'trajectory_generator',
        robot=job.robot.name,
        path=job.seam,
        rate=job.rate,
        playback=0.0,
        follow=DEVIATION.name,
        wait_for_subscribers=3,
        meet_within=LIMIT,
        exit_when_done=True,
    )
    return deviations
