# Copyright 2026 weld_twin contributors
# SPDX-License-Identifier: Apache-2.0
"""
The problem that recordings pose, and the nominal model with frames to start from.

Contacts are one recording per place. A place is whatever hangs together by known lengths: one socket,
two sockets on a plate, a block. Where it is not known where it is, no contact shows where the base
is. What an instrument measured may stand beside; each recording of it stays as it is.
"""

from __future__ import annotations

from collections.abc import Iterable, Sequence
from dataclasses import replace

import numpy as np

from ...arm.robot import Robot
from ...arm.rotation import transform
from ...arrays import Array
from ...contacts import places
from ...effects.effect import Effect
from ...effects.registry import REGISTRY
from ...recording import Recording
from ..algebra.fit import LEAST_NOISE, fit
from ..algebra.posed import by_place, posed
from ..algebra.problem import Model, Problem, frames_named, usable
from ..negligible import FLAT, REWEIGHTED
from .alignment import NEAR, initial_frames

NO_CONTACT = ('time', 'place', 'direction', 'speed', 'acceleration', 'temperature')
"""What effects may depend on that no contact tells of."""
NOT_TOLD = 'contacts do not tell of it'
"""Why such an effect is not considered."""


def aligned(
    recordings: Recording | Sequence[Recording],
    robot: Robot,
    align: str | Iterable[str],
    known: Sequence[Effect],
    given: Sequence[int] = (),
) -> tuple[Problem, Model]:
    """
    Return the recordings as a problem, and the model that a search starts from.

    recordings: what an instrument measured comes first in the problem, contacts after it.
    align: fitted in every hypothesis. Of contacts 'tool' where the tool point is not known; 'base'
    where it is not known where it stands, which says nothing where all places are unknown too.
    given: of which of the recordings given each is a part; each by itself when left out.

    Raises DataError: nothing, or nothing inside a joint stream, was measured, or contacts are too few.
    Raises ModelError: ``align`` names something else than base and tool.
    """
    recordings = (recordings,) if isinstance(recordings, Recording) else tuple(recordings)
    align = frames_named(align)
    pairs = list(zip(given or range(len(recordings)), recordings, strict=True))
    tracked = [(k, usable(r)) for k, r in pairs if r.contacts is None]
    touched = [(k, part) for k, r in pairs if r.contacts is not None for part in by_place(r)]
    parts = tuple(k for k, _ in (*tracked, *touched)) if touched else ()
    model = _started([r for _, r in tracked], [r for _, r in touched], robot, align, known)
    counted = next((r.counted for r in recordings if r.counted is not None), None)
    model = replace(model, given=parts, counted=counted)
    return posed([r for _, r in tracked], [r for _, r in touched], model, align), model


def frames_only(recording: Recording, robot: Robot, align: frozenset[str]) -> Model:
    """Return the robot with frames that best agree with a recording; DataError if it has none."""
    problem = Problem((usable(recording),), align)
    start = initial_frames(problem, Model(robot, (robot.T_world_base,)))
    return fit(problem, start, problem.unit_scale()).model


def _started(
    tracked: list[Recording],
    touched: list[Recording],
    robot: Robot,
    align: frozenset[str],
    known: Sequence[Effect],
) -> Model:
    """Return the model with frames to start from: an instrument tells them better than contacts."""
    model = Model(robot, tuple(robot.T_world_base for _ in tracked), tuple(known))
    if tracked:
        model = initial_frames(Problem(tuple(tracked), align), model)
    bases = (*model.bases, *(robot.T_world_base for _ in touched))
    model = replace(model, bases=bases)
    if 'tool' in align and not tracked:
        model = replace(model, robot=model.robot.with_frames(tool=_tool(touched, model)))
    return model


def tracked_part(problem: Problem, model: Model) -> tuple[Problem, Model]:
    kept = [k for k in range(len(problem.recordings)) if problem.contact(k) is None]
    given = tuple(problem.given[k] for k in kept)
    anchor = problem.anchor
    if anchor is not None:
        anchor = replace(anchor, bases=tuple(anchor.bases[k] for k in kept))
    recordings = tuple(problem.recordings[k] for k in kept)
    part = replace(
        problem, recordings=recordings, anchor=anchor, touched=(), given=given, loose=()
    )
    bases = tuple(model.bases[k] for k in kept)
    common = tuple(model.common[k] for k in kept) if model.common else ()
    return part, replace(model, bases=bases, given=given, common=common)


def other_causes(problem: Problem) -> tuple[str, ...]:
    """Return the kinds of effect that no contact tells of; none where an instrument measured."""
    if not problem.untracked:
        return ()
    return tuple(
        name
        for name, kind in REGISTRY.items()
        if (kind.traits.place == 'base' and not problem.placed)
        or kind.traits.depends_on in NO_CONTACT
    )


def _tool(recordings: Sequence[Recording], model: Model) -> Array:
    """Return the tool frame whose point rests at contacts of points, its turn as given."""
    given = model.robot.T_flange_tool
    if _off(recordings, model) < NEAR:
        return given
    bare = replace(model, robot=model.robot.with_frames(tool=np.eye(4)))
    normal = []
    for k, recording in enumerate(recordings):
        contacts = recording.touched
        flange = bare.twin(k).poses(recording, recording.joints.t)
        for contact in contacts.artefact.contacts:
            if contact.kind == 'point':
                index = contacts.of(contact.label)
                normal.append((flange.position[index], flange.rotation[index]))
    if not normal:
        return given
    return transform(given[:3, :3], _tool_point(normal))


def _tool_point(touched: Sequence[tuple[Array, Array]]) -> Array:
    """Return the vector in the flange that stays in place at every contact, shape (3,) [m]."""
    weights: list[Array] = [np.ones(len(point)) for point, _ in touched]
    vector: Array = np.zeros(3)
    for _ in range(REWEIGHTED):
        square, right, off = np.zeros((3, 3)), np.zeros(3), []
        for (point, turn), weight in zip(touched, weights, strict=True):
            share = weight / weight.sum()
            columns = turn - np.einsum('m,mij', share, turn)
            left = share @ point - point
            square += np.einsum('m,mki,mkj', weight, columns, columns)
            right += np.einsum('m,mki,mk', weight, columns, left)
            off.append((columns, left))
        vector = np.asarray(np.linalg.lstsq(square, right, rcond=FLAT)[0], dtype=float)
        weights = [
            1.0 / np.maximum(np.linalg.norm(c @ vector - s, axis=1), LEAST_NOISE) for c, s in off
        ]
    return vector


def _off(recordings: Sequence[Recording], model: Model) -> float:
    sizes = []
    for k, recording in enumerate(recordings):
        points = model.twin(k).poses(recording, recording.joints.t).position
        rows = places(recording.touched, points).rows(points)[0]
        sizes.append(np.linalg.norm(rows, axis=1))
    return float(np.median(np.concatenate(sizes)))
