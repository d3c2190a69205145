# Copyright 2026 weld_twin contributors
# SPDX-License-Identifier: Apache-2.0
"""A real welding arm told from the pixels of two cameras alone, judged by a laser tracker."""

from __future__ import annotations

import csv
from dataclasses import replace
from pathlib import Path

import numpy as np
from numpy.typing import NDArray

from weld_twin_core.arm.robot import Robot
from weld_twin_core.arrays import Array
from weld_twin_core.bundle import seen_by
from weld_twin_core.diagnosis import diagnose
from weld_twin_core.diagnosis.algebra.fit import fit
from weld_twin_core.diagnosis.algebra.problem import Model, Problem, usable
from weld_twin_core.diagnosis.frames.alignment import initial_frames
from weld_twin_core.effects.effect import Effect
from weld_twin_core.recording import Measurements, Recording
from weld_twin_msgs_py.tables import read_camera, read_pixels, read_target

from ..blind.displacement import rms
from ..real_arms.sources import motoman
from ..real_arms.unseen import ALIGN, PLAIN, plain_fit, residual

PARTS = 5
"""Stretches of time, each left out in turn."""
CAMERAS = {'1': 'camera_1.yaml', '2': 'camera_2.yaml'}


def part(data: str, which: int) -> dict[str, object]:
    """
    Return what is left on a stretch of time that was not fitted, by the tracker [mm RMS].

    Frames of base and tool are the tracker's, of the other stretches; all else is told from their
    pixels alone, or from their tracker by a plain fit of the geometry.

    data: folder of published recordings; holds motoman_left.
    which: the stretch left out, counted from 0.
    """
    folder = Path(data)
    robot = motoman(folder, masses=False).robot
    here = folder / 'motoman_left'
    cameras = [read_camera(name, here / file) for name, file in CAMERAS.items()]
    target = read_target('hand', here / 'left_markers.csv')
    seen = read_pixels(here / 'left_hand.csv', robot, cameras, [target]).recording
    assert seen.images is not None
    place = _tracked(here / 'left_hand.csv')
    test = np.array_split(np.arange(len(place)), PARTS)[which]
    rest = np.setdiff1d(np.arange(len(place)), test)
    bare = replace(seen, measured=None, images=None, notes=())
    pixels = seen_by(bare, seen.images.take(np.isin(seen.images.image, rest)))
    diagnosis = diagnose(pixels, robot, align=ALIGN, experiment=False)
    train, judged = (_of(bare, place, rows) for rows in (rest, test))
    geometry = plain_fit(train, robot, PLAIN['geometry'], ALIGN).found
    models = {'frames': (), 'pixels': diagnosis.model.found, 'tracker': geometry}
    remaining = {name: _left(train, judged, robot, effects) for name, effects in models.items()}
    return {'part': which, 'status': diagnosis.status, **remaining}


def _tracked(path: Path) -> Array:
    """Return where the tracker saw the hand, pose by pose, (M, 3) [m]; NaN where it did not."""
    with path.open(newline='') as stream:
        rows = {row['pose']: row for row in csv.DictReader(stream)}
    texts = [[row[f'leica_{axis} [m]'] or 'nan' for axis in 'xyz'] for row in rows.values()]
    return np.array(texts, dtype=float)


def _of(bare: Recording, place: Array, rows: NDArray[np.intp]) -> Recording:
    kept = rows[np.isfinite(place[rows]).all(axis=1)]
    return replace(bare, measured=Measurements(bare.joints.t[kept], place[kept]))


def _left(train: Recording, judged: Recording, robot: Robot, known: tuple[Effect, ...]) -> float:
    """Return what a model leaves where its frames were not fitted [mm RMS]."""
    problem = Problem((usable(train),), ALIGN)
    start = initial_frames(problem, Model(robot, (robot.T_world_base,), known))
    model = fit(problem, start, problem.unit_scale()).model
    return 1e3 * rms(residual(model, train, judged)[:3].T)
