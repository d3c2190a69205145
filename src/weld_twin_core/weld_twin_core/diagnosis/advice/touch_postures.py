# Copyright 2026 weld_twin contributors
# SPDX-License-Identifier: Apache-2.0
"""Postures in which the tool point could touch what it has touched already, or a place beside."""

from __future__ import annotations

from collections.abc import Iterator, Sequence
from dataclasses import replace

import numpy as np
from numpy.typing import NDArray

from ...arm.chain import forward
from ...arm.reaching import reaching
from ...arrays import Array
from ...contacts import Artefact, Contact, Contacts
from ...recording import JointMotion, Measurements, Recording
from ...sequences import halton
from ..algebra.problem import Model, Problem
from .postures import widened

TRIED = 160
"""Postures that are started from at every place; a third of them reach it within the limits."""
ENOUGH = 40
"""Postures that are weighed at every place."""
SECONDS = 60.0
"""Time from one touch to the next [s], by hand."""
NEW = 'new place'
"""Label of what is touched where nothing has been touched yet."""
NEW_PLACES = 4
"""New places that are weighed."""
APART = 0.2
"""Distance [m] of a new place from the others at the least."""
BELOW = 0.05
"""How far a new place may lie below the lowest one [m]: there is a table."""


def again(problem: Problem, model: Model) -> Iterator[tuple[int, Recording]]:
    """
    Yield further touches of every place that can be reached: its number, and a recording.

    The joints stay within the recorded range, a little widened, and the tool leans no further
    than it has leaned there: what holds the artefact is not known.

    Parameters
    ----------
    problem : Problem
        Of contacts.
    model : Model
        With the tool point as found.

    """
    for k, recording in enumerate(problem.recordings):
        contacts, measured = recording.contacts, recording.measured
        assert contacts is not None and measured is not None
        rows = np.arange(TRIED) % contacts.size
        q, good = _reached(problem, model, [recording], measured.position[rows])
        kept = np.flatnonzero(good)[:ENOUGH]
        if kept.size:
            rows = rows[kept]
            labels = tuple(contacts.labels[row] for row in rows)
            value = None if contacts.value is None else contacts.value[rows]
            touched = Contacts(contacts.artefact, labels, value)
            yield k, _touching(recording, q[kept], measured.position[rows], touched)


def beside(problem: Problem, model: Model) -> Iterator[Recording]:
    """
    Yield touches of places where nothing was touched, each far from all others.

    Parameters
    ----------
    problem : Problem
        Of contacts.
    model : Model
        With the tool point as found.

    """
    low, high = widened(problem, model.robot)
    known = [_middle(recording) for recording in problem.recordings]
    lowest = min(float(point[2]) for point in known) - BELOW
    free = forward(model.robot, low + halton(model.robot.n, TRIED) * (high - low))[:, :3, 3]
    free = free[free[:, 2] > lowest]
    for _ in range(NEW_PLACES):
        if not free.size:
            return
        away = np.min([np.linalg.norm(free - point, axis=1) for point in known], axis=0)
        point = free[int(np.argmax(away))]
        if away.max() < APART:
            return
        known.append(point)
        targets = np.tile(point, (TRIED, 1))
        q, good = _reached(problem, model, problem.recordings, targets)
        kept = np.flatnonzero(good)[:ENOUGH]
        if not kept.size:
            continue
        contacts = Contacts(Artefact((Contact(NEW),)), (NEW,) * kept.size)
        yield _touching(problem.recordings[0], q[kept], targets[kept], contacts)


def _reached(
    problem: Problem, model: Model, recordings: Sequence[Recording], to: Array
) -> tuple[Array, NDArray[np.bool_]]:
    """Return postures at targets, and which may be taken: as the tool has leaned in recordings."""
    robot = model.robot
    low, high = widened(problem, robot)
    start = low + halton(robot.n, len(to)) * (high - low)
    q, good = reaching(robot, to, start)
    good &= ((q >= low) & (q <= high)).all(axis=1)
    leaned = np.concatenate([forward(robot, r.joints.q)[:, :3, 2] for r in recordings])
    middle = leaned.mean(axis=0) / max(float(np.linalg.norm(leaned.mean(axis=0))), 1e-9)
    good &= forward(robot, q)[:, :3, 2] @ middle >= (leaned @ middle).min()
    return q, good


def _middle(recording: Recording) -> Array:
    assert recording.measured is not None
    return np.asarray(recording.measured.position.mean(axis=0))


def _touching(recording: Recording, q: Array, points: Array, contacts: Contacts) -> Recording:
    t = SECONDS * np.arange(float(len(q)))
    motion = JointMotion(t, q, static=True)
    return replace(recording, joints=motion, measured=Measurements(t, points), contacts=contacts)
