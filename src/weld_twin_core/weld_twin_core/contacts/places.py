# Copyright 2026 weld_twin contributors
# SPDX-License-Identifier: Apache-2.0
"""
Where contacts are, from the tool points that touched them, and how each kind sees a tool point.

Every kind is a residual r(p, z) of the tool point p and of unknowns z: zero where p touches. With
``seen`` and ``free`` its change is r - seen dp + free dz, so a column of tool displacements
becomes a column of residuals by one product.
"""

from __future__ import annotations

from dataclasses import dataclass, replace
from typing import NamedTuple

import numpy as np

from ..arrays import Array
from .artefact import Artefact, Contact, Contacts, Tie

_RANK = 1e-9
"""Share of the largest singular value below which a combination of unknowns is not determined."""


@dataclass(frozen=True, eq=False)
class Unknowns:
    """
    What one place has of unknowns, at one set of tool points.

    A place is best where it makes the squares least. With its unknowns z linear, r + K z, and known
    lengths as further rows G z of their own uncertainty, the least sum of squares is r' S r with
    S = I - K (K'K + G'G)^-1 K'. Rows times the root of S are therefore what is left of a residual,
    and of every column, once the places were fitted: variable projection [1]_.

    References
    ----------
    .. [1] L. Kaufman, "A variable projection method for solving separable nonlinear least squares
       problems", BIT 15, 1975.

    """

    seen: Array
    """What each row sees of a displacement of the tool point, shape (M, c, 3)."""
    free: Array
    """Change of each row with the unknowns, shape (M, c, Z)."""
    ties: Array
    """Change of what is known with the unknowns, over its uncertainty [1/m], shape (T, Z)."""

    def eliminated(self, unit: Array) -> tuple[Array, Array]:
        """
        Return orthonormal directions (k, rows) that places can take up, and the share they leave.

        Whitened rows, by ``unit`` (M,) [1/m] in each posture, lose ``(1 - left) * u (u' rows)``
        along each.
        """
        count = self.free.shape[0] * self.free.shape[1]
        columns = (unit[:, None, None] * self.free).reshape(count, -1)
        both = np.concatenate([columns, self.ties])
        size = np.maximum(np.linalg.norm(both, axis=0), 1e-300)
        basis, strength, _ = np.linalg.svd(both / size, full_matrices=False)
        basis = basis[:count, strength > _RANK * strength.max(initial=0.0)]
        directions, taken, _ = np.linalg.svd(basis, full_matrices=False)
        remaining = np.sqrt(np.clip(1.0 - taken**2, 0.0, 1.0))
        return directions.T, np.where(remaining < 1e-7, 0.0, remaining)

    @property
    def freedom(self) -> int:
        """Return the number of unknowns."""
        return int(self.free.shape[2])


def unknowns(contacts: Contacts, points: Array) -> Unknowns:
    """Return the unknowns of the contacts of a place at tool points, shape (M, 3) [m]."""
    here = places(contacts, points)
    _, seen, free = here.rows(points)
    _, change, sigma = here.ties()
    return Unknowns(seen, free, change / sigma[:, None])


_LEAST = 1e-9
"""Length [m] that counts as none; keeps a direction from a division by zero."""


