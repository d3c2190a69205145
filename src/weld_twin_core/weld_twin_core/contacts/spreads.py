# Copyright 2026 weld_twin contributors
# SPDX-License-Identifier: Apache-2.0
"""How well contacts agree: how far tool points are from where they touched, and known lengths."""

from __future__ import annotations

from typing import NamedTuple

import numpy as np

from ..arrays import Array
from .artefact import Artefact, Tie
from .contacts import Contacts
from .places import places


class Length(NamedTuple):
    """A known distance [m] or angle [rad], and what tool points make of it."""

    tie: Tie
    found: float


def spreads(contacts: Contacts, points: Array) -> dict[str, Array]:
    """
    Return how far tool points are from their contact, (m,) [m] per label.

    Every contact is put where its own points have it: of a point that is their mean, so that the
    mean of these distances is the usual spread. Known lengths are not used.

    Parameters
    ----------
    contacts : Contacts
    points : array, shape (M, 3) [m]

    """
    out = {}
    for label in dict.fromkeys(contacts.labels):
        index = contacts.of(label)
        if contacts.artefact.named(label).kind == 'point':
            away = points[index] - points[index].mean(axis=0)
        else:
            alone = contacts.take(index)
            away = places(alone, points[index]).rows(points[index])[0]
        out[label] = np.linalg.norm(away, axis=1)
    return out


def lengths(contacts: Contacts, points: Array) -> list[Length]:
    """
    Return what tool points make of the known distances and angles.

    Parameters
    ----------
    contacts : Contacts
    points : array, shape (M, 3) [m]

    """
    out = []
    artefact = contacts.artefact
    for tie in artefact.ties:
        if not set(tie.between) <= set(contacts.labels):
            continue
        ends = []
        for label in tie.between:
            index = contacts.of(label)
            alone = contacts.take(index)
            bare = Contacts(Artefact(alone.artefact.contacts), alone.labels, alone.value)
            ends.append(places(bare, points[index]).surfaces[0])
        if tie.kind == 'distance':
            if artefact.named(tie.between[0]).kind == 'point':
                middles = [points[contacts.of(label)].mean(axis=0) for label in tie.between]
            else:
                middles = [end.point for end in ends]
            found = float(np.linalg.norm(middles[0] - middles[1]))
        else:
            cosine = abs(float(ends[0].axis @ ends[1].axis))
            found = float(np.arccos(min(cosine, 1.0)))
        out.append(Length(tie, found))
    return out
