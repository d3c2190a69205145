# Copyright 2026 weld_twin contributors
# SPDX-License-Identifier: Apache-2.0
"""The plant made to touch: joint readings at which its own tool point is where it should be."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from typing import Any

import numpy as np

from weld_twin_core.arm.chain import jacobian
from weld_twin_core.arm.robot import Robot
from weld_twin_core.arrays import Array
from weld_twin_core.contacts import Artefact, Contact, Contacts, Tie
from weld_twin_core.motion.inverse.newton import STRETCHED, least_step, reaching
from weld_twin_core.recording import JointMotion, Recording

ROUNDS = 4
"""Newton steps in which the plant is made to touch: each leaves a hundredth of what was off."""
TRIES = 60
"""Postures that are started from for each one wanted; some leave the limits."""
TURN = 2.5
"""Largest angle of a joint [rad] that is started from: further ones wind up cables."""


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


def touching(
    robot: Robot,
    causes: Sequence[Mapping[str, Any]],
    q: Array,
    labels: Sequence[str],
    places: Array,
    ties: Sequence[Tie],
    rng: np.random.Generator,
) -> Recording:
    """
    Return the joint readings at which the plant's own tool point touches.

    robot: the nominal model.
    causes: what is wrong with the plant, as in an effects file.
    q: postures to start from, shape (M, n) [rad or m].
    places: where each touch takes place, shape (M, 3) [m].
    ties: of the artefact.
    """
    from ..plant.plant import run
    from ..plant.plant_recording import Command
    from ..plant.tracker import Tracker

    t = 1.0 + np.arange(float(len(q)))
    for _ in range(ROUNDS):
        command = Command(t, q, static=True)
        real = run(robot.to_mapping(), list(causes), command, Tracker(), rng)
        q = q + least_step(jacobian(robot, q)[:, :3], places - real.position, STRETCHED)
    names = tuple(Contact(name) for name in dict.fromkeys(labels))
    motion = JointMotion(t, q, static=True)
    touched = Contacts(Artefact(names, tuple(ties)), tuple(labels))
    return Recording('plant', motion, contacts=touched)
