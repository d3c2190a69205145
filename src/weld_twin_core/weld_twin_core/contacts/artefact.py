# Copyright 2026 weld_twin contributors
# SPDX-License-Identifier: Apache-2.0
"""What is touched: sockets, pins, bars and faces, and the lengths and angles between them."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from typing import Any

import numpy as np

from ..errors import DataError
from .contact import Contact, Tie
from .described import described


@dataclass(frozen=True)
class Artefact:
    """
    What is touched, and what is known of it.

    Raises DataError: a label comes twice, a tie names an unknown label, or its value makes no
    sense.

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
        return cls(*described(entry))

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
