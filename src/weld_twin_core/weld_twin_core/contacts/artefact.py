# Copyright 2026 weld_twin contributors
# SPDX-License-Identifier: Apache-2.0
"""What is touched: sockets, pins, bars and faces, and the lengths and angles between them."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from typing import Any

import numpy as np

from ..errors import DataError

KINDS = ('point', 'length', 'sphere', 'line', 'plane')
"""What a contact can be; how each is seen is in `surfaces`."""
TIED = ('distance', 'angle')
"""What ties two contacts: the distance of two points, the angle of two planes."""
LOOSE = 1e-4
"""Uncertainty [m, rad] of a length or an angle that came without one: a calliper's reading, and a
tenth of a millimetre over a metre of straight edge."""


@dataclass(frozen=True)
class Contact:
    """
    One thing that the tool point touches in many postures.

    Attributes
    ----------
    label : str
    kind : str
        'point', 'length' (distance from a centre), 'sphere', 'line' or 'plane'.
    radius : float, optional [m]
        Of a sphere, from its centre to the tool point; unknown when left out.

    Raises
    ------
    DataError
        There is no such kind.

    """

    label: str
    kind: str = 'point'
    radius: float | None = None

    def __post_init__(self) -> None:
        if self.kind not in KINDS:
            raise DataError(
                f'contact {self.label!r} is of kind {self.kind!r}; a kind is one of '
                + ', '.join(KINDS)
            )


@dataclass(frozen=True)
class Tie:
    """
    What is known between two contacts.

    Attributes
    ----------
    between : tuple of str
        Two labels.
    value, sigma : float
        Distance [m] of two points or centres, or angle [rad] of two planes; its uncertainty.
    kind : str
        'distance' or 'angle'.

    """

    between: tuple[str, str]
    value: float
    sigma: float = LOOSE
    kind: str = 'distance'


@dataclass(frozen=True)
class Artefact:
    """
    What is touched, and what is known of it.

    Attributes
    ----------
    contacts : tuple of Contact
    ties : tuple of Tie

    Raises
    ------
    DataError
        A label comes twice, a tie names an unknown label, or its value makes no sense.

    Examples
    --------
    >>> from weld_twin_core.contacts import Artefact
    >>> plate = Artefact.from_mapping({
    ...     'contacts': {'a': {'kind': 'point'}, 'b': {'kind': 'point'}},
    ...     'distances': [{'between': ['a', 'b'], 'value': 0.05, 'sigma': 0.0001}],
    ... })
    >>> plate.ties[0].value
    0.05

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
        fit = {'distance': {'point', 'length', 'sphere'}, 'angle': {'plane'}}
        if tie.kind not in fit or len(kinds) != 1 or not kinds <= fit[tie.kind]:
            raise DataError(f'{what}: {" and ".join(sorted(kinds))} cannot have one')
        if not (np.isfinite(tie.value) and tie.value > 0.0 and tie.sigma > 0.0):
            raise DataError(f'{what}: value and sigma must be positive numbers')

    def named(self, label: str) -> Contact:
        """
        Return the contact of a label.

        Raises
        ------
        DataError
            There is none.

        """
        for contact in self.contacts:
            if contact.label == label:
                return contact
        known = ', '.join(contact.label for contact in self.contacts)
        raise DataError(f'there is no contact {label!r} in the artefact; it has {known}')

    @classmethod
    def from_mapping(cls, entry: Mapping[str, Any]) -> Artefact:
        """
        Return the artefact of a mapping with 'contacts', 'distances' and 'angles'.

        Parameters
        ----------
        entry : mapping
            'contacts' holds a mapping per label: 'kind', and 'radius' [m] of a sphere;
            'distances' [m] and 'angles' [rad] are lists of 'between', 'value' and 'sigma'.

        Raises
        ------
        DataError
            Something in it cannot be understood; the message says what.

        """
        known = {'contacts', 'distances', 'angles'}
        if not isinstance(entry, Mapping) or not set(entry) <= known:
            found = ', '.join(map(str, entry)) if isinstance(entry, Mapping) else 'no mapping'
            raise DataError(f'an artefact has contacts, distances and angles; got {found}')
        each = entry.get('contacts') or {}
        if not isinstance(each, Mapping):
            raise DataError('contacts of an artefact: give a mapping from label to kind')
        contacts = tuple(_contact(str(label), what) for label, what in each.items())
        ties = [
            _tie(item, kind, name)
            for kind, name in (('distance', 'distances'), ('angle', 'angles'))
            for item in _listed(entry.get(name), name)
        ]
        return cls(contacts, tuple(ties))

    def as_mapping(self) -> dict[str, Any]:
        """Return what `from_mapping` reads."""
        contacts = {
            c.label: {'kind': c.kind} | ({} if c.radius is None else {'radius': c.radius})
            for c in self.contacts
        }
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


def _contact(label: str, what: object) -> Contact:
    entry = {'kind': what} if isinstance(what, str) else what
    if not isinstance(entry, Mapping) or not set(entry) <= {'kind', 'radius'}:
        raise DataError(f'contact {label!r} has a kind, and a radius if it is a sphere')
    radius = entry.get('radius')
    if radius is not None:
        radius = _number(radius, f'the radius of contact {label!r}')
    return Contact(label, str(entry.get('kind', 'point')), radius)


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
    sigma = _number(item.get('sigma', LOOSE), f'a sigma in {name}')
    value = _number(item.get('value'), f'a value in {name}')
    return Tie((str(between[0]), str(between[1])), value, sigma, kind)


def _number(value: object, what: str) -> float:
    if isinstance(value, bool) or not isinstance(value, int | float):
        raise DataError(f'{what} must be a number, got {value!r}')
    return float(value)
