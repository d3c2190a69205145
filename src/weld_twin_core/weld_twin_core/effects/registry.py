# Copyright 2026 weld_twin contributors
# SPDX-License-Identifier: Apache-2.0
"""The effects known by name, from the entries of an effects file, and what parts look-alikes."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import fields
from typing import Any

import numpy as np

from ..arm.robot import Robot
from ..errors import DataError, ModelError
from .effect import REGISTRY, Effect, register

__all__ = ['ELSE', 'REGISTRY', 'effect_from_mapping', 'effects_from_list', 'register', 'way']


def effect_from_mapping(entry: Mapping[str, Any]) -> Effect:
    """
    Build an effect from an entry of an effects file.

    Parameters
    ----------
    entry : mapping
        The key ``effect`` names it; the others are its fields, in SI units.

    Raises
    ------
    ModelError
        Unknown effect or parameter, or a value that is not a number.

    Examples
    --------
    >>> import weld_twin_core as wt
    >>> entry = {'effect': 'backlash', 'joint': 'elbow_joint', 'width': 5e-4}
    >>> wt.effect_from_mapping(entry).width
    0.0005

    """
    if not isinstance(entry, Mapping) or 'effect' not in entry:
        raise ModelError(f"an effect must be a mapping with the key 'effect', got {entry!r}")
    kind = REGISTRY.get(str(entry['effect']))
    if kind is None:
        raise ModelError(
            f'unknown effect {entry["effect"]!r}; known effects are ' + ', '.join(sorted(REGISTRY))
        )
    allowed = {item.name for item in fields(kind)}
    values: dict[str, Any] = {}
    for key, value in entry.items():
        if key == 'effect':
            continue
        if key not in allowed:
            raise ModelError(
                f'effect {kind.name!r} has no parameter {key!r}; it takes '
                + ', '.join(sorted(allowed))
            )
        given = key in kind.options or key == 'joint'
        values[key] = value if given else _numbers(kind, key, value)
    try:
        return kind(**values)
    except TypeError as error:
        raise ModelError(f'effect {kind.name!r}: {error}') from None


def effects_from_list(entries: Any, robot: Robot) -> tuple[Effect, ...]:
    """
    Build and check the effects of a file against a robot.

    Parameters
    ----------
    entries : sequence of mapping, or None for none
    robot : Robot

    Raises
    ------
    ModelError
        Not a list, or an entry that cannot be used; the message names the entry.

    Examples
    --------
    >>> import weld_twin_core as wt
    >>> entries = [{'effect': 'joint_offset', 'joint': 'elbow_joint', 'offset': 1e-3}]
    >>> len(wt.effects_from_list(entries, wt.load('ur5')))
    1

    """
    if entries is None:
        return ()
    if not isinstance(entries, Sequence) or isinstance(entries, str):
        raise ModelError('an effects file must be a list of effects')
    out = []
    for k, entry in enumerate(entries):
        try:
            effect = effect_from_mapping(entry)
            effect.check(robot)
        except (ModelError, DataError) as error:
            raise ModelError(f'effect {k}: {error}') from None
        out.append(effect)
    return tuple(out)


def _numbers(kind: type[Effect], key: str, value: Any) -> Any:
    size = next((p.size for p in kind.parameters if p.name == key), 0)
    try:
        if np.asarray(value).dtype.kind == 'b':  # YAML reads yes and on so
            raise TypeError
        array = np.asarray(value, dtype=np.float64)
    except (TypeError, ValueError):
        raise ModelError(f'effect {kind.name!r}: {key} must be a number, got {value!r}') from None
    if array.ndim > 1 or (size == 1 and array.ndim) or (size > 1 and array.shape != (size,)):
        wanted = {0: 'a number or a list', 1: 'one number'}.get(size, f'{size} numbers')
        raise ModelError(f'effect {kind.name!r}: {key} must be {wanted}, got {value!r}')
    return float(array) if array.ndim == 0 else array


ELSE = 'mend whichever is easier, for anywhere in the workspace they differ by less than the noise'
"""What is said of effects that move the tool alike on every motion, if they say nothing else."""


def way(families: Sequence[str]) -> str:
    """Return what tells causes of these families apart when no motion does."""
    names = set(families)
    for name in sorted(names & set(REGISTRY)):
        (other,) = names - {name} if len(names) == 2 else {name}
        way = REGISTRY[name].traits.apart.get(other)
        if way and len(names) < 3:
            return way
    return ELSE
