# Copyright 2026 weld_twin contributors
# SPDX-License-Identifier: Apache-2.0
"""Where contacts are, told by the tool points that touched them; known lengths are kept."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from ..arrays import Array
from .artefact import Tie
from .contacts import Contacts
from .surfaces import Surface

ROUNDS = 8
"""Steps at the most; two are enough for points, five for faces found at first sight."""
SETTLED = 1e-9
"""Step [m, rad] below which a place stays."""
HUBER = 3.0
"""A contact this many robust deviations off starts to lose weight: one in a wrong socket."""
NORMAL = 1.4826
"""Standard deviation of normal numbers over the median of their size."""
FIRM = 1e3
"""Weight of a known length against a contact: it is kept, and how far it may give is counted when
unknowns are taken out."""


@dataclass(frozen=True, eq=False)
class Places:
    """
    Contacts where tool points put them.

    Attributes
    ----------
    contacts : Contacts
        Of one place: all of them with the same number of rows.
    surfaces : tuple of Surface
        In the order of the artefact.

    """

    contacts: Contacts
    surfaces: tuple[Surface, ...]

    def rows(self, points: Array) -> tuple[Array, Array, Array]:
        """
        Return residual (M, c), what it sees (M, c, 3), and all unknowns (M, c, Z).

        Parameters
        ----------
        points : array, shape (M, 3) [m]

        """
        count, c = self.contacts.size, self.contacts.rows
        total = sum(surface.freedom for surface in self.surfaces)
        residual, seen = np.zeros((count, c)), np.zeros((count, c, 3))
        free = np.zeros((count, c, total))
        at = 0
        for surface in self.surfaces:
            index = self.contacts.of(surface.contact.label)
            value = None if self.contacts.value is None else self.contacts.value[index]
            own = surface.rows(points[index], value)
            residual[index], seen[index] = own[0], own[1]
            free[index, :, at : at + surface.freedom] = own[2]
            at += surface.freedom
        return residual, seen, free

    def ties(self) -> tuple[Array, Array]:
        """Return how far ties are from what is known (T,), and their change with unknowns (T, Z)."""
        ends = np.cumsum([0, *(surface.freedom for surface in self.surfaces)])
        where = {s.contact.label: k for k, s in enumerate(self.surfaces)}
        ties = self.contacts.artefact.ties
        off, change = np.zeros(len(ties)), np.zeros((len(ties), ends[-1]))
        for t, tie in enumerate(ties):
            first, second = (where[label] for label in tie.between)
            off[t], one, other = _tied(tie, self.surfaces[first], self.surfaces[second])
            change[t, ends[first] : ends[first] + one.size] = one
            change[t, ends[second] : ends[second] + other.size] = other
        return off, change

    def moved(self, step: Array) -> Places:
        """Return the places after a step of all unknowns, shape (Z,)."""
        ends = np.cumsum([surface.freedom for surface in self.surfaces])
        parts = np.split(step, ends[:-1])
        pairs = zip(self.surfaces, parts, strict=True)
        return Places(self.contacts, tuple(surface.moved(part) for surface, part in pairs))

    def foot(self, points: Array) -> Array:
        """Return where on its contact each tool point should have been, shape (M, 3) [m]."""
        out = np.array(points)
        for surface in self.surfaces:
            index = self.contacts.of(surface.contact.label)
            out[index] = surface.foot(points[index])
        return out


def _tied(tie: Tie, first: Surface, second: Surface) -> tuple[float, Array, Array]:
    """Return how far a tie is off, and its change with the leading unknowns of both."""
    if tie.kind == 'angle':
        cosine = float(first.axis @ second.axis)
        sign = 1.0 if cosine * np.cos(tie.value) >= 0.0 else -1.0
        sine = max(float(np.sin(tie.value)), 1e-3)
        change = [
            sign / sine * np.concatenate([[0.0], one.across @ other.axis])
            for one, other in ((first, second), (second, first))
        ]
        return (sign * cosine - float(np.cos(tie.value))) / sine, change[0], change[1]
    away = first.point - second.point
    far = max(float(np.linalg.norm(away)), 1e-9)
    return far - tie.value, away / far, -away / far


def places(contacts: Contacts, points: Array) -> Places:
    """
    Return where contacts are, from the tool points that touched them.

    Least squares that gives gross outliers little weight; known distances and angles are met.

    Parameters
    ----------
    contacts : Contacts
        Of one place.
    points : array, shape (M, 3) [m]

    """
    surfaces = []
    for contact in contacts.artefact.contacts:
        index = contacts.of(contact.label)
        value = None if contacts.value is None else contacts.value[index]
        surfaces.append(Surface.start(contact, points[index], value))
    now = Places(contacts, tuple(surfaces))
    for _ in range(ROUNDS):
        step = _step(now, points)
        now = now.moved(step)
        if np.abs(step).max(initial=0.0) < SETTLED:
            break
    return now


def _step(now: Places, points: Array) -> Array:
    """Return one reweighted Gauss-Newton step of the unknowns, shape (Z,)."""
    residual, _, free = now.rows(points)
    size = np.linalg.norm(residual, axis=1) / np.sqrt(residual.shape[1])
    spread = max(NORMAL * float(np.median(size)), 1e-9)
    weight = np.sqrt(np.minimum(1.0, HUBER * spread / np.maximum(size, 1e-12)))[:, None]
    off, change = now.ties()
    firm = FIRM * np.sqrt(residual.size)
    columns = np.concatenate(
        [(weight[..., None] * free).reshape(-1, free.shape[2]), firm * change]
    )
    right = -np.concatenate([(weight * residual).ravel(), firm * off])
    return np.asarray(np.linalg.lstsq(columns, right, rcond=1e-12)[0])
