# Copyright 2026 weld_twin contributors
# SPDX-License-Identifier: Apache-2.0
"""
How data get mixed up between a cell and a file: each way, how to undo it, how to say it.

A suspicion is a mistake whose sentence is a clause, without capital and full stop.
"""

from __future__ import annotations

from collections.abc import Iterator
from functools import partial
from itertools import combinations, permutations, product

import numpy as np

from ...arm import catalog
from ...arm.robot import Robot
from ...arm.rotation import rotation_vector
from ...arrays import Array
from .evidence import Finding, mistake
from .mending import WAYS, base_turned, joints_as, poses_inverted, positions_as, robot_as, turns_as

DEGREE = np.pi / 180.0
MILLIMETRE, INCH = 1e-3, 0.0254
"""Metres."""
AXES = ('x', 'y', 'z')
_ANGLES = (
    (DEGREE, 'in degrees where radians belong'),
    (1.0 / DEGREE, 'turned from degrees into radians twice'),
)
_LENGTHS = (
    (MILLIMETRE, 'in millimetres where metres belong'),
    (1.0 / MILLIMETRE, 'turned from millimetres into metres twice'),
    (INCH, 'in inches where metres belong'),
)
"""What angles and lengths have to be multiplied by, and why."""


def suspicions(robot: Robot) -> Iterator[Finding]:
    """Yield every single mistake, common ones first."""
    plain = np.zeros(robot.n)
    for kind, at, words, remedy, matrix in _columns(robot):
        yield mistake(words, kind, at, remedy, partial(joints_as, matrix=matrix, offset=plain))
    for kind, words, remedy, factor in _positions():
        yield mistake(words, kind, ('instrument',), remedy, partial(positions_as, factor=factor))
    yield from robots(robot)
    yield from _zeros(robot)
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
    for pair in combinations(range(robot.n), 2):
        one, other = at = tuple(robot.joint_names[i] for i in pair)
        words, remedy = f'joints {one!r} and {other!r} count', f'Turn the sign of {one}, {other}'
        matrix = np.diag(_with(np.ones(robot.n), list(pair), -1.0))
        mend = partial(joints_as, matrix=matrix, offset=np.zeros(robot.n))
        yield mistake(f'{words} the other way round', 'sign', at, remedy, mend)


def robots(robot: Robot) -> Iterator[Finding]:
    for name in catalog.names():
        if catalog.load(name).n == robot.n and name != robot.name:
            yield mistake(
                f'the robot is a {name}, not a {robot.name}',
                'other_robot',
                ('robot',),
                f'Give --robot {name}, or the file of the robot that was measured',
                partial(robot_as, name=name),
            )


def turned_bases() -> Iterator[Finding]:
    """Yield every base that stands turned axis onto axis, by axis and angle."""
    for order, signs in product(permutations(range(3)), product((1.0, -1.0), repeat=3)):
        turn = np.diag(signs)[list(order)]
        if np.linalg.det(turn) < 0.0 or np.array_equal(turn, np.eye(3)):
            continue
        vector = np.degrees(rotation_vector(turn))
        angle, k = float(np.linalg.norm(vector)), int(np.abs(vector).argmax())
        about = f'axis ({", ".join(f"{part:+.0f}" for part in vector / abs(vector[k]))})'
        if abs(vector[k]) > angle - 1.0:
            about = f'{AXES[k]} axis'
            angle = angle if np.isclose(angle, 180.0) else float(vector[k])
        yield mistake(
            f'the base of the robot stands turned by {angle:.0f} degrees about its {about} '
            'against the frame that was given',
            'base_turned',
            ('base',),
            'Use the axes of the robot base that the controller counts in (for a UR: base or '
            'base_link), or add the turn to the base frame',
            partial(base_turned, turn=turn),
        )


def conventions() -> Iterator[Finding]:
    for way, (words, _) in WAYS.items():
        remedy = 'Mend the convention where the orientations are exported'
        yield mistake(words, 'other', ('instrument',), remedy, partial(turns_as, way=way))


