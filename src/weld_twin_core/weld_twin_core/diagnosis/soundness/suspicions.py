# Copyright 2026 weld_twin contributors
# SPDX-License-Identifier: Apache-2.0
"""
How data get mixed up between a cell and a file: each way, how to undo it, how to say it.

A suspicion is a mistake whose sentence is a clause, without capital and full stop.
"""

from __future__ import annotations

from collections.abc import Iterator, Sequence
from functools import partial
from itertools import combinations, product

import numpy as np

from ...arm import catalog
from ...arm.robot import Robot
from ...arrays import Array
from .evidence import Finding, mistake
from .mending import joints_as, poses_inverted, positions_as, robot_as

DEGREE = np.pi / 180.0
INCH = 0.0254
"""Metres."""
AXES = ('x', 'y', 'z')
_JOINT_UNITS = {
    True: (
        (DEGREE, 'is in degrees among joints in radians'),
        (1.0 / DEGREE, 'was turned from degrees into radians twice'),
    ),
    False: (
        (1e-3, 'is in millimetres where metres belong'),
        (1e3, 'was turned from millimetres into metres twice'),
    ),
}
"""What a joint that turns, or slides, has to be multiplied by, and why."""
_LENGTHS = (
    (1e-3, 'are in millimetres where metres belong', 'millimetres among metres'),
    (1e3, 'were turned from millimetres into metres twice', 'metres among millimetres'),
    (INCH, 'are in inches where metres belong', 'inches among metres'),
)
"""The same of measured positions: of all, and of one axis."""


def suspicions(robot: Robot) -> Iterator[Finding]:
    """Yield every single mistake, common ones first."""
    yield from _units(robot)
    yield from _one_apart(robot)
    yield from _signs(robot)
    yield from _orders(robot)
    yield from robots(robot)
    yield from _zeros(robot)
    yield from _couplings(robot)
    yield _positions(
        'sign',
        'the measuring frame is left-handed: one axis of the positions has the wrong sign',
        'Turn the sign of one axis where the positions are exported',
        [1.0, -1.0, 1.0],
    )
    yield mistake(
        'measured poses are those of something fixed seen from the arm (a camera on the arm that '
        'looks at a board), not of the tool',
        'camera_inverted',
        ('instrument',),
        'Give --measured-inverse, and have base and tool aligned (--align base,tool)',
        partial(poses_inverted),
    )


def doubles(robot: Robot) -> Iterator[Finding]:
    """Yield pairs that hide each other, so that undoing one alone does not help."""
    for i, j in combinations(range(robot.n), 2):
        at = (robot.joint_names[i], robot.joint_names[j])
        words = f'joints {at[0]!r} and {at[1]!r} count the other way round'
        yield _signed(at, words, _with(np.ones(robot.n), [i, j], -1.0))


def robots(robot: Robot) -> Iterator[Finding]:
    """Yield every other bundled robot of as many joints."""
    for name in catalog.names():
        if catalog.load(name).n == robot.n and name != robot.name:
            yield mistake(
                f'the robot is a {name}, not a {robot.name}',
                'other_robot',
                ('robot',),
                f'Give --robot {name}, or the file of the robot that was measured',
                partial(robot_as, name=name),
            )


def _units(robot: Robot) -> Iterator[Finding]:
    names, turning = robot.joint_names, ~robot.prismatic
    for factor, words, remedy in (
        (
            DEGREE,
            'joint positions are in degrees where radians belong',
            'Record or import the joint positions in radians',
        ),
        (
            1.0 / DEGREE,
            'joint positions were turned from degrees into radians twice',
            'Leave out one of the two conversions',
        ),
    ):
        yield _joints('units', names, words, remedy, np.diag(np.where(turning, factor, 1.0)))
    for i, name in enumerate(names):
        for factor, words in _JOINT_UNITS[bool(turning[i])]:
            matrix = np.diag(_with(np.ones(robot.n), i, factor))
            yield _joints('units', (name,), f'joint {name!r} {words}', _others(name), matrix)
    for factor, words, _ in _LENGTHS:
        remedy = 'Record or import positions in metres'
        yield _positions('units', f'measured positions {words}', remedy, [factor] * 3)
    for (k, axis), (factor, _, unit) in product(enumerate(AXES), _LENGTHS):
        words = f'{axis} of the measured positions is in {unit}'
        yield _positions('units', words, _others(axis), _with(np.ones(3), k, factor))


