# Copyright 2026 weld_twin contributors
# SPDX-License-Identifier: Apache-2.0
"""Entries of one cell as observations that can be compared."""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np

from weld_twin_core.arm.rotation import rotation_vector
from weld_twin_core.arrays import Array
from weld_twin_core.effects import REGISTRY
from weld_twin_core.history import Change, Observation, changes
from weld_twin_core.twin.posterior import CURVE

from .entry import Entry

DAY = 86_400.0
"""Seconds."""


def observations(entries: Sequence[Entry]) -> list[Observation]:
    """
    Return entries as observations, the tool counted from that of the first.

    ``entries``: of one cell, in the order of time.
    """
    first = entries[0].tool if entries else np.eye(4)
    return [
        Observation(
            entry.at.timestamp() / DAY,
            entry.names,
            _moved(entry, first),
            entry.covariance,
            entry.prior_std,
            frozenset(name for name in entry.names if _steady(name)),
        )
        for entry in entries
    ]


def _steady(name: str) -> bool:
    """Return whether a coordinate is the unevenness of a gear: a curve over its angle, or waves."""
    effect = REGISTRY.get(name.split(' ')[0])
    return name.startswith(CURVE) or (effect is not None and effect.traits.waves is not None)


def named(entries: Sequence[Entry]) -> set[str]:
    """Return the coordinates of the causes that entries name."""
    result = ((each['effect'], each.get('joint')) for entry in entries for each in entry.effects)
    return {f'{effect} {joint} 0' if joint else f'{effect} 0' for effect, joint in result}


def likely(entries: Sequence[Entry]) -> set[str]:
    """Return the coordinates that use can change; those of the tool are told by axis."""
    in_use = {'tool', *(name for name, effect in REGISTRY.items() if effect.traits.changes_in_use)}
    names = {name for entry in entries for name in entry.names}
    return {name for name in names if name.replace('.', ' ').split(' ')[0] in in_use}


def changed(entries: Sequence[Entry], seen: Sequence[Observation]) -> tuple[Change, ...]:
    """
    Return what changed on a cell, the surest first.

    ``entries``: of one cell, in the order of time. ``seen``: what `observations` made of them.
    """
    return changes(seen, named=named(entries), likely=likely(entries))


def _moved(entry: Entry, first: Array) -> Array:
    """Return the values; of the tool, where it is from where the first one was."""
    shift = entry.tool[:3, 3] - first[:3, 3]
    turn = rotation_vector(first[:3, :3].T @ entry.tool[:3, :3])
    moved = dict(
        zip(
            ('tool.x', 'tool.y', 'tool.z', 'tool.turn_x', 'tool.turn_y', 'tool.turn_z'),
            (*shift, *turn),
            strict=True,
        )
    )
    more = np.array([moved.get(name, 0.0) for name in entry.names])
    return np.asarray(entry.value + more)
