# Copyright 2026 weld_twin contributors
# SPDX-License-Identifier: Apache-2.0
"""An artefact as a file describes it: plain mappings and lists to contacts and ties."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from itertools import combinations
from typing import Any

import numpy as np

from ..arm.rotation import rotation_matrix
from ..errors import DataError
from .contact import LOOSE, Contact, Tie

_ENTRIES = ('contacts', 'blocks', 'distances', 'angles')
"""What an artefact file holds."""
_OF_CONTACT = ('kind', 'radius', 'at', 'axis', 'sigma')
"""What it says of a contact,"""
_OF_BLOCK = ('size', 'sigma', 'square', 'at', 'turn')
"""and of a block."""
_SQUARE = 5e-4
"""Uncertainty [rad] of the angles of a block of which nothing was said: half a millimetre a metre,
what a milled block from any shop has."""


def described(entry: Mapping[str, Any]) -> tuple[tuple[Contact, ...], tuple[Tie, ...]]:
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
        _number(entry.get('sigma', LOOSE), f'sigma of contact {label!r}'),
    )


def _block(label: str, what: object) -> tuple[list[Contact], list[Tie]]:
    """Return the six faces of a block, 'LABEL +x' to 'LABEL -z', and what ties them."""
    if not isinstance(what, Mapping) or not set(what) <= set(_OF_BLOCK):
        raise DataError(f'block {label!r} has a size, sigma, square, and at and turn if known')
    size = _three(what.get('size'), f'the size of block {label!r}')
    if size is None or min(size) <= 0.0:
        raise DataError(f'block {label!r} needs size: [X, Y, Z], three positive lengths [m]')
    sigma = _number(what.get('sigma', LOOSE), f'sigma of block {label!r}')
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
    sigma = _number(item.get('sigma', LOOSE), f'a sigma in {name}')
    value = _number(item.get('value'), f'a value in {name}')
    return Tie((str(between[0]), str(between[1])), value, sigma, kind)


def _number(value: object, what: str) -> float:
    if isinstance(value, bool) or not isinstance(value, int | float):
        raise DataError(f'{what} must be a number, got {value!r}')
    return float(value)
