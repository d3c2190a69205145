# Copyright 2026 weld_twin contributors
# SPDX-License-Identifier: Apache-2.0
"""A servo axis in motion: an electro-mechanical positioning system, one joint that slides."""

from __future__ import annotations

from pathlib import Path
from time import perf_counter
from typing import Any

import numpy as np
from scipy.io import loadmat

from weld_twin_core.arm.robot import Robot
from weld_twin_core.arrays import Array
from weld_twin_core.errors import DataError
from weld_twin_core.recording import JointMotion, Measurements, Recording

from .judging import said
from .splits import Rows
from .unseen import residual, tried

FILE = 'DATA_EMPS.mat'
JOINT = 'axis'
FITTED = 0.6
"""Share of the recording, from its beginning, that is fitted on."""


def axis_robot() -> Robot:
    """Return one joint that slides along z."""
    return Robot.from_mapping(
        {'name': 'servo axis', 'joints': [{'name': JOINT, 'type': 'prismatic'}]}
    )


def axis_recording(directory: Path) -> Recording:
    """
    Return the reference as the joint stream, and the measured load side as positions.

    Across the axis nothing was measured; those coordinates are zero.

    Raises DataError: the file is missing or holds something else.
    """
    path = directory / FILE
    if not path.is_file():
        raise DataError(f"'{path}' is missing; docs/transfer.md says where the data come from")
    try:
        content = loadmat(path)
        t, wanted, measured = (np.ravel(content[key]) for key in ('t', 'qg', 'qm'))
    except (KeyError, ValueError, NotImplementedError, OSError) as error:
        raise DataError(f"'{path}' is not the recording of the servo axis: {error}") from None
    position = np.zeros((t.size, 3))
    position[:, 2] = measured
    return Recording('servo axis', JointMotion(t, wanted[:, None]), Measurements(t, position))


def judge_axis(directory: Path) -> dict[str, Any]:
    """Return what is named of the axis, and what is left on the part not fitted on."""
    recording, robot = axis_recording(directory), axis_robot()
    measured = recording.measured
    assert measured is not None
    cut = int(FITTED * measured.t.size)
    first: Rows = np.arange(measured.t.size) < cut
    train = recording.with_measured(measured.take(first))
    test = recording.with_measured(measured.take(~first))
    out: dict[str, Any] = {'name': 'servo_axis', 'kind': 'servo_axis', 'robot': robot.name}
    out['rms_m'] = plain_axis(recording, cut)
    start = perf_counter()
    diagnosis, error = tried(train, robot)
    out |= {'seconds': round(perf_counter() - start, 2), 'traceback': error}
    if diagnosis is None:
        return out
    out |= said(diagnosis)
    out['found'] = [item.as_dict() for item in diagnosis.effects]
    if diagnosis.status != 'unsound':
        remaining = residual(diagnosis.model, train, test)[2]
        out['rms_m']['product'] = float(np.sqrt((remaining**2).mean()))
    return out


def plain_axis(recording: Recording, cut: int) -> dict[str, float]:
    """
    Return the RMS error of plain models behind row ``cut``, fitted before it, [m].

    As given; a lag, error proportional to speed; with the sign of the speed; with acceleration.
    """
    assert recording.measured is not None
    t, q = recording.joints.t, recording.joints.q[:, 0]
    error = recording.measured.position[:, 2] - q
    speed = np.gradient(q, t)
    columns = [speed, np.sign(speed), np.gradient(speed, t)]
    out = {'as given': _rms(error[cut:])}
    for k, name in enumerate(('lag', 'lag and sign', 'lag, sign and acceleration')):
        design = np.stack([*columns[: k + 1], np.ones(q.size)], axis=1)
        best = np.linalg.lstsq(design[:cut], error[:cut], rcond=None)[0]
        out[name] = _rms(error[cut:] - design[cut:] @ best)
    return out


def _rms(error: Array) -> float:
    return float(np.sqrt((error**2).mean()))
