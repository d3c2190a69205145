# Copyright 2026 weld_twin contributors
# SPDX-License-Identifier: Apache-2.0
"""The model of a diagnosis in forms that robots, planners and people load."""

from __future__ import annotations

from collections.abc import Callable, Sequence
from dataclasses import replace
from pathlib import Path

import numpy as np

from weld_twin_core.arm.robot import Robot
from weld_twin_core.diagnosis.algebra.problem import Model
from weld_twin_core.diagnosis.soundness.mending import reading_map, turned_joints
from weld_twin_core.effects import Effect
from weld_twin_core.effects.dated import of_the_robot
from weld_twin_core.effects.wording import TURNED_ROUND, stands, to_mend
from weld_twin_core.twin.corrected import corrected, joint_offsets
from weld_twin_msgs_py.files.csv_text import csv_text
from weld_twin_msgs_py.files.whole_files import write_text
from weld_twin_msgs_py.files.yaml_file import yaml_text
from weld_twin_msgs_py.robots import write_robot_yaml, write_urdf
from weld_twin_msgs_py.robots.urdf_like import GivenUrdf, write_urdf_like

from .where_it_holds import file_alone

_EVERYTHING = 'Every effect of the twin; goes with the nominal robot.'
_LEFT_OVER = 'What the corrected robot.yaml cannot hold; goes with that, not with the nominal.'


def write_yaml(path: Path, model: Model, notes: Sequence[str]) -> None:
    """Write the corrected robot as a robot file."""
    said = _of_the_robot(model, notes)
    write_robot_yaml(path, _corrected(model)[0], notes=said, overwrite=True)


def write_model_urdf(path: Path, model: Model, notes: Sequence[str]) -> None:
    """Write the corrected robot as a URDF."""
    write_urdf(path, _corrected(model)[0], overwrite=True, notes=_of_the_robot(model, notes))


def write_offsets(path: Path, model: Model, notes: Sequence[str]) -> None:
    """
    Write how much further each joint really stands than its reading: rad and deg, or m and mm.

    A table is read by spreadsheets; where the model holds stands in the other files.
    """
    del notes
    robot = model.robot
    offsets = joint_offsets(robot, _causes(model)) + _zeros(model)
    turned, rows = turned_joints(model.mends, robot), []
    for name, offset, slides in zip(robot.joint_names, offsets, robot.prismatic, strict=True):
        shown = offset * 1e3 if slides else np.degrees(offset)
        units = ('m', 'mm') if slides else ('rad', 'deg')
        reported = f'{stands(name, offset, sliding=slides)} {to_mend(offset, sliding=slides)}'
        if name in turned:
            reported += f' {TURNED_ROUND}'
        meaning = reported if offset else ''
        rows.append((name, float(offset), units[0], f'{shown:.6f}', units[1], meaning))
    remarks = ''.join(f'# {line}\n' for line in _readings(model))
    table = csv_text(('joint', 'offset', 'unit', 'shown', 'shown_unit', 'meaning'), rows)
    write_text(path, remarks + table, overwrite=True)


def write_effects(path: Path, model: Model, notes: Sequence[str]) -> None:
    """Write every effect, known and found, for use with the nominal robot."""
    _write_effects(path, [_EVERYTHING, *_mended(model), *notes], _causes(model))


def write_left_over(path: Path, model: Model, notes: Sequence[str]) -> None:
    """Write the effects that the corrected robot cannot hold."""
    _write_effects(path, [_LEFT_OVER, *_readings(model), *notes], _corrected(model)[1])


FORMATS: dict[str, tuple[str, Callable[[Path, Model, Sequence[str]], None]]] = {
    'yaml': ('robot.yaml', write_yaml),
    'urdf': ('robot.urdf', write_model_urdf),
    'offsets': ('joint_offsets.csv', write_offsets),
    'effects': ('effects.yaml', write_effects),
    'left-over': ('robot_effects.yaml', write_left_over),
}
"""What the command line calls a form, its usual file name, and how it is written."""


