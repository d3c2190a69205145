# Copyright 2026 weld_twin contributors
# SPDX-License-Identifier: Apache-2.0
"""One split: an arm diagnosed on some places, judged on the others."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import asdict, dataclass
from functools import partial
from pathlib import Path
from time import perf_counter
from typing import Any

import numpy as np

from weld_twin_core.contacts import lengths, spreads
from weld_twin_core.diagnosis import Diagnosis, diagnose
from weld_twin_core.diagnosis.algebra.problem import Model
from weld_twin_core.diagnosis.frames.aligned import aligned
from weld_twin_core.diagnosis.frames.alignment import refined
from weld_twin_core.recording import Recording

from ..study import Parts
from .data import places_of, robot_of, touches

MOSTLY = 0.5
"""Share of a place's postures outside what was recorded from which on the place is flagged."""


@dataclass(frozen=True)
class Judged:
    """
    A place that took no part, before and after.

    Attributes
    ----------
    place : str
    before_m, after_m : float [m]
        Mean distance of the predicted ball from the middle of its socket; before, the tool point
        alone is fitted to the places used.
    each_axis_m : float [m]
        The same after, as the mean of the size of every coordinate.
    distance_m : float [m]
        Of the two sockets, as predicted.

    """

    place: str
    before_m: float
    after_m: float
    each_axis_m: float
    distance_m: float


def split(data: Path, arm: str, used: Sequence[str], judged: Sequence[str]) -> dict[str, Any]:
    """
    Return what a diagnosis of some places makes of others.

    Parameters
    ----------
    data : Path
    arm : str
    used, judged : sequence of str
        Places.

    """
    robot, recording = robot_of(data, arm), touches(data, arm, used)
    start = perf_counter()
    found = diagnose(recording, robot, align='tool')
    took = perf_counter() - start
    before = refined(*aligned(recording, robot, 'tool', ()))
    rows = [judge(place, before, found.model, touches(data, arm, [place])) for place in judged]
    return {
        'arm': arm,
        'used': list(used),
        'status': found.status,
        'named': [' '.join(filter(None, (e.effect.name, e.effect.site))) for e in found.effects],
        'told_held_out_m': None if found.contacts is None else found.contacts.held_out_spread_m,
        'seconds': took,
        'flagged': flagged(found, data, arm, judged),
        'judged': [asdict(row) for row in rows],
    }


def judge(place: str, before: Model, after: Model, recording: Recording) -> Judged:
    """
    Return how well a place is predicted by two models.

    Parameters
    ----------
    place : str
    before, after : Model
    recording : Recording
        Of this place alone.

    """
    contacts = recording.contacts
    assert contacts is not None
    points = [m.twin(0).poses(recording, recording.joints.t).position for m in (before, after)]
    each = [np.concatenate(list(spreads(contacts, p).values())) for p in points]
    axes = [
        np.abs(points[1][contacts.of(label)] - points[1][contacts.of(label)].mean(axis=0)).mean()
        for label in dict.fromkeys(contacts.labels)
    ]
    return Judged(
        place,
        float(each[0].mean()),
        float(each[1].mean()),
        float(np.mean(axes)),
        lengths(contacts, points[1])[0].found,
    )


def flagged(found: Diagnosis, data: Path, arm: str, judged: Sequence[str]) -> list[str]:
    """Return the judged places of which the model says itself that it was not fitted there."""
    if found.posterior is None:
        return []
    out = []
    for place in judged:
        recording = touches(data, arm, [place])
        beyond = np.zeros(recording.joints.t.size, dtype=bool)
        for item in found.posterior.domain.outside(recording.joints.q):
            beyond[item.first : item.last + 1] = True
        if float(beyond.mean()) > MOSTLY:
            out.append(place)
    return out


def entries_of(data: Path, arms: Sequence[str], part: Parts) -> list[dict[str, Any]]:
    """
    Return every split of some arms: each place left out, and each place alone.

    Parameters
    ----------
    data : Path
    arms : sequence of str
    part : Parts
        Keeps every split.

    """
    found = []
    for arm in arms:
        every = places_of(data, arm)
        for place in every:
            rest = [other for other in every if other != place]
            for kind, used, judged in (('without', rest, [place]), ('only', [place], rest)):
                make = partial(split, data, arm, used, judged)
                found.append({'kind': kind, **part(f'{arm}_{kind}_{place}', make)})
    return found
