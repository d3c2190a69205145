# Copyright 2026 weld_twin contributors
# SPDX-License-Identifier: Apache-2.0
"""
How each kind of contact sees the tool point, and what of it is not known.

Every kind is a residual r(p, z) of the tool point p and of unknowns z: zero where p touches. With
``seen`` and ``free`` its change is r - seen dp + free dz, so a column of tool displacements
becomes a column of residuals by one product.
"""

from __future__ import annotations

from dataclasses import dataclass, replace

import numpy as np

from ..arrays import Array
from .artefact import Contact

_LEAST = 1e-9
"""Length [m] that counts as none; keeps a direction from a division by zero."""


@dataclass(frozen=True, eq=False)
class Surface:
    """A contact at the place where it is believed to be."""

    contact: Contact
    point: Array
    """The point, the centre, or a point of the plane or the line, shape (3,) [m]."""
    axis: Array
    """Normal of a plane or direction of a line, shape (3,); unit length."""
    radius: float = 0.0
    """Of a sphere [m]."""

    @classmethod
    def start(cls, contact: Contact, p: Array, value: Array | None) -> Surface:
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
    def _known(cls, contact: Contact, p: Array) -> Surface:
        """Return the contact where it is known to be; a radius that is not, as points have it."""
        axis = np.array([0.0, 0.0, 1.0] if contact.axis is None else contact.axis)
        away = np.linalg.norm(p - np.array(contact.at), axis=1)
        radius = float(np.median(away)) if contact.radius is None else contact.radius
        return cls(contact, np.array(contact.at), axis / np.linalg.norm(axis), radius)

    @property
    def freedom(self) -> int:
        """Return how many unknowns it has."""
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

    def moved(self, step: Array) -> Surface:
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


def _ball(contact: Contact, p: Array, radius: Array | None) -> Surface:
    """Return the centre of points at known or one unknown distance; linear, after subtraction."""
    middle = p.mean(axis=0)
    x = p - middle
    right = (x**2).sum(axis=1) - (0.0 if radius is None else radius**2)
    columns = np.column_stack([2.0 * x, np.ones(len(x))])
    result = np.linalg.lstsq(columns, right, rcond=1e-9)[0]
    size = float(np.sqrt(max(result[3] + result[:3] @ result[:3], _LEAST)))
    size = size if radius is None else float(np.median(radius))
    return Surface(contact, middle + result[:3], np.array([0.0, 0.0, 1.0]), size)