def write_all(
    directory: Path, model: Model, notes: Sequence[str] = (), given: GivenUrdf | None = None
) -> None:
    """
    Write the model in every form.

    ``notes``: where it holds. ``given``: the URDF that the robot was read from, whose names the
    corrected one keeps.
    """
    for name, write in FORMATS.values():
        write(directory / name, model, notes)
    if given is not None:
        write_given_urdf(directory / FORMATS['urdf'][0], model, notes, given)


def write_given_urdf(path: Path, model: Model, notes: Sequence[str], given: GivenUrdf) -> None:
    """Write the corrected robot as the URDF that it was read from, its names kept."""
    robot, said = _corrected(model)[0], _of_the_robot(model, notes)
    write_urdf_like(path, given, robot, overwrite=True, notes=said)


def _of_the_robot(model: Model, notes: Sequence[str]) -> list[str]:
    """Return the head of a robot file: what it leaves by itself, and where the model holds."""
    own = [] if model.alone is None else file_alone(model.alone, left=bool(_corrected(model)[1]))
    return [*own, *_readings(model), *notes]


def _corrected(model: Model) -> tuple[Robot, tuple[Effect, ...]]:
    based = model.robot.with_frames(base=model.bases[0])
    robot, remaining = corrected(based, (*_causes(model), *_changes(model)))
    # What the file has for use by itself, the effects that go with it take back.
    remaining = (*remaining, *(effect.with_vector(-effect.vector()) for effect in _changes(model)))
    zeros = _zeros(model)
    if zeros.any():
        key = np.where(robot.prismatic, 0.0, zeros), np.where(robot.prismatic, zeros, 0.0)
        robot = replace(
            robot,
            theta=robot.theta + key[0],
            d=robot.d + key[1],
            lower=robot.lower - zeros,
            upper=robot.upper - zeros,
        )
    source = f'{robot.source}; corrected by a diagnosis' if robot.source else 'diagnosis'
    if model.mended:
        source += f' of mended data: {" ".join(model.mended)}'
    return replace(robot, source=source), remaining


def _changes(model: Model) -> tuple[Effect, ...]:
    """Return what the robot file has beside the constants found, to do well by itself."""
    return () if model.alone is None else model.alone.changes


def _zeros(model: Model) -> np.ndarray:
    """
    Return what was added to the readings before the diagnosis, shape (n,) [rad or m].

    A zero is the arm's or its controller's, and belongs into the files, so that they take the
    readings as they were recorded. Columns, signs and units that were mixed up belong to the
    recording alone: a file that repeated them would be wrong at the robot.
    """
    matrix, offset = reading_map(model.mends, model.robot.n)
    return offset if np.array_equal(matrix, np.eye(model.robot.n)) else np.zeros(model.robot.n)


def _readings(model: Model) -> list[str]:
    """Return what was mended, and which readings the files take."""
    reported = _mended(model)
    if not any(mend.get('do') == 'joints' for mend in model.mends):
        return reported
    if _zeros(model).any():
        return [
            *reported,
            'That is in the numbers below: they take the readings as they were recorded.',
        ]
    return [*reported, 'The numbers below take readings in which that is mended.']


def _causes(model: Model) -> tuple[Effect, ...]:
    """Return the effects of robot and cell; how a set-up moved is of no use elsewhere."""
    return of_the_robot([effect for effect in model.known + model.found if effect.traits.cause])


def _write_effects(path: Path, notes: Sequence[str], effects: Sequence[Effect]) -> None:
    entries = [effect.to_mapping() for effect in effects]
    comment = ''.join(f'# {note}\n' for note in notes)
    write_text(path, comment + yaml_text(entries), overwrite=True)


def _mended(model: Model) -> list[str]:
    """Return what was wrong with the data that the model comes from."""
    return [f'Mended before the diagnosis: {sentence}' for sentence in model.mended]
