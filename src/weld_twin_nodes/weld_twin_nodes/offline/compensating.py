# Copyright 2026 weld_twin contributors
# SPDX-License-Identifier: Apache-2.0
"""Commands that put the real tool on the seam, as far as the model is known to hold there."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import replace
from pathlib import Path
from typing import NamedTuple

import numpy as np

from weld_twin_core.arm.robot import Robot
from weld_twin_core.diagnosis.algebra.problem import Model
from weld_twin_core.diagnosis.soundness.mending import reading_map
from weld_twin_core.recording import JointMotion, Recording
from weld_twin_core.twin.compensation import Compensation, compensate
from weld_twin_core.twin.twin import Twin
from weld_twin_msgs_py.bags import write_recording
from weld_twin_msgs_py.files.diagnosis_model import mended_source, read_model
from weld_twin_msgs_py.files.posterior_entry import read_posterior

from .prediction import Predictor, Stretch, beside_bag
from .told_twin import build_twin, diagnosis_of

WHOLE = 0.999
"""Share of a correction that counts as all of it."""


class Compensated(NamedTuple):
    """Compensated commands with what the model knows of them."""

    result: Compensation
    model: Predictor
    outside: Sequence[Stretch]  # of the nominal commands: where they leave what was recorded
    least: float
    """Smallest share of the correction that was applied anywhere, 1 for all of it everywhere."""
    motion: JointMotion  # the new commands, counted as the nominal ones came
    told: str = ''
    """That the commands were read as the diagnosis mended its recordings, and are written as they
    came; empty where they are not."""


def compensated(robot: Robot, path: Path | str, recording: Recording) -> Compensated:
    """
    Return the commands for a model file, less corrected where the model knows less.

    Raises ModelError: the file is of no use.
    """
    content, twin = diagnosis_of(path), build_twin(robot, path, mended=True)
    model = Predictor(twin, read_posterior(robot, path) if content else None)
    stored = read_model(robot, path) if 'model' in content else None
    given, reported = recording, ''
    if stored is not None:
        # Its clocks are its own, and commands need none.
        recording, reported = mended_source(stored, robot, given, -1)
    nominal, real = Twin(twin.robot).poses(recording), twin.poses(recording)
    covariances = model.covariances(recording)
    share = None
    if model.posterior is not None and covariances is not None:
        share = model.posterior.domain.trust(
            recording.joints.q,
            real.position - nominal.position,
            covariances[:, :3, :3],
        )
    result = compensate(twin.robot, twin.effects, recording, trust=share)
    least = 1.0 if share is None else float(share.min())
    motion = result.motion
    if stored is not None and recording is not given:
        motion = _as_given(motion, stored)
    return Compensated(result, model, model.outside(recording), least, motion, reported)


def _as_given(motion: JointMotion, stored: Model) -> JointMotion:
    """Return mended joint positions counted as they came: they go to the same controller."""
    matrix, offset = reading_map(stored.mends, stored.robot.n)
    back = np.linalg.inv(matrix).T
    qd = None if motion.qd is None else motion.qd @ back
    return replace(motion, q=(motion.q - offset) @ back, qd=qd)


def write_compensated(
    path: Path | str, made: Compensated, recording: Recording, *, storage: str = 'mcap'
) -> None:
    """
    Write the commands, where the model has the tool under them, and how sure it is.

    Raises DataError: the path exists or cannot be written.
    """
    twin = made.model.twin
    commands = replace(recording, joints=made.result.motion, measured=None)
    poses = twin.poses(commands, commands.joints.t)
    write_recording(
        path,
        replace(commands, joints=made.motion),
        twin.robot,
        twin=(poses.position, poses.rotation),
        covariance=made.model.covariances(commands),
        storage=storage,
        provenance={'compensated_with': [effect.to_mapping() for effect in twin.effects]},
        beside=beside_bag(made.model, made.outside),
    )


def trust_sentences(made: Compensated) -> list[str]:
    """Return in words where the commands lie outside what was recorded, and what was held back."""
    if made.model.posterior is None or not made.outside:
        return []
    worst = made.outside[0]
    out = [
        f'outside what was recorded at {len(made.outside)} stretch(es), the first '
        f'{worst.t_start:.2f} to {worst.t_end:.2f} s: {worst.why}'
    ]
    if made.least < WHOLE:
        out.append(
            f'there no more is corrected than the model knows: down to {made.least:.0%} of what '
            'it would say'
        )
    return out