@dataclass(frozen=True, eq=False)
class _Surface:
    """A contact at the place where it is believed to be."""

    contact: Contact
    point: Array
    """The point, the centre, or a point of the plane or the line, shape (3,) [m]."""
    axis: Array
    """Normal of a plane or direction of a line, shape (3,); unit length."""
    radius: float = 0.0
    """Of a sphere [m]."""

    @classmethod
    def start(cls, contact: Contact, p: Array, value: Array | None) -> _Surface:
        """Return the contact where points (m, 3), with distances (m,) of a 'length', put it."""
        if contact.at is not None:
            return cls._known(contact, p)
        middle = np.median(p, axis=0)
        _, _, axes = np.linalg.svd(p - p.mean(axis=0), full_matrices=True)
        if contact.kind == 'line':
            return cls(contact, middle, axes[0])
        if contact.kind == 'plane':
            return cls(contact, p.mean(axis=0), axes[2])
        if contact.kind in ('sphere', 'length'):
            known = value if contact.kind == 'length' else None
            if known is None and contact.radius is not None:
                known = np.full(len(p), contact.radius)
            return _ball(contact, p, known)
        return cls(contact, middle, axes[2])

    @classmethod
    def _known(cls, contact: Contact, p: Array) -> _Surface:
        """Return the contact where it is known to be; a radius that is not, as points have it."""
        axis = np.array([0.0, 0.0, 1.0] if contact.axis is None else contact.axis)
        away = np.linalg.norm(p - np.array(contact.at), axis=1)
        radius = float(np.median(away)) if contact.radius is None else contact.radius
        return cls(contact, np.array(contact.at), axis / np.linalg.norm(axis), radius)

    @property
    def freedom(self) -> int:
        free_radius = self.contact.kind == 'sphere' and self.contact.radius is None
        return {'plane': 3, 'line': 4}.get(self.contact.kind, 3) + free_radius

    @property
    def across(self) -> Array:
        """Return two directions square to the axis, shape (2, 3)."""
        other = np.eye(3)[int(np.argmin(np.abs(self.axis)))]
        first = np.cross(self.axis, other)
        first /= np.linalg.norm(first)
        return np.stack([first, np.cross(self.axis, first)])

    def rows(self, p: Array, value: Array | None) -> tuple[Array, Array, Array]:
        """Return residual (m, c), what it sees of points (m, c, 3), and unknowns (m, c, z)."""
        count, away = len(p), p - self.point
        if self.contact.kind == 'point':
            every = np.broadcast_to(np.eye(3), (count, 3, 3))
            return -away, every, every
        if self.contact.kind == 'line':
            ways = self.across
            seen = np.broadcast_to(ways, (count, 2, 3))
            along = (away @ self.axis)[:, None, None] * np.eye(2)
            shift = np.broadcast_to(np.eye(2), (count, 2, 2))
            return -away @ ways.T, seen, np.concatenate([shift, along], axis=2)
        if self.contact.kind == 'plane':
            seen = np.broadcast_to(self.axis, (count, 1, 3))
            free = np.concatenate([np.ones((count, 1)), -away @ self.across.T], axis=1)
            return -(away @ self.axis)[:, None], seen, free[:, None]
        far = np.linalg.norm(away, axis=1)
        seen = (away / np.maximum(far, _LEAST)[:, None])[:, None]
        radius = self.radius if self.contact.kind == 'sphere' or value is None else value
        free = seen
        if self.freedom == 4:
            free = np.concatenate([seen, np.ones((count, 1, 1))], axis=2)
        return (radius - far)[:, None], seen, free

    def moved(self, step: Array) -> _Surface:
        """Return the contact after a step of its unknowns, shape (z,)."""
        if self.contact.kind == 'plane':
            axis = self.axis + step[1:] @ self.across
            point = self.point + step[0] * self.axis
        elif self.contact.kind == 'line':
            axis = self.axis + step[2:] @ self.across
            point = self.point + step[:2] @ self.across
        else:
            more = step[3] if self.freedom == 4 else 0.0
            return replace(self, point=self.point + step[:3], radius=self.radius + more)
        return replace(self, point=point, axis=axis / np.linalg.norm(axis))

    def from_known_place(self) -> tuple[Array, Array, Array]:
        """Return how far it is from its known place (k,), if any, change (k, z) and uncertainty (k,)."""
        known = self.contact
        if known.at is None:
            return np.zeros(0), np.zeros((0, self.freedom)), np.zeros(0)
        away = self.point - np.array(known.at)
        if known.axis is None:
            return away, np.eye(3, self.freedom), np.full(3, known.sigma)
        normal = np.array(known.axis) / np.linalg.norm(known.axis)
        tilt = -self.across @ normal * np.sign(self.axis @ normal)
        shift = [away @ self.axis] if known.kind == 'plane' else self.across @ away
        off = np.concatenate([shift, tilt])
        sigma = np.full(off.size, known.sigma)
        sigma[-2:] = known.sigma_turn
        return off, np.eye(off.size), sigma

    def foot(self, p: Array) -> Array:
        """Return the place of the contact that is nearest to tool points, shape (m, 3) [m]."""
        away = p - self.point
        if self.contact.kind == 'line':
            return np.asarray(self.point + np.outer(away @ self.axis, self.axis))
        if self.contact.kind == 'plane':
            return np.asarray(p - np.outer(away @ self.axis, self.axis))
        if self.contact.kind == 'point':
            return np.broadcast_to(self.point, p.shape)
        far = np.maximum(np.linalg.norm(away, axis=1), _LEAST)
        radius = self.radius or float(np.median(far))
        return np.asarray(self.point + away * (radius / far)[:, None])


def _ball(contact: Contact, p: Array, radius: Array | None) -> _Surface:
    """Return the centre of points at known or one unknown distance; linear, after subtraction."""
    middle = p.mean(axis=0)
    x = p - middle
    right = (x**2).sum(axis=1) - (0.0 if radius is None else radius**2)
    columns = np.column_stack([2.0 * x, np.ones(len(x))])
    result = np.linalg.lstsq(columns, right, rcond=1e-9)[0]
    size = float(np.sqrt(max(result[3] + result[:3] @ result[:3], _LEAST)))
    size = size if radius is None else float(np.median(radius))
    return _Surface(contact, middle + result[:3], np.array([0.0, 0.0, 1.0]), size)


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
    surfaces: tuple[_Surface, ...]
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


def _tied(tie: Tie, first: _Surface, second: _Surface) -> tuple[Array, Array, Array]:
    """Return how far a tie is off (t,), and its change with the leading unknowns of both."""
    if tie.kind == 'angle':
        return _parallel(first, second) if tie.value == 0.0 else _turned(tie, first, second)
    if first.contact.kind == 'plane':
        return _apart(tie, first, second)
    away = first.point - second.point
    far = max(float(np.linalg.norm(away)), 1e-9)
    way = (away / far)[None]
    return np.array([far - tie.value]), way, -way


def _turned(tie: Tie, first: _Surface, second: _Surface) -> tuple[Array, Array, Array]:
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


def _parallel(first: _Surface, second: _Surface) -> tuple[Array, Array, Array]:
    """Return what the normals of two parallel planes differ by, as two ties."""
    sign = 1.0 if first.axis @ second.axis >= 0.0 else -1.0
    ways = first.across
    off = sign * (ways @ second.axis)
    one, two = np.zeros((2, 3)), np.zeros((2, 3))
    one[:, 1:], two[:, 1:] = -np.eye(2), sign * (ways @ second.across.T)
    return off, one, two


def _apart(tie: Tie, first: _Surface, second: _Surface) -> tuple[Array, Array, Array]:
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
        surfaces.append(_Surface.start(contact, points[index], value))
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
