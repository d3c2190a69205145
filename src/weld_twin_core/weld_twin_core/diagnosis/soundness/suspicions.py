# SPDX-FileCopyrightText: weld_twin contributors
# SPDX-License-Identifier: Apache-2.0
"""How data get mixed up between a cell and a file: each way, how to undo it, how to say it."""

from __future__ import annotations

from collections.abc import Callable, Iterator
from dataclasses import dataclass
from functools import partial
from itertools import combinations

import numpy as np

from ...arm import catalog
from ...arrays import Array
from .snapshot import Snapshot

DEGREE = np.pi / 180.0


@dataclass(frozen=True, eq=False)
class Suspicion:
    """A mix-up: what kind, in words, and the snapshot as it would be without it."""

    kind: str
    words: str
    undo: Callable[[Snapshot], Snapshot]


def suspicions(shot: Snapshot) -> Iterator[Suspicion]:
    """Yield every single mix-up, common ones first."""
    yield from _units(shot)
    yield from _signs(shot)
    yield from _orders(shot)
    yield from _robots(shot)
    yield from _zeros(shot)
    yield from _couplings(shot)
    yield from _frames(shot)


def doubles(shot: Snapshot) -> Iterator[Suspicion]:
    """Yield pairs that hide each other, so that undoing one alone does not help."""
    names = shot.robot.joint_names
    for i, j in combinations(range(len(names)), 2):
        sign = np.ones(len(names))
        sign[[i, j]] = -1.0
        words = f'joints {names[i]!r} and {names[j]!r} count the other way round'
        yield _joints('sign', words, np.diag(sign))


def _units(shot: Snapshot) -> Iterator[Suspicion]:
    turning = ~shot.robot.prismatic
    for factor, words in (
        (DEGREE, 'joint positions are in degrees where radians belong'),
        (1.0 / DEGREE, 'joint positions were turned from degrees into radians twice'),
    ):
        yield _joints('unit', words, np.diag(np.where(turning, factor, 1.0)))
    for factor, words in (
        (1e-3, 'measured positions are in millimetres where metres belong'),
        (1e3, 'measured positions were turned from millimetres into metres twice'),
        (0.0254, 'measured positions are in inches where metres belong'),
    ):
        yield Suspicion('unit', words, partial(Snapshot.with_measured, scale=factor))


def _signs(shot: Snapshot) -> Iterator[Suspicion]:
    for i, name in enumerate(shot.robot.joint_names):
        sign = np.ones(shot.robot.n)
        sign[i] = -1.0
        yield _joints('sign', f'joint {name!r} counts the other way round', np.diag(sign))
    yield _joints('sign', 'all joints count the other way round', -np.eye(shot.robot.n))


def _orders(shot: Snapshot) -> Iterator[Suspicion]:
    names = shot.robot.joint_names
    straight = list(range(len(names)))
    for i, j in combinations(straight, 2):
        order = list(straight)
        order[i], order[j] = j, i
        yield _ordered(f'joints {names[i]!r} and {names[j]!r} are swapped', order)
    # The k-th column of an alphabetical table belongs to the k-th name of the sorted list.
    alphabet = [sorted(names).index(name) for name in names]
    yield _ordered('joints are in alphabetical order, not in that of the chain', alphabet)
    yield _ordered('joints are in reverse order', straight[::-1])
    yield _ordered('joints are shifted by one place', straight[1:] + straight[:1])
    yield _ordered('joints are shifted by one place', straight[-1:] + straight[:-1])


def _robots(shot: Snapshot) -> Iterator[Suspicion]:
    for name in catalog.names():
        robot = catalog.load(name)
        if robot.n == shot.robot.n and name != shot.robot.name:
            words = f'the robot is a {name}, not a {shot.robot.name}'
            yield Suspicion('robot', words, partial(Snapshot.with_robot, robot=robot))


def _zeros(shot: Snapshot) -> Iterator[Suspicion]:
    for i, name in enumerate(shot.robot.joint_names):
        for turn in (90.0, -90.0, 180.0):
            offset = np.zeros(shot.robot.n)
            offset[i] = turn * DEGREE
            words = f'the zero of joint {name!r} lies {turn:+.0f} degrees from that of the model'
            yield _joints('zero', words, np.eye(shot.robot.n), offset)


def _couplings(shot: Snapshot) -> Iterator[Suspicion]:
    names = shot.robot.joint_names
    for sign in (1.0, -1.0):
        if len(names) < 3:
            return
        matrix = np.eye(len(names))
        matrix[2, 1] = sign
        words = f'joint {names[2]!r} is counted against the ground, not against {names[1]!r}'
        yield _joints('zero', words, matrix)


def _frames(shot: Snapshot) -> Iterator[Suspicion]:
    words = 'the measuring frame is left-handed: one axis of the positions has the wrong sign'
    yield Suspicion('mirror', words, partial(Snapshot.with_measured, mirror=True))


def _ordered(words: str, order: list[int]) -> Suspicion:
    return _joints('order', words, np.eye(len(order))[order])


def _joints(kind: str, words: str, matrix: Array, offset: Array | None = None) -> Suspicion:
    shift = np.zeros(len(matrix)) if offset is None else offset
    return Suspicion(kind, words, partial(Snapshot.with_joints, matrix=matrix, offset=shift))