def _one_apart(robot: Robot) -> Iterator[Finding]:
    """Yield columns of which one had its own unit, and was believed for all of them."""
    degrees = np.where(robot.prismatic, 1.0, 1.0 / DEGREE)
    for i in np.flatnonzero(~robot.prismatic).tolist():
        name, matrix = robot.joint_names[i], np.diag(_with(degrees, i, 1.0))
        words = f'joint {name!r} is in degrees, the others are not but were read as if'
        yield _joints('units', (name,), words, _others(name), matrix)
    for k, axis in enumerate(AXES):
        words = f'{axis} of the measured positions is in millimetres, the others were read as if'
        yield _positions('units', words, _others(axis), _with(np.full(3, 1e3), k, 1.0))


def _signs(robot: Robot) -> Iterator[Finding]:
    for i, name in enumerate(robot.joint_names):
        words = f'joint {name!r} counts the other way round'
        yield _signed((name,), words, _with(np.ones(robot.n), i, -1.0))
    yield _signed(robot.joint_names, 'all joints count the other way round', -np.ones(robot.n))


def _orders(robot: Robot) -> Iterator[Finding]:
    names = robot.joint_names
    straight = list(range(robot.n))
    for i, j in combinations(straight, 2):
        order = list(straight)
        order[i], order[j] = j, i
        words = f'joints {names[i]!r} and {names[j]!r} are swapped'
        yield _ordered((names[i], names[j]), words, order)
    # The k-th column of an alphabetical table belongs to the k-th name of the sorted list.
    alphabet = [sorted(names).index(name) for name in names]
    if alphabet != straight:
        words = 'joints are in alphabetical order, not in that of the chain'
        yield _ordered(names, words, alphabet)
    yield _ordered(names, 'joints are in reverse order', straight[::-1])
    for order in (straight[1:] + straight[:1], straight[-1:] + straight[:-1]):
        yield _ordered(names, 'joints are shifted by one place', order)


def _zeros(robot: Robot) -> Iterator[Finding]:
    for i in np.flatnonzero(~robot.prismatic).tolist():
        name = robot.joint_names[i]
        for turn in (90.0, -90.0, 180.0):
            words = f'the zero of joint {name!r} lies {turn:+.0f} degrees from that of the model'
            remedy = f'Add {turn:+.0f} degrees to the readings of {name}, or to its theta_offset'
            offset = _with(np.zeros(robot.n), i, turn * DEGREE)
            yield _joints('constant_angle', (name,), words, remedy, np.eye(robot.n), offset)


def _couplings(robot: Robot) -> Iterator[Finding]:
    if robot.n < 3 or robot.prismatic[1:3].any():
        return
    _, two, three = robot.joint_names[:3]
    for sign, way, to in ((1.0, 'Add', 'to'), (-1.0, 'Subtract', 'from')):
        words = f'joint {three!r} is counted against the ground, not against {two!r}'
        remedy = (
            f'{way} the reading of {two} {to} that of {three}, as the pendant of a robot with '
            'coupled axes needs it'
        )
        matrix = _with(np.eye(robot.n), (2, 1), sign)
        yield _joints('coupled_axes', (two, three), words, remedy, matrix)


def _with(values: Array, at: int | list[int] | tuple[int, int], value: float) -> Array:
    """Return an array with another value at a place or some."""
    out = np.array(values)
    out[at] = value
    return out


def _others(name: str) -> str:
    return f'Give {name} in the unit of the others'


def _signed(at: tuple[str, ...], words: str, sign: Array) -> Finding:
    remedy = f'Turn the sign of {", ".join(at)}' if len(at) < len(sign) else 'Turn every sign'
    return _joints('sign', at, words, remedy, np.diag(sign))


def _ordered(at: tuple[str, ...], words: str, order: list[int]) -> Finding:
    remedy = 'Put the names or the columns of the joints in order'
    return _joints('joints_swapped', at, words, remedy, np.eye(len(order))[order])


def _positions(kind: str, words: str, remedy: str, factor: Array | Sequence[float]) -> Finding:
    mend = partial(positions_as, factor=np.asarray(factor))
    return mistake(words, kind, ('instrument',), remedy, mend)


def _joints(
    kind: str,
    at: tuple[str, ...],
    words: str,
    remedy: str,
    matrix: Array,
    offset: Array | None = None,
) -> Finding:
    shift = np.zeros(len(matrix)) if offset is None else offset
    return mistake(words, kind, at, remedy, partial(joints_as, matrix=matrix, offset=shift))
