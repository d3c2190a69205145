# Copyright 2026 weld_twin contributors
# SPDX-License-Identifier: Apache-2.0
"""
Points as a table, ``.csv``: a line each, joints or poses by the names of the columns.

Joints: one column for every joint, by its name, in rad or, where it slides, in m; a unit may stand
behind the name: ``_deg``, ``_mm``, ``[deg]``, ``[mm]``. Poses: ``x y z`` [m] with ``qx qy qz qw``.
Optional: ``move`` (joint, linear), ``speed`` (m/s, of joint moves the share of full speed),
``dwell`` [s]. Lines that begin with ``#`` are comments.
"""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np

from weld_twin_core.arm.rotation import matrix_from_quaternion, quaternion_from_matrix, transform
from weld_twin_core.arrays import Array
from weld_twin_core.errors import DataError
from weld_twin_core.motion.programs.moves import Kind

from ..files.csv_text import unguarded
from .build import Program, Ref, Step
from .context import Context
from .notation import Notation, joint_notation
from .source import Source, number_at, split_outside, stripped

NAME = 'csv'
POSE = ('x', 'y', 'z', 'qx', 'qy', 'qz', 'qw')
_TURNS = {'': 1.0, '_rad': 1.0, ' [rad]': 1.0} | dict.fromkeys(
    ('_deg', ' [deg]', ' [\N{DEGREE SIGN}]'), np.pi / 180.0
)
_SLIDES = {'': 1.0, '_m': 1.0, ' [m]': 1.0, '_mm': 1e-3, ' [mm]': 1e-3}
"""What may stand behind the name of a joint, and what its numbers are then in SI."""
_KINDS: dict[str, Kind] = {'joint': 'joint', 'linear': 'linear'}
SPEED = 0.1
"""m/s, and share of full speed, without a column."""


def read(sources: Sequence[Source], context: Context) -> Program:
    """
    Return the points of a table.

    Raises DataError: columns are missing, or a cell is broken; names file and line.
    """
    source = sources[0]
    program = Program(NAME, [source])
    head: list[str] | None = None
    for place, line in source.lines():
        if not line.strip() or line.lstrip().startswith('#'):
            continue
        parts = [
            stripped(source.text, *part)
            for part in split_outside(source.text, place, place + len(line), ',')
        ]
        if head is None:
            head = [unguarded(source.text[slice(*part)].strip('"')) for part in parts]
            columns, notation = _columns(source, place, head, context)
            continue
        if len(parts) != len(head):
            where = source.where(place)
            raise DataError(f'{where}: {len(head)} cells are needed, there are {len(parts)}')
        cells = dict(zip(head, parts, strict=True))
        numbers = [number_at(source, *cells[name], name) for name in columns]
        point = program.add_point(f'line {source.line(place)}', numbers, notation)
        program.add(_step(source, cells, point, notation.joints, source.where(place)))
    return program


def _columns(
    source: Source, place: int, head: Sequence[str], context: Context
) -> tuple[list[str], Notation]:
    joints = context.robot.joint_names
    if len(set(head)) != len(head):
        raise DataError(f'{source.where(place)}: a column is named twice')
    result = [
        next(((joint + end, unit) for end, unit in ends.items() if joint + end in head), None)
        for joint, ends in zip(
            joints,
            (_SLIDES if slides else _TURNS for slides in context.robot.prismatic),
            strict=True,
        )
    ]
    named = [item for item in result if item is not None]
    if len(named) == len(joints):
        units = np.array([unit for _, unit in named])
        notation = joint_notation(units, np.eye(context.robot.n), 9, 'joints')
        return [name for name, _ in named], notation
    if all(name in head for name in POSE):
        return list(POSE), CSV_POSE
    raise DataError(
        f'{source.where(place)}: a column for every joint ({", ".join(joints)}) or '
        f'{" ".join(POSE)} is needed'
    )


def _step(
    source: Source,
    cells: dict[str, tuple[int, int]],
    point: int,
    joints: bool,
    where: str,
) -> Step:
    kind: Kind = 'joint' if joints else 'linear'
    if 'move' in cells:
        word = source.text[slice(*cells['move'])].strip('"')
        if word not in _KINDS:
            raise DataError(f'{where}: move must be joint or linear, got {word!r}')
        kind = _KINDS[word]
    speed = number_at(source, *cells['speed'], 'speed').value if 'speed' in cells else SPEED
    dwell = number_at(source, *cells['dwell'], 'dwell').value if 'dwell' in cells else 0.0
    return Step(
        kind,
        where,
        Ref(point),
        speed=max(speed, 1e-4),
        stop=dwell > 0.0 or 'dwell' not in cells,
        dwell=max(dwell, 0.0),
    )


def _value(numbers: Sequence[float]) -> Array:
    rotation = matrix_from_quaternion(np.array(numbers[3:7]))
    return transform(rotation, np.array(numbers[:3]))


def _numbers(pose: Array, old: Sequence[float]) -> list[float]:
    turn = quaternion_from_matrix(pose[:3, :3])
    sign = 1.0 if float(turn @ np.array(old[3:7])) >= 0.0 else -1.0
    return [*(float(v) for v in pose[:3, 3]), *(float(sign * v) for v in turn)]


CSV_POSE = Notation('x y z qx qy qz qw', False, _value, _numbers, (7, 9))
"""Of the poses in a table."""