def _columns(robot: Robot) -> Iterator[tuple[str, tuple[str, ...], str, str, Array]]:
    """Yield kind, place, words, remedy and matrix of what columns of joints may be instead."""
    names, turning, n = robot.joint_names, ~robot.prismatic, robot.n
    for factor, words in _ANGLES:
        remedy = 'Record or import the joint positions in radians'
        every = np.diag(np.where(turning, factor, 1.0))
        yield 'units', names, f'joint positions are {words}', remedy, every
    for i, name in enumerate(names):
        remedy = f'Give {name} in the unit of the others'
        for factor, words in _ANGLES if turning[i] else _LENGTHS:
            scaled = _with(np.eye(n), (i, i), factor)
            yield 'units', (name,), f'joint {name!r} is {words}', remedy, scaled
        if turning[i]:  # its own unit was believed for all of them
            words = f'joint {name!r} is in degrees, the others are not but were read as if'
            apart = _with(np.where(turning, 1.0 / DEGREE, 1.0), i, 1.0)
            yield 'units', (name,), words, remedy, np.diag(apart)
    for i, name in enumerate(names):
        words = f'joint {name!r} counts the other way round'
        turned = _with(np.eye(n), (i, i), -1.0)
        yield 'sign', (name,), words, f'Turn the sign of {name}', turned
    yield 'sign', names, 'all joints count the other way round', 'Turn every sign', -np.eye(n)
    for at, words, order in _orders(names):
        remedy = 'Put the names or the columns of the joints in order'
        yield 'joints_swapped', at, words, remedy, np.eye(n)[order]
    if n > 2 and turning[1:3].all():
        _, two, three = names[:3]
        words = f'joint {three!r} is counted against the ground, not against {two!r}'
        for sign, way, to in ((1.0, 'Add', 'to'), (-1.0, 'Subtract', 'from')):
            remedy = (
                f'{way} the reading of {two} {to} that of {three}, as the pendant of a robot with '
                'coupled axes needs it'
            )
            yield 'coupled_axes', (two, three), words, remedy, _with(np.eye(n), (2, 1), sign)


def _orders(names: tuple[str, ...]) -> Iterator[tuple[tuple[str, ...], str, list[int]]]:
    """Yield orders that joints may be in: which, in words, and what puts them right."""
    straight = list(range(len(names)))
    for i, j in combinations(straight, 2):
        order = list(straight)
        order[i], order[j] = j, i
        yield (names[i], names[j]), f'joints {names[i]!r} and {names[j]!r} are swapped', order
    # The k-th column of an alphabetical table belongs to the k-th name of the sorted list.
    alphabet = [sorted(names).index(name) for name in names]
    if alphabet != straight:
        yield names, 'joints are in alphabetical order, not in that of the chain', alphabet
    yield names, 'joints are in reverse order', straight[::-1]
    for order in (straight[1:] + straight[:1], straight[-1:] + straight[:-1]):
        yield names, 'joints are shifted by one place', order


def _zeros(robot: Robot) -> Iterator[Finding]:
    """Yield joints that are counted from another quarter of a turn."""
    for i in np.flatnonzero(~robot.prismatic).tolist():
        name = robot.joint_names[i]
        for quarters in (1.0, -1.0, 2.0):
            offset = _with(np.zeros(robot.n), i, quarters * np.pi / 2.0)
            turn = f'{np.degrees(offset[i]):+.0f} degrees'
            words = f'the zero of joint {name!r} lies {turn} from that of the model'
            remedy = f'Add {turn} to the readings of {name}, or to its theta_offset'
            mend = partial(joints_as, matrix=np.eye(robot.n), offset=offset)
            yield mistake(words, 'constant_angle', (name,), remedy, mend)


def _positions() -> Iterator[tuple[str, str, str, Array]]:
    """Yield kind, words, remedy and factor of each axis of what positions may be instead."""
    for factor, words in _LENGTHS:
        remedy = 'Record or import positions in metres'
        yield 'units', f'measured positions are {words}', remedy, np.full(3, factor)
    for k, axis in enumerate(AXES):
        what = f'{axis} of the measured positions is'
        remedy = f'Give {axis} in the unit of the others'
        for factor, words in _LENGTHS:
            yield 'units', f'{what} {words}', remedy, _with(np.ones(3), k, factor)
        apart = _with(np.full(3, 1.0 / MILLIMETRE), k, 1.0)
        yield 'units', f'{what} in millimetres, the others were read as if', remedy, apart
    for k in (1, 0, 2):
        words = 'the measuring frame is left-handed: one axis of the positions has the wrong sign'
        remedy = 'Turn the sign of one axis where the positions are exported'
        yield 'sign', words, remedy, _with(np.ones(3), k, -1.0)


def _with(values: Array, at: int | list[int] | tuple[int, int], value: float) -> Array:
    out = np.array(values)
    out[at] = value
    return out
