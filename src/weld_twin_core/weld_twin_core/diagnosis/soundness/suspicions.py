# Copyright 2026 weld_twin contributors
# SPDX-License-Identifier: Apache-2.0
"""How data get mixed up between a cell and a file: each way, how to undo it, how to say it."""

from __future__ import annotations

from collections.abc import Iterator
from dataclasses import dataclass
from functools import partial
from itertools import combinations

import numpy as np

from ...arm import catalog
from ...arm.robot import Robot
from ...arrays import Array
from .mending import Mend, joints_as, poses_inverted, positions_as, robot_as

DEGREE = np.pi / 180.0
INCH = 0.0254
"""Metres."""
AXES = ('x', 'y', 'z')


@dataclass(frozen=True, eq=False)
class Suspicion:
    """
    A mistake in the set-up that may have been made.

    Attributes
    ----------
    kind : str
        As `diagnosis.json` has it.
    at : tuple of str
        Joints, 'base', 'tool', 'instrument', 'clock' or 'robot'.
    words : str
        What is wrong, to begin a sentence with.
    remedy : str
        What to mend, in the imperative.
    mend : callable
        Undoes it.
    alike : tuple of Suspicion
        Others that would explain the data as well.

    """

    kind: str
    at: tuple[str, ...]
    words: str
    remedy: str
    mend: Mend
    alike: tuple[Suspicion, ...] = ()


def suspicions(robot: Robot) -> Iterator[Suspicion]:
    """Yield every single mistake, common ones first."""
    yield from _units(robot)
    yield from _one_apart(robot)
    yield from _signs(robot)
    yield from _orders(robot)
    yield from robots(robot)
    yield from _zeros(robot)
    yield from _couplings(robot)
    yield from _mirror()
    yield _on_the_arm()


def doubles(robot: Robot) -> Iterator[Suspicion]:
    """Yield pairs that hide each other, so that undoing one alone does not help."""
    names = robot.joint_names
    for i, j in combinations(range(len(names)), 2):
        sign = np.ones(len(names))
        sign[[i, j]] = -1.0
        words = f'joints {names[i]!r} and {names[j]!r} count the other way round'
        yield _signed((names[i], names[j]), words, sign)


def _units(robot: Robot) -> Iterator[Suspicion]:
    turning = ~robot.prismatic
    names = robot.joint_names
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
        for factor, words in _joint_units(name, bool(turning[i])):
            matrix = np.eye(robot.n)
            matrix[i, i] = factor
            yield _joints(
                'units', (name,), words, f'Give {name} in the unit of the others', matrix
            )
    for factor, words in (
        (1e-3, 'measured positions are in millimetres where metres belong'),
        (1e3, 'measured positions were turned from millimetres into metres twice'),
        (INCH, 'measured positions are in inches where metres belong'),
    ):
        yield _positions('units', words, 'Record or import positions in metres', [factor] * 3)
    for k, axis in enumerate(AXES):
        for factor, unit in (
            (1e-3, 'millimetres among metres'),
            (1e3, 'metres among millimetres'),
            (INCH, 'inches among metres'),
        ):
            scale = np.ones(3)
            scale[k] = factor
            words = f'{axis} of the measured positions is in {unit}'
            yield _positions('units', words, f'Give {axis} in the unit of the others', scale)


def _one_apart(robot: Robot) -> Iterator[Suspicion]:
    """Yield columns of which one had its own unit, and was believed for all of them."""
    for i, name in enumerate(robot.joint_names):
        if not robot.prismatic[i]:
            factor = np.where(robot.prismatic, 1.0, 1.0 / DEGREE)
            factor[i] = 1.0
            words = f'joint {name!r} is in degrees, the others are not but were read as if'
            remedy = f'Give {name} in the unit of the others'
            yield _joints('units', (name,), words, remedy, np.diag(factor))
    for k, axis in enumerate(AXES):
        scale = np.full(3, 1e3)
        scale[k] = 1.0
        words = f'{axis} of the measured positions is in millimetres, the others were read as if'
        yield _positions('units', words, f'Give {axis} in the unit of the others', scale)


def _joint_units(name: str, turns: bool) -> tuple[tuple[float, str], ...]:
    if turns:
        return (
            (DEGREE, f'joint {name!r} is in degrees among joints in radians'),
            (1.0 / DEGREE, f'joint {name!r} was turned from degrees into radians twice'),
        )
    return (
        (1e-3, f'joint {name!r} is in millimetres where metres belong'),
        (1e3, f'joint {name!r} was turned from millimetres into metres twice'),
    )


