# Copyright 2026 weld_twin contributors
# SPDX-License-Identifier: Apache-2.0
"""What a controller would measure of its joints on a motion that nobody has run yet."""

from __future__ import annotations

from dataclasses import replace

import numpy as np

from ..arm.robot import Robot
from ..recording import JointSignal, Recording
from .stages import load_torque
from .twin import Twin


def with_expected_effort(recording: Recording, robot: Robot, load_of_effort: float) -> Recording:
    """
    Return a motion with the effort that the model's statics expect, where efforts are measured.

    recording: a motion that is thought of: a measurement to come, postures elsewhere.
    robot: links without masses weigh nothing.
    load_of_effort: load torque for each N m of effort, 1 or -1; of 0 the motion stays as it is.
    """
    if not load_of_effort:
        return recording
    load = load_torque(Twin(robot).joint_view(recording))
    each = np.stack([load['tau', i] for i in range(robot.n)], axis=-1)
    effort = JointSignal(recording.joints.t, load_of_effort * each)
    return replace(recording, effort=effort, effort_holds=load_of_effort < 0.0)
