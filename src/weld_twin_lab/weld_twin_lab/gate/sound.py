# Copyright 2026 weld_twin contributors
# SPDX-License-Identifier: Apache-2.0
"""Sound recordings: arms with causes of plausible size, on rich and poor motions."""

from __future__ import annotations

from contextlib import suppress
from dataclasses import dataclass, replace

import numpy as np
from scipy.spatial.transform import Rotation

from weld_twin_core.arm.robot import Robot
from weld_twin_core.arrays import Array
from weld_twin_core.errors import DataError
from weld_twin_core.recording import Recording

from ..blind.blind_cell import BlindCell, as_recording, draw_cell, record, take
from ..blind.cause_sizes import FAMILIES, MOVING, OUTSIDE, Cause
from ..blind.deck import ROBOTS, STRATA
from ..blind.poor_motion import poorer
from ..blind.sizing import NotVisible, draw_causes

STEPS = ('station_step', 'tool_slip')
"""Causes that are mistakes of the set-up as well; they are drawn there."""
MOTIONS = ('seams', 'free', 'stations')
ALIGNS = ((), ('base',), ('tool',), ('base', 'tool'))
TRIES = 40
"""Draws of a motion before it is given up: not every arm reaches every seam."""


@dataclass(frozen=True, eq=False)
class Sound:
    """A sound recording."""

    robot: Robot
    """The nominal arm with its tool as it is told to the diagnosis."""
    recording: Recording
    align: tuple[str, ...]
    real: Robot
    """The same arm with its tool as it is; the base as it was told."""
    about: dict[str, object]
    """Robot, motion, causes, how the motion was made poor."""


def draw(rng: np.random.Generator, *, rich: bool = False) -> Sound:
    """
    Return a sound recording drawn at random.

    rich: only motions that show every joint.

    Raises DataError: none came about.
    """
    for _ in range(TRIES):
        with suppress(NotVisible, FloatingPointError, DataError):
            return _drawn(rng, rich)
    raise DataError('no sound recording came about')


def _drawn(rng: np.random.Generator, rich: bool) -> Sound:
    name, kind = str(rng.choice(ROBOTS)), str(rng.choice(MOTIONS))
    several = [f for f in (*FAMILIES, *OUTSIDE) if f not in STEPS]
    if kind == 'stations':
        several = [f for f in several if f not in MOVING]
    count = int(rng.choice([0, 1, 1, 1, 2, 3]))
    families = tuple(str(f) for f in rng.choice(several, count, replace=False))
    cell = draw_cell(name, kind, families, rng)
    taken = take(cell, kind, float(rng.uniform(12.0, 40.0)), rng)
    poor = '' if rich else str(rng.choice(['', '', 'small', 'still', 'few', 'one']))
    taken = poorer(taken, poor, rng)
    strata = [int(k) for k in rng.integers(1, len(STRATA), count)]
    causes: list[Cause] = []
    if families:
        causes, _ = draw_causes(cell, families, strata, taken, rng)
    align = ALIGNS[int(rng.integers(len(ALIGNS)))]
    robot, recording = _as_told(cell, as_recording('run', record(cell, causes, taken)), align, rng)
    about: dict[str, object] = {
        'robot': name,
        'motion': kind,
        'poor': poor,
        'align': align,
        'causes': causes,
    }
    return Sound(robot, recording, align, cell.robot, about)


def _as_told(
    cell: BlindCell, recording: Recording, align: tuple[str, ...], rng: np.random.Generator
) -> tuple[Robot, Recording]:
    """Return the robot as told, and the recording seen from anywhere if frames are fitted."""
    robot = cell.robot
    if 'tool' in align:
        robot = robot.with_frames(tool=np.eye(4))
    if 'base' in align:
        recording = seen_from(recording, _anywhere(rng))
    return robot, recording


def seen_from(recording: Recording, T: Array) -> Recording:
    """Return the recording with its measurements in another frame, T shape (4, 4)."""
    seen = recording.measured
    assert seen is not None
    turned = None if seen.rotation is None else T[:3, :3] @ seen.rotation
    position = seen.position @ T[:3, :3].T + T[:3, 3]
    return recording.with_measured(replace(seen, position=position, rotation=turned))


def _anywhere(rng: np.random.Generator) -> Array:
    T = np.eye(4)
    T[:3, :3] = Rotation.random(random_state=int(rng.integers(2**31))).as_matrix()
    T[:3, 3] = rng.uniform(-3.0, 3.0, 3)
    return T
