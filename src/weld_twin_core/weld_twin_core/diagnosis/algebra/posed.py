# Copyright 2026 weld_twin contributors
# SPDX-License-Identifier: Apache-2.0
"""The problem that recordings pose at a model: contacts are one recording for each place."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import replace

from ...contacts import places
from ...errors import DataError
from ...recording import Measurements, Recording
from .problem import Anchor, Model, Problem

FEWEST = 2
"""Postures that one contact needs at the least: of a single one its unknown place takes everything."""


def by_place(recording: Recording) -> list[Recording]:
    """Return the contacts of every place as a recording of its own; refuse too few of one."""
    contacts = recording.touched
    for label in dict.fromkeys(contacts.labels):
        if contacts.of(label).size < FEWEST and not contacts.artefact.named(label).known:
            raise DataError(
                f'contact {label!r} of {recording.name} has {contacts.of(label).size} postures; '
                f'touch it in at least {FEWEST}'
            )
    out = []
    for index in contacts.parts():
        part = contacts.take(index)
        t, q = recording.joints.t[index], recording.joints.q[index]
        motion = replace(recording.joints, t=t, q=q, qd=None)
        name = '+'.join(contact.label for contact in part.artefact.contacts)
        out.append(replace(recording, name=name, joints=motion, contacts=part))
    return out


def posed(
    tracked: Sequence[Recording], touched: Sequence[Recording], model: Model, align: frozenset[str]
) -> Problem:
    """Return the problem of what was measured and of places touched (`by_place`), at a model."""
    filled = [_filled(part, model, k) for k, part in enumerate(touched, len(tracked))]
    anchor = Anchor(model.bases, model.robot.T_flange_tool)
    problem = Problem((*tracked, *filled), align, anchor, given=model.given).touching(model)
    if problem.untracked and not problem.placed:
        return replace(problem, align=align & {'tool'})
    return problem


def _filled(recording: Recording, model: Model, k: int) -> Recording:
    """Return the recording with what its contacts measure at the model, for pictures."""
    points = model.twin(k).poses(recording, recording.joints.t).position
    where = places(recording.touched, points).foot(points)
    return recording.with_measured(Measurements(recording.joints.t, where))