def _signs(robot: Robot) -> Iterator[Suspicion]:
    for i, name in enumerate(robot.joint_names):
        sign = np.ones(robot.n)
        sign[i] = -1.0
        yield _signed((name,), f'joint {name!r} counts the other way round', sign)
    words = 'all joints count the other way round'
    yield _signed(robot.joint_names, words, -np.ones(robot.n))


def _orders(robot: Robot) -> Iterator[Suspicion]:
    names = robot.joint_names
    straight = list(range(len(names)))
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
    yield _ordered(names, 'joints are shifted by one place', straight[1:] + straight[:1])
    yield _ordered(names, 'joints are shifted by one place', straight[-1:] + straight[:-1])


def robots(robot: Robot) -> Iterator[Suspicion]:
    """Yield every other bundled robot of as many joints."""
    for name in catalog.names():
        other = catalog.load(name)
        if other.n == robot.n and name != robot.name:
            yield Suspicion(
                'other_robot',
                ('robot',),
                f'the robot is a {name}, not a {robot.name}',
                f'Give --robot {name}, or the file of the robot that was measured',
                partial(robot_as, name=name),
            )


def _zeros(robot: Robot) -> Iterator[Suspicion]:
    for i, name in enumerate(robot.joint_names):
        if robot.prismatic[i]:
            continue
        for turn in (90.0, -90.0, 180.0):
            offset = np.zeros(robot.n)
            offset[i] = turn * DEGREE
            words = f'the zero of joint {name!r} lies {turn:+.0f} degrees from that of the model'
            remedy = f'Add {turn:+.0f} degrees to the readings of {name}, or to its theta_offset'
            yield _joints('constant_angle', (name,), words, remedy, np.eye(robot.n), offset)


def _couplings(robot: Robot) -> Iterator[Suspicion]:
    names = robot.joint_names
    if len(names) < 3 or robot.prismatic[1:3].any():
        return
    for sign in (1.0, -1.0):
        matrix = np.eye(len(names))
        matrix[2, 1] = sign
        words = f'joint {names[2]!r} is counted against the ground, not against {names[1]!r}'
        way = 'Add' if sign > 0.0 else 'Subtract'
        remedy = (
            f'{way} the reading of {names[1]} {"to" if sign > 0.0 else "from"} that of '
            f'{names[2]}, as the pendant of a robot with coupled axes needs it'
        )
        yield _joints('coupled_axes', (names[1], names[2]), words, remedy, matrix)


def _mirror() -> Iterator[Suspicion]:
    words = 'the measuring frame is left-handed: one axis of the positions has the wrong sign'
    remedy = 'Turn the sign of one axis where the positions are exported'
    yield _positions('sign', words, remedy, [1.0, -1.0, 1.0])


def _on_the_arm() -> Suspicion:
    words = (
        'measured poses are those of something fixed seen from the arm (a camera on the arm that '
        'looks at a board), not of the tool'
    )
    remedy = 'Give --measured-inverse, and have base and tool aligned (--align base,tool)'
    return Suspicion('camera_inverted', ('instrument',), words, remedy, partial(poses_inverted))


def _signed(at: tuple[str, ...], words: str, sign: Array) -> Suspicion:
    remedy = f'Turn the sign of {", ".join(at)}' if len(at) < len(sign) else 'Turn every sign'
    return _joints('sign', at, words, remedy, np.diag(sign))


def _ordered(at: tuple[str, ...], words: str, order: list[int]) -> Suspicion:
    remedy = 'Put the names or the columns of the joints in order'
    return _joints('joints_swapped', at, words, remedy, np.eye(len(order))[order])


def _positions(kind: str, words: str, remedy: str, factor: Array | list[float]) -> Suspicion:
    scale = np.asarray(factor)
    mend = partial(positions_as, factor=scale)
    return Suspicion(kind, ('instrument',), words, remedy, mend)


def _joints(
    kind: str,
    at: tuple[str, ...],
    words: str,
    remedy: str,
    matrix: Array,
    offset: Array | None = None,
) -> Suspicion:
    shift = np.zeros(len(matrix)) if offset is None else offset
    mend = partial(joints_as, matrix=matrix, offset=shift)
    return Suspicion(kind, at, words, remedy, mend)
