# Copyright 2026 weld_twin contributors
# SPDX-License-Identifier: Apache-2.0
"""A region that people choose, as postures: a box, a program, or a recorded motion."""

from pathlib import Path

import numpy as np

from weld_twin_core.arm.chain import forward
from weld_twin_core.arm.robot import Robot
from weld_twin_core.arrays import Array, halton
from weld_twin_core.diagnosis.predicting.allowed import POSTURES as ANYWHERE
from weld_twin_core.diagnosis.predicting.planned import JUDGED, clear_postures
from weld_twin_core.errors import DataError
from weld_twin_core.motion.inverse.newton import centred, polish
from weld_twin_core.motion.paths import default_seam
from weld_twin_core.motion.planned_motion import plan
from weld_twin_core.motion.programs import travel
from weld_twin_core.twin.posterior import postures_within_limits
from weld_twin_msgs_py.bags import read_recording
from weld_twin_msgs_py.programs import Context, controller_of, read_program, to_moves
from weld_twin_msgs_py.programs.languages import language_of
from weld_twin_msgs_py.programs.source import read_source

POSTURES = 160
"""Postures of a region, a third of which judge it; more change the result by some per cent."""
TRIED = 400
"""Places tried in a box, of which those count that the arm reaches."""
FEWEST = 8
"""Reached places of a box below which it is no region of this arm."""
STEPS = 12
"""Steps on the straight way from the posture of a usual seam to a place, each short enough for Newton's
method."""
CLOSED = 1e-6
"""Distance [m, rad] at which a place is reached."""
SIDES = 6
"""Numbers that make a box: its lower and its upper corner."""


def anywhere(robot: Robot, spread: float) -> tuple[Array, Array]:
    """
    Return postures of the whole reach that judge it, shape (K, n), and stations clear of the floor.

    ``spread`` [rad]: half the range of stations about the posture of a usual seam.
    """
    return postures_within_limits(robot, ANYWHERE), clear_postures(robot, spread)[:POSTURES]


def region(
    robot: Robot, given: str, context: Context | None = None, language: str = ''
) -> tuple[Array, Array]:
    """
    Return postures of a region, those that judge it, shape (K, n), and those that may be measured.

    given: ``x,y,z:x,y,z``, corners of a box in the robot's base frame [mm]; a program; or a bag.
    """
    if Path(given).is_dir():
        q = read_recording(given, robot).joints.q
    elif Path(given).is_file():
        language = language or language_of(read_source(given), given, '')
        context = context or Context(robot, controller_of(robot, language))
        program = read_program(given, context, language)
        way = travel(robot, to_moves(program, context.robot, context.controller), None, None)
        parts = [piece.motion.q for piece in way.pieces]
        if not parts:
            raise DataError(f"no move of the region '{given}' can be followed")
        q = np.concatenate(parts)
    else:
        try:  # the lower and the upper corner of a box
            numbers = [float(value) for value in given.replace(':', ',').split(',')]
        except ValueError:
            numbers = []
        box = np.array(numbers).reshape(2, 3) * 1e-3 if len(numbers) == SIDES else np.zeros((2, 3))
        if not (np.isfinite(box).all() and (box[1] > box[0]).all()):
            raise DataError(
                f"the region '{given}' is no bag, no program and no box; a box is written x,y,z:x,y,z, "
                'its lower and its upper corner in the base frame in mm'
            )
        q = _in_box(robot, box)
    chosen = q[np.unique(np.linspace(0, len(q) - 1, min(POSTURES, len(q))).round().astype(int))]
    judged = np.unique(np.linspace(0, len(chosen) - 1, min(JUDGED, len(chosen))).round())
    return chosen[judged.astype(int)], chosen


def _in_box(robot: Robot, box: Array) -> Array:
    """Return postures with the tool in a box, turned as in the middle of a usual seam."""
    middle = plan(robot, default_seam(robot, 'line'), 'smooth', rate_hz=10.0).motion.q
    centre = middle[len(middle) // 2]
    pose = forward(robot, centre)
    base = robot.T_world_base
    goals = np.tile(pose, (TRIED, 1, 1))
    goals[:, :3, 3] = (box[0] + halton(3, TRIED) * (box[1] - box[0])) @ base[:3, :3].T + base[
        :3, 3
    ]
    result, error = np.tile(centre, (TRIED, 1)), np.zeros((TRIED, 6))
    for share in np.linspace(0.0, 1.0, STEPS + 1)[1:]:
        result, error = polish(robot, result, (1.0 - share) * pose + share * goals)
    result = centred(robot, result)
    inside = ((result >= robot.lower) & (result <= robot.upper)).all(axis=1)
    out = result[inside & (np.abs(error).max(axis=1) < CLOSED)][:POSTURES]
    if len(out) < FEWEST:
        raise DataError(
            f'{robot.name} reaches {len(out)} of {TRIED} places in the region, with its tool turned '
            'as in a usual seam; choose a box that it reaches'
        )
    return np.asarray(out)
