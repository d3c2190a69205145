# Copyright 2026 weld_twin contributors
# SPDX-License-Identifier: Apache-2.0
"""Where contacts are, from the tool points that touched them, and how far these are from there."""

from __future__ import annotations

from dataclasses import dataclass, replace
from typing import NamedTuple

import numpy as np

from ..arrays import Array
from .artefact import Artefact, Contacts, Tie
from .surfaces import Surface

_ROUNDS = 8
"""Steps at the most; two are enough for points, five for faces found at first sight."""
_SETTLED = 1e-9
"""Step [m, rad] below which a place stays."""
_HUBER = 3.0
"""A contact this many robust deviations off starts to lose weight: one in a wrong socket."""
_NORMAL = 1.4826
"""Standard deviation of normal numbers over the median of their size."""
_FIRM = 1e3
"""Weight of a known length against a contact: it is kept; how far it may give is counted elsewhere."""


@dataclass(frozen=True, eq=False)
class Places:
    """Contacts where tool points put them."""

    contacts: Contacts
    """Of one place: all of them with the same number of rows."""
    surfaces: tuple[Surface, ...]
    """In the order of the artefact."""

    def rows(self, points: Array) -> tuple[Array, Array, Array]:
        """Return residual (M, c), what it sees of points (M, c, 3), and all unknowns (M, c, Z)."""
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

    def ties(self) -> tuple[Array, Array, Array]:
        """Return how far off what is known is (T,), change (T, Z), uncertainty (T,) [m or rad]."""
        ends = np.cumsum([0, *(surface.freedom for surface in self.surfaces)])
        where = {s.contact.label: k for k, s in enumerate(self.surfaces)}
        parts = []
        for tie in self.contacts.artefact.ties:
            first, second = (where[label] for label in tie.between)
            off, *both = _tied(tie, self.surfaces[first], self.surfaces[second])
            change = np.zeros((off.size, ends[-1]))
            for k, own in zip((first, second), both, strict=True):
                change[:, ends[k] : ends[k] + own.shape[1]] = own
            parts.append((off, change, np.full(off.size, tie.sigma)))
        for k, surface in enumerate(self.surfaces):
            off, own, sigma = surface.from_known_place()
            change = np.zeros((off.size, ends[-1]))
            change[:, ends[k] : ends[k + 1]] = own
            parts.append((off, change, sigma))
        offs, changes, sigmas = zip(*parts, strict=True)
        return np.concatenate(offs), np.concatenate(changes), np.concatenate(sigmas)

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


def _tied(tie: Tie, first: Surface, second: Surface) -> tuple[Array, Array, Array]:
    """Return how far a tie is off (t,), and its change with the leading unknowns of both."""
    if tie.kind == 'angle':
        return _parallel(first, second) if tie.value == 0.0 else _turned(tie, first, second)
    if first.contact.kind == 'plane':
        return _apart(tie, first, second)
    away = first.point - second.point
    far = max(float(np.linalg.norm(away)), 1e-9)
    way = (away / far)[None]
    return np.array([far - tie.value]), way, -way


def _turned(tie: Tie, first: Surface, second: Surface) -> tuple[Array, Array, Array]:
    """Return the angle of two planes that are not parallel, as a tie."""
    cosine = float(first.axis @ second.axis)
    # Normals point to either side; of square planes it makes no difference.
    sign = -1.0 if cosine * np.cos(tie.value) < -1e-9 else 1.0
    sine = max(float(np.sin(tie.value)), 1e-3)
    one, two = (
        sign / sine * np.concatenate([[0.0], a.across @ b.axis])[None]
        for a, b in ((first, second), (second, first))
    )
    return np.array([(sign * cosine - float(np.cos(tie.value))) / sine]), one, two


def _parallel(first: Surface, second: Surface) -> tuple[Array, Array, Array]:
    """Return what the normals of two parallel planes differ by, as two ties."""
    sign = 1.0 if first.axis @ second.axis >= 0.0 else -1.0
    ways = first.across
    off = sign * (ways @ second.axis)
    one, two = np.zeros((2, 3)), np.zeros((2, 3))
    one[:, 1:], two[:, 1:] = -np.eye(2), sign * (ways @ second.across.T)
    return off, one, two


def _apart(tie: Tie, first: Surface, second: Surface) -> tuple[Array, Array, Array]:
    """Return how far two parallel planes lie apart along the normal of the first, as a tie."""
    away = first.point - second.point
    far = float(away @ first.axis)
    sign = 1.0 if far >= 0.0 else -1.0
    one = sign * np.concatenate([[1.0], first.across @ away])[None]
    two = sign * np.array([[-float(first.axis @ second.axis), 0.0, 0.0]])
    return np.array([abs(far) - tie.value]), one, two


def places(contacts: Contacts, points: Array) -> Places:
    """Return where contacts are, by tool points (M, 3) [m] that touched them; outliers count little."""
    surfaces = []
    for contact in contacts.artefact.contacts:
        index = contacts.of(contact.label)
        value = None if contacts.value is None else contacts.value[index]
        surfaces.append(Surface.start(contact, points[index], value))
    now = Places(contacts, tuple(surfaces))
    for _ in range(_ROUNDS):
        step = _step(now, points)
        now = now.moved(step)
        if np.abs(step).max(initial=0.0) < _SETTLED:
            break
    return now


def _step(now: Places, points: Array) -> Array:
    """Return one reweighted Gauss-Newton step of the unknowns, shape (Z,)."""
    residual, _, free = now.rows(points)
    size = np.linalg.norm(residual, axis=1) / np.sqrt(residual.shape[1])
    spread = max(_NORMAL * float(np.median(size)), 1e-9)
    weight = np.sqrt(np.minimum(1.0, _HUBER * spread / np.maximum(size, 1e-12)))[:, None]
    off, change, _ = now.ties()
    firm = _FIRM * np.sqrt(residual.size)
    columns = np.concatenate(
        [(weight[..., None] * free).reshape(-1, free.shape[2]), firm * change]
    )
    right = -np.concatenate([(weight * residual).ravel(), firm * off])
    return np.asarray(np.linalg.lstsq(columns, right, rcond=1e-12)[0])


class Length(NamedTuple):
    """A known distance [m] or angle [rad], and what tool points make of it."""

    tie: Tie
    measured: float


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
    ties = [t for t in contacts.artefact.ties if set(t.between) <= set(contacts.labels)]
    return [Length(tie, _measured(tie, contacts, points)) for tie in ties]


def _measured(tie: Tie, contacts: Contacts, points: Array) -> float:
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
