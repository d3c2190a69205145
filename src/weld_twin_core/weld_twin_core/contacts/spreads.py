# Copyright 2026 weld_twin contributors
# SPDX-License-Identifier: Apache-2.0
"""How well contacts agree: how far tool points are from where they touched, and known lengths."""

from __future__ import annotations

from dataclasses import replace
from typing import NamedTuple

import numpy as np

from ..arrays import Array
from .artefact import Artefact
from .contact import Tie
from .contacts import Contacts
from .places import places


class Length(NamedTuple):
    """A known distance [m] or angle [rad], and what tool points make of it."""

    tie: Tie
    found: float


def spreads(contacts: Contacts, points: Array) -> dict[str, Array]:
    """
    Return how far tool points (M, 3) are from their contact, (m,) [m] per label.

    Every contact is put where its own points have it: of a point that is their mean, so that the
    mean of these distances is the usual spread. Known lengths are not used; a contact whose place
    is known stays.
    """
    out = {}
    for label in dict.fromkeys(contacts.labels):
        index = contacts.of(label)
        contact = contacts.artefact.named(label)
        if contact.kind == 'point' and not contact.known:
            away = points[index] - points[index].mean(axis=0)
        else:
            alone = contacts.take(index)
            away = places(alone, points[index]).rows(points[index])[0]
        out[label] = np.linalg.norm(away, axis=1)
    return out


def lengths(contacts: Contacts, points: Array) -> list[Length]:
    """Return what tool points, shape (M, 3) [m], make of the known distances and angles."""
    out = []
    artefact = contacts.artefact
    for tie in artefact.ties:
        if not set(tie.between) <= set(contacts.labels):
            continue
        out.append(Length(tie, _found(tie, contacts, points)))
    return out


def _found(tie: Tie, contacts: Contacts, points: Array) -> float:
    """Return what tool points make of a tie, each contact where its own points have it."""
    ends = []
    for label in tie.between:
        index = contacts.of(label)
        alone = contacts.take(index)
        free = tuple(replace(c, at=None, axis=None) for c in alone.artefact.contacts)
        bare = Contacts(Artefact(free), alone.labels, alone.value)
        ends.append(places(bare, points[index]).surfaces[0])
    if tie.kind == 'angle':
        cosine = abs(float(ends[0].axis @ ends[1].axis))
        return float(np.arccos(min(cosine, 1.0)))
    kind = ends[0].contact.kind
    middles = [end.point for end in ends]
    if kind == 'point':
        middles = [points[contacts.of(label)].mean(axis=0) for label in tie.between]
    away = middles[0] - middles[1]
    return abs(float(away @ ends[0].axis)) if kind == 'plane' else float(np.linalg.norm(away))
