# Copyright 2026 weld_twin contributors
# SPDX-License-Identifier: Apache-2.0
"""What is touched, sockets, pins, bars and faces, what is known between them, and by which posture."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from itertools import combinations
from typing import Any

import numpy as np
from numpy.typing import NDArray

from ..arm.rotation import rotation_matrix
from ..arrays import Array, readonly
from ..errors import DataError

KINDS = ('point', 'length', 'sphere', 'line', 'plane')
"""What a contact can be; how each is seen is in `surfaces`."""
_LOOSE = 1e-4
"""Uncertainty [m, rad] of a length or angle without one, as of a calliper or a straight edge."""
_FACE = 0.1
"""Length [m] over which the uncertainty of a known place turns a face or an edge: that of a block."""


@dataclass(frozen=True)
class Contact:
    """One thing that the tool point touches; DataError for no such kind, or half a place."""

    label: str
    kind: str = 'point'
    """'point', 'length' (distance from a centre), 'sphere', 'line' or 'plane'."""
    radius: float | None = None
    """Of a sphere, from its centre to the tool point [m]; unknown when left out."""
    at: tuple[float, float, float] | None = None
    """Where it is, in the frame that the base stands in: the point, the centre, or a point of the
    face or the edge [m]. Not known when left out."""
    axis: tuple[float, float, float] | None = None
    """Normal of a plane or direction of a line that is known."""
    sigma: float = _LOOSE
    """Uncertainty of a known place [m]."""

    def __post_init__(self) -> None:
        if self.kind not in KINDS:
            raise DataError(
                f'contact {self.label!r} is of kind {self.kind!r}; a kind is one of '
                + ', '.join(KINDS)
            )
        turned = self.kind in ('plane', 'line')
        if (self.axis is not None) != (turned and self.at is not None):
            need = 'at and axis' if turned else 'at alone'
            raise DataError(f'contact {self.label!r}: a {self.kind} that is known has {need}')
        if self.axis is not None and not np.linalg.norm(self.axis) > 0.0:
            raise DataError(f'contact {self.label!r}: its axis has no direction')
        if not self.sigma > 0.0:
            raise DataError(f'contact {self.label!r}: sigma must be a positive number [m]')

    def as_mapping(self) -> dict[str, Any]:
        """Return what an artefact file says of it."""
        out: dict[str, Any] = {'kind': self.kind}
        if self.radius is not None:
            out['radius'] = self.radius
        if self.at is not None:
            out |= {'at': list(self.at), 'sigma': self.sigma}
        if self.axis is not None:
            out['axis'] = list(self.axis)
        return out

    @property
    def known(self) -> bool:
        """Return whether its place is known."""
        return self.at is not None

    @property
    def sigma_turn(self) -> float:
        """Return the uncertainty [rad] of a known axis."""
        return self.sigma / _FACE


@dataclass(frozen=True)
class Tie:
    """What is known between two contacts."""

    between: tuple[str, str]
    """Two labels."""
    value: float
    sigma: float = _LOOSE
    """Distance [m] of points, centres or parallel planes, or angle of planes [rad]; its uncertainty."""
    kind: str = 'distance'
    """'distance' or 'angle'."""


@dataclass(frozen=True)
class Artefact:
    """
    What is touched, and what is known of it.

    Raises DataError: a label comes twice, a tie names an unknown label, or its value makes no
    sense.
    """

    contacts: tuple[Contact, ...]
    ties: tuple[Tie, ...] = ()

    def __post_init__(self) -> None:
        labels = [contact.label for contact in self.contacts]
        for label in labels:
            if labels.count(label) > 1:
                raise DataError(f'the artefact has two contacts called {label!r}; rename one')
        for tie in self.ties:
            self._check(tie)

    def _check(self, tie: Tie) -> None:
        what = f'the {tie.kind} between {" and ".join(tie.between)}'
        if len(set(tie.between)) != 2:
            raise DataError(f'{what}: name two different contacts')
        kinds = {self.named(label).kind for label in tie.between}
        fit = {'distance': {'point', 'length', 'sphere', 'plane'}, 'angle': {'plane'}}
        if tie.kind not in fit or len(kinds) != 1 or not kinds <= fit[tie.kind]:
            raise DataError(f'{what}: {" and ".join(sorted(kinds))} cannot have one')
        some = tie.value > 0.0 or (tie.kind == 'angle' and tie.value == 0.0)
        if not (np.isfinite(tie.value) and some and tie.sigma > 0.0):
            raise DataError(f'{what}: value and sigma must be positive numbers')

    @property
    def known(self) -> bool:
        """Return whether a place of it is known."""
        return any(contact.known for contact in self.contacts)

    def named(self, label: str) -> Contact:
        """Return the contact of a label; DataError where there is none."""
        for contact in self.contacts:
            if contact.label == label:
                return contact
        known = ', '.join(contact.label for contact in self.contacts)
        raise DataError(f'there is no contact {label!r} in the artefact; it has {known}')

    @classmethod
    def from_mapping(cls, entry: Mapping[str, Any]) -> Artefact:
        """
        Return the artefact of a mapping with 'contacts', 'blocks', 'distances' and 'angles'.

        Parameters
        ----------
        entry : mapping
            'contacts' holds a mapping per label: 'kind', 'radius' [m] of a sphere, and 'at' [m],
            'axis' and 'sigma' [m] where its place is known; 'distances' [m] and 'angles' [rad] are
            lists of 'between', 'value' and 'sigma'. 'blocks' holds a mapping per block, whose faces
            are contacts: 'size' [m] along its x, y and z, 'sigma' [m], and 'at' [m] and 'turn'
            (rotation vector [rad]) of its middle where that is known.

        Raises
        ------
        DataError
            Something in it cannot be understood; the message says what.

        """
        return cls(*_described(entry))

    def as_mapping(self) -> dict[str, Any]:
        """Return what `from_mapping` reads."""
        contacts = {c.label: c.as_mapping() for c in self.contacts}
        out: dict[str, Any] = {'contacts': contacts}
        for kind, name in (('distance', 'distances'), ('angle', 'angles')):
            out[name] = [
                {'between': list(t.between), 'value': t.value, 'sigma': t.sigma}
                for t in self.ties
                if t.kind == kind
            ]
        return out

    def groups(self) -> list[tuple[str, ...]]:
        """Return the labels of contacts that ties hold together; each group is a place."""
        of = {contact.label: k for k, contact in enumerate(self.contacts)}
        for tie in self.ties:
            first, second = (of[label] for label in tie.between)
            of = {label: first if k == second else k for label, k in of.items()}
        numbers = dict.fromkeys(of.values())
        return [tuple(label for label, k in of.items() if k == n) for n in numbers]

    def part(self, labels: Sequence[str]) -> Artefact:
        """Return some of the contacts with the ties among them."""
        return Artefact(
            tuple(contact for contact in self.contacts if contact.label in labels),
            tuple(tie for tie in self.ties if set(tie.between) <= set(labels)),
        )


_ENTRIES = ('contacts', 'blocks', 'distances', 'angles')
"""What an artefact file holds."""
_OF_CONTACT = ('kind', 'radius', 'at', 'axis', 'sigma')
"""What it says of a contact,"""
_OF_BLOCK = ('size', 'sigma', 'square', 'at', 'turn')
"""and of a block."""
_SQUARE = 5e-4
"""Uncertainty [rad] of the angles of a block of which nothing was said: half a millimetre a metre,
what a milled block from any shop has."""


def _described(entry: Mapping[str, Any]) -> tuple[tuple[Contact, ...], tuple[Tie, ...]]:
    """Return the contacts and ties of an artefact file; see `Artefact.from_mapping`."""
    if not isinstance(entry, Mapping) or not set(entry) <= set(_ENTRIES):
        result = ', '.join(map(str, entry)) if isinstance(entry, Mapping) else 'no mapping'
        raise DataError(f'an artefact has contacts, blocks, distances and angles; got {result}')
    contacts = [_contact(str(label), what) for label, what in _mapped(entry, 'contacts')]
    ties: list[Tie] = []
    for label, what in _mapped(entry, 'blocks'):
        faces, between = _block(str(label), what)
        contacts += faces
        ties += between
    for kind, name in (('distance', 'distances'), ('angle', 'angles')):
        ties += [_tie(item, kind, name) for item in _listed(entry.get(name), name)]
    return tuple(contacts), tuple(ties)


def _mapped(entry: Mapping[str, Any], name: str) -> list[tuple[Any, Any]]:
    each = entry.get(name) or {}
    if not isinstance(each, Mapping):
        raise DataError(f'{name} of an artefact: give a mapping from label to what it is')
    return list(each.items())


def _contact(label: str, what: object) -> Contact:
    entry = {'kind': what} if isinstance(what, str) else what
    if not isinstance(entry, Mapping) or not set(entry) <= set(_OF_CONTACT):
        raise DataError(
            f'contact {label!r} has a kind, a radius if it is a sphere, and at, axis and sigma if '
            'its place is known'
        )
    radius = entry.get('radius')
    if radius is not None:
        radius = _number(radius, f'the radius of contact {label!r}')
    return Contact(
        label,
        str(entry.get('kind', 'point')),
        radius,
        _three(entry.get('at'), f'at of contact {label!r}'),
        _three(entry.get('axis'), f'the axis of contact {label!r}'),
        _number(entry.get('sigma', _LOOSE), f'sigma of contact {label!r}'),
    )


def _block(label: str, what: object) -> tuple[list[Contact], list[Tie]]:
    """Return the six faces of a block, 'LABEL +x' to 'LABEL -z', and what ties them."""
    if not isinstance(what, Mapping) or not set(what) <= set(_OF_BLOCK):
        raise DataError(f'block {label!r} has a size, sigma, square, and at and turn if known')
    size = _three(what.get('size'), f'the size of block {label!r}')
    if size is None or min(size) <= 0.0:
        raise DataError(f'block {label!r} needs size: [X, Y, Z], three positive lengths [m]')
    sigma = _number(what.get('sigma', _LOOSE), f'sigma of block {label!r}')
    square = _number(what.get('square', _SQUARE), f'square of block {label!r}')
    at = _three(what.get('at'), f'at of block {label!r}')
    turn = _three(what.get('turn', [0.0, 0.0, 0.0]), f'the turn of block {label!r}')
    faces = []
    for axis, normal in enumerate(rotation_matrix(np.array(turn)).T):
        for sign, name in ((1.0, '+'), (-1.0, '-')):
            text = f'{label} {name}{"xyz"[axis]}'
            if at is None:
                faces.append(Contact(text, 'plane'))
                continue
            middle = np.array(at) + sign * 0.5 * size[axis] * normal
            faces.append(
                Contact(text, 'plane', None, _tuple(middle), _tuple(sign * normal), sigma)
            )
    ties = []
    for (i, one), (j, other) in combinations(enumerate(faces), 2):
        names = (one.label, other.label)
        if i // 2 == j // 2:
            ties += [Tie(names, size[i // 2], sigma), Tie(names, 0.0, square, 'angle')]
        else:
            ties.append(Tie(names, np.pi / 2, square, 'angle'))
    return faces, ties


def _three(value: object, what: str) -> tuple[float, float, float] | None:
    if value is None:
        return None
    if isinstance(value, str) or not isinstance(value, Sequence) or len(value) != 3:
        raise DataError(f'{what} must be three numbers, got {value!r}')
    x, y, z = (_number(part, what) for part in value)
    return x, y, z


def _tuple(values: np.ndarray) -> tuple[float, float, float]:
    x, y, z = (float(value) for value in values)
    return x, y, z


def _listed(entry: object, name: str) -> Sequence[Any]:
    if entry is None:
        return ()
    if not isinstance(entry, Sequence) or isinstance(entry, str):
        raise DataError(f'{name} of an artefact: give a list of between, value and sigma')
    return entry


def _tie(item: object, kind: str, name: str) -> Tie:
    if not isinstance(item, Mapping) or not set(item) <= {'between', 'value', 'sigma'}:
        raise DataError(f'an entry of {name} has between, value and sigma')
    between = item.get('between')
    if isinstance(between, str) or not isinstance(between, Sequence) or len(between) != 2:
        raise DataError(f'an entry of {name} needs between: [LABEL, LABEL]')
    sigma = _number(item.get('sigma', _LOOSE), f'a sigma in {name}')
    value = _number(item.get('value'), f'a value in {name}')
    return Tie((str(between[0]), str(between[1])), value, sigma, kind)


def _number(value: object, what: str) -> float:
    if isinstance(value, bool) or not isinstance(value, int | float):
        raise DataError(f'{what} must be a number, got {value!r}')
    return float(value)


@dataclass(frozen=True, eq=False)
class Contacts:
    """Contacts of the tool point, one for every posture; DataError for one that is not known."""

    artefact: Artefact
    labels: tuple[str, ...]
    """What each posture touched."""
    value: Array | None = None
    """Measured distance from the centre, of contacts of kind 'length', shape (M,) [m]."""
    sigma: Array | None = None
    """Standard deviation of each contact, where known, shape (M,) [m]."""

    def __post_init__(self) -> None:
        for label in dict.fromkeys(self.labels):
            self.artefact.named(label)
        count = (len(self.labels),)
        for name in ('value', 'sigma'):
            given = getattr(self, name)
            if given is not None:
                object.__setattr__(self, name, readonly(given, count, f'{name} of the contacts'))
        if self.sigma is not None and not (self.sigma > 0.0).all():
            raise DataError('sigma of the contacts must be positive [m]')
        lengths = [self.artefact.named(label).kind == 'length' for label in self.labels]
        if any(lengths) and (self.value is None or (self.value[lengths] <= 0.0).any()):
            raise DataError(
                'a contact of kind length needs the measured distance in the column value [m]'
            )

    @property
    def size(self) -> int:
        """Return the number of postures."""
        return len(self.labels)

    def of(self, label: str) -> NDArray[np.intp]:
        """Return the postures that touched one contact."""
        return np.flatnonzero(np.array(self.labels) == label)

    def take(self, index: NDArray[np.intp]) -> Contacts:
        """Return some of the postures, and of the artefact what they touched."""
        labels = tuple(self.labels[k] for k in index)
        return Contacts(
            self.artefact.part(labels),
            labels,
            None if self.value is None else self.value[index],
            None if self.sigma is None else self.sigma[index],
        )

    def parts(self) -> list[NDArray[np.intp]]:
        """Return the postures of every place: contacts that hang together, one kind each."""
        groups = self.artefact.part(self.labels).groups()
        return [np.flatnonzero(np.isin(self.labels, group)) for group in groups]

    @property
    def rows(self) -> int:
        """Return the scalar rows of a posture: 3 for points, 2 for a line, 1 for the others."""
        return max(_ROWS[self.artefact.named(label).kind] for label in set(self.labels))


_ROWS = {'point': 3, 'line': 2, 'length': 1, 'sphere': 1, 'plane': 1}
"""Scalar rows that one posture gives."""
