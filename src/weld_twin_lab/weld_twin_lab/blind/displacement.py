# Copyright 2026 weld_twin contributors
# SPDX-License-Identifier: Apache-2.0
"""Displacements of the tool over a recording, shape (M, 3) [m]: their size, and what is alike."""

from __future__ import annotations

from collections.abc import Collection

import numpy as np

from weld_twin_core.arm.robot import Robot
from weld_twin_core.arrays import Array
from weld_twin_core.diagnosis.algebra.problem import Model, Problem, usable
from weld_twin_core.diagnosis.frames.alignment import initial_frames, refined
from weld_twin_core.effects.effect import Effect
from weld_twin_core.errors import DataError
from weld_twin_core.recording import Measurements, Recording


def rigid(points: Array, off: Array) -> Array:
    """Return the part of a displacement (M, 3) that a moved base explains."""
    centred = points - points.mean(axis=0)
    turn = [np.cross(axis, centred) for axis in np.eye(3)]
    columns = [column.ravel() for column in turn]
    columns += [np.tile(axis, len(points)) for axis in np.eye(3)]
    design = np.stack(columns, axis=1)
    fitted, *_ = np.linalg.lstsq(design, off.ravel(), rcond=None)
    return np.asarray((design @ fitted).reshape(off.shape))


def rms(off: Array) -> float:
    """Return the RMS length of vectors (M, 3)."""
    return float(np.sqrt((off**2).sum(axis=1).mean()))


def correlation(a: Array, b: Array) -> float:
    """Return the absolute correlation of two deviations, shape (M, 3) each."""
    size = float(np.linalg.norm(a) * np.linalg.norm(b))
    return abs(float((a * b).sum())) / max(size, 1e-300)


NORMAL_90 = 1.6448536269514722
"""Half-width of a normal 90 % interval in standard deviations."""
TO_90 = NORMAL_90 / 1.959963984540054
"""Half-width of a normal 90 % interval over that of a 95 % one."""


def nominal_on(
    robot: Robot, known: tuple[Effect, ...], recording: Recording, align: Collection[str]
) -> Model:
    """Return the nominal model with the frames that a diagnosis of this recording starts from."""
    model = Model(robot, (robot.T_world_base,), known)
    if not align:
        return model
    problem = Problem((usable(recording),), frozenset(align))
    return refined(problem, initial_frames(problem, model))


def gap_on(model: Model, recording: Recording) -> Array:
    """Return measured minus predicted position, shape (M, 3) [m]."""
    measured = measured_of(recording)
    return np.asarray(measured.position - model.twin(0).poses(recording, measured.t).position)


def counted(recording: Recording, outliers: list[int]) -> Array:
    """Return the samples to count: no outliers, none outside the joint stream, shape (M,)."""
    t, joints = measured_of(recording).t, recording.joints
    good = (t >= joints.t[0]) & (t <= joints.t[-1])
    good[np.asarray(outliers, dtype=int)] = False
    return np.asarray(good)


def measured_of(recording: Recording) -> Measurements:
    """Return what was measured; raises DataError where nothing was."""
    if recording.measured is None:
        raise DataError(f'the recording {recording.name!r} of a case holds no measurements')
    return recording.measured
