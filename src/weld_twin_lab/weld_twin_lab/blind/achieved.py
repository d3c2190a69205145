# Copyright 2026 weld_twin contributors
# SPDX-License-Identifier: Apache-2.0
"""How far a diagnosis really shrinks the gap: on the recording sealed away from it."""

from __future__ import annotations

from collections.abc import Mapping
from pathlib import Path
from typing import Any, NamedTuple

import numpy as np

from weld_twin_core.arrays import Array
from weld_twin_core.diagnosis.algebra.problem import Model, Problem, usable
from weld_twin_core.diagnosis.frames.alignment import initial_frames, refined
from weld_twin_core.errors import DataError
from weld_twin_core.recording import Measurements, Recording
from weld_twin_msgs_py.bags import read_recording
from weld_twin_msgs_py.files.diagnosis_model import read_model
from weld_twin_msgs_py.robots import load_robot

from . import layout
from .displacement import rms

TO_90 = 1.6448536269514722 / 1.959963984540054
"""Half-width of a normal 90 % interval over that of a 95 % one."""


class Achieved(NamedTuple):
    """
    Gap on the test recording and what was claimed of it.

    ``over_floor`` is the RMS left over the RMS that the true causes would leave.
    """

    before_m: float
    after_m: float
    ratio: float
    claimed: float
    covered_90: bool
    covered_95: bool
    over_floor: float
    test: str


def achieved(
    cases: Path, truths: Path, truth: Mapping[str, Any], diagnosis: Path, claim: Mapping[str, Any]
) -> Achieved:
    """
    Return the gap before and after on the test recording, outliers left out.

    Parameters
    ----------
    cases, truths : Path
    truth : mapping
    diagnosis : Path
        The diagnosis.json with the model.
    claim : mapping
        Its entry ``shrink``.

    """
    name = str(truth['name'])
    robot = load_robot(str(cases / name / layout.ROBOT))
    model = read_model(robot, diagnosis)
    test = read_recording(truths / name / layout.TEST, robot)
    good = counted(test, truth['outliers'])
    bare = Model(robot, (robot.T_world_base,), model.known)
    if truth['align']:
        train = read_recording(cases / name / layout.TRAIN, robot)
        bare = aligned_on(bare, train, truth['align'])
    before, after = gap_on(bare, test)[good], gap_on(model, test)[good]
    first, left = rms(before), rms(after)
    ratio, ends = left / first, np.asarray(claim['ci95'], dtype=float)
    narrow = claim['ratio'] + TO_90 * (ends - claim['ratio'])
    return Achieved(
        first,
        left,
        ratio,
        float(claim['ratio']),
        bool(narrow[0] <= ratio <= narrow[1]),
        bool(ends[0] <= ratio <= ends[1]),
        left / float(truth['floor_m']),
        str(truth['test']),
    )


def aligned_on(model: Model, recording: Recording, align: list[str]) -> Model:
    """
    Return the model with the frames that a diagnosis of this recording starts from.

    Parameters
    ----------
    model : Model
    recording : Recording
    align : list of str
        Frames that are fitted.

    """
    problem = Problem((usable(recording),), frozenset(align))
    return refined(problem, initial_frames(problem, model))


def gap_on(model: Model, recording: Recording) -> Array:
    """
    Return measured minus predicted position, shape (M, 3) [m].

    Parameters
    ----------
    model : Model
    recording : Recording

    """
    measured = _measured(recording)
    return np.asarray(measured.position - model.twin(0).poses(recording, measured.t).position)


def counted(recording: Recording, outliers: list[int]) -> Array:
    """
    Return the samples to count: no outliers, none outside the joint stream, shape (M,).

    Parameters
    ----------
    recording : Recording
    outliers : list of int
        Numbers of the samples that are none of the arm's doing.

    """
    t, joints = _measured(recording).t, recording.joints
    good = (t >= joints.t[0]) & (t <= joints.t[-1])
    good[np.asarray(outliers, dtype=int)] = False
    return np.asarray(good)


def _measured(recording: Recording) -> Measurements:
    if recording.measured is None:
        raise DataError(f'the recording {recording.name!r} of a case holds no measurements')
    return recording.measured
