# Copyright 2026 weld_twin contributors
# SPDX-License-Identifier: Apache-2.0
"""Sealed contacts: the plant touches sockets with one flaw and some slack."""

from __future__ import annotations

from collections.abc import Sequence
from typing import NamedTuple

import numpy as np

from weld_twin_core.arm import catalog
from weld_twin_core.arm.chain import forward, jacobian
from weld_twin_core.arm.robot import Robot
from weld_twin_core.arrays import Array
from weld_twin_core.contacts import Artefact, Contact, Contacts, Tie, spreads
from weld_twin_core.motion.inverse.newton import STRETCHED, least_step, reaching
from weld_twin_core.recording import JointMotion, Recording

from ..blind.blind_cell import at_stations
from ..blind.cause_sizes import AT_REST, Cause, draw, scaled
from ..plant.tracker import Tracker

ROUNDS = 4
"""Newton steps in which the plant is made to touch: each leaves a hundredth of what was off."""
TRIES = 60
"""Postures that are started from for each one wanted; some leave the limits."""
TURN = 2.5
"""Largest angle of a joint [rad] that is started from: further ones wind up cables."""
ARMS = ('ur5', 'ur10', 'kuka_iiwa14', 'franka_panda')
"""Arms of which link masses are known, so that every cause can act."""
FAMILIES = (*AT_REST, 'tool_pose', 'base_pose')
"""Causes drawn; the last one no contact sees."""
SOCKETS = np.array([[0.5, 0.1, 0.15], [0.1, 0.5, 0.35], [0.35, -0.35, 0.25]])
"""Places [m] within reach of all of them."""
APART = np.array([0.0, 0.05, 0.0])
"""From one socket of a place to the other [m]."""
EACH = 10
"""Postures per socket."""
SLACK = (5e-6, 5e-5)
"""Of the ball in its socket [m], standard deviation of each coordinate."""
SIZE = (3.0, 15.0)
"""What a cause moves, in slacks."""
LARGEST = 10.0
"""Factor on a drawn cause beyond which it is larger than machines have it."""
TIES = tuple(Tie((f'{k}/0', f'{k}/1'), 0.05, 2e-5) for k in range(len(SOCKETS)))
"""The sockets of a place are 50 mm apart."""


class Sealed(NamedTuple):
    """An arm with one flaw, and its touches."""

    robot: Robot
    cause: Cause
    recording: Recording


def made(seed: int) -> Sealed:
    """
    Return one sealed case.

    seed: decides the arm, the cause, its size, the slack and the postures.
    """
    rng = np.random.default_rng(seed)
    tool = np.eye(4)
    tool[:3, 3] = [0.02, -0.03, 0.15]
    robot = catalog.load(ARMS[seed % len(ARMS)]).with_frames(tool=tool)
    cause = draw(str(rng.choice(FAMILIES)), robot, 1.0, rng)
    slack, size = float(rng.uniform(*SLACK)), float(rng.uniform(*SIZE))
    start, labels, places = _starts(robot, rng)
    recording = _touching(robot, [cause], start, labels, places, rng)
    shown = _shown(robot, recording)
    cause = scaled(cause, min(size * slack / max(shown, 1e-12), LARGEST))
    loose = places + rng.normal(0.0, slack, places.shape)
    recording = _touching(robot, [cause], start, labels, loose, rng)
    return Sealed(robot, cause, recording)


def _starts(robot: Robot, rng: np.random.Generator) -> tuple[Array, list[str], Array]:
    """Return nominal postures at every socket, their labels, and where each socket is."""
    q, labels, places = [], [], []
    for k, middle in enumerate(SOCKETS):
        for socket in (0, 1):
            place = middle + socket * APART
            postures = postures_at(robot, place, EACH, rng)
            q.append(postures)
            labels += [f'{k}/{socket}'] * len(postures)
            places.append(np.tile(place, (len(postures), 1)))
    return np.concatenate(q), labels, np.concatenate(places)


def _shown(robot: Robot, recording: Recording) -> float:
    """Return the spread of the nominal tool point per coordinate, RMS [m]."""
    assert recording.contacts is not None
    points = forward(robot, recording.joints.q)[:, :3, 3]
    away = np.concatenate(list(spreads(recording.contacts, points).values()))
    return float(np.sqrt((away**2).mean() / 3.0))


def postures_at(robot: Robot, place: Array, count: int, rng: np.random.Generator) -> Array:
    """
    Return nominal postures in which the tool point is at a place, within the limits.

    place: shape (3,) [m].
    count: how many at the most.
    """
    low, high = np.maximum(robot.lower, -TURN), np.minimum(robot.upper, TURN)
    start = rng.uniform(low, high, (TRIES * count, robot.n))
    q, near = reaching(robot, np.tile(place, (len(start), 1)), start)
    within = (q > low).all(axis=1) & (q < high).all(axis=1)
    return np.asarray(q[near & within][:count])


def _touching(
    robot: Robot,
    causes: Sequence[Cause],
    q: Array,
    labels: Sequence[str],
    places: Array,
    rng: np.random.Generator,
) -> Recording:
    """
    Return the joint readings at which the plant's own tool point touches.

    q: postures to start from, shape (M, n) [rad or m].
    places: where each touch takes place, shape (M, 3) [m].
    """
    for _ in range(ROUNDS):
        real = at_stations(robot, causes, q, Tracker(), rng).position
        q = q + least_step(jacobian(robot, q)[:, :3], places - real, STRETCHED)
    names = tuple(Contact(name) for name in dict.fromkeys(labels))
    motion = JointMotion(1.0 + np.arange(float(len(q))), q, static=True)
    touched = Contacts(Artefact(names, TIES), tuple(labels))
    return Recording('plant', motion, contacts=touched)
