# Copyright 2026 weld_twin contributors
# SPDX-License-Identifier: Apache-2.0
"""
Channels of the chain, and displacements of them.

A *channel* is one scalar of the chain that an effect may displace: ``('q', i)``,
``('theta' | 'd' | 'a' | 'alpha' | 'beta', i)``, ``('base' | 'root' | 'tool' | 'pose', 0..5)`` or
``('tau', i)``. 'root' is where a positioner's rows begin, in the axes of the robot's base. A
*shift* maps channels to displacements that broadcast with the samples.
"""

from __future__ import annotations

from collections.abc import Mapping
from itertools import groupby

from ..arrays import Array

Channel = tuple[str, int]
Shift = Mapping[Channel, Array]
ROW_CHANNELS = ('theta', 'd', 'a', 'alpha', 'beta')
"""Channels of one Denavit-Hartenberg row."""
ROW_ORDER = {
    'standard': ('theta', 'd', 'a', 'alpha', 'beta'),
    'modified': ('alpha', 'beta', 'a', 'theta', 'd'),
}
"""The motions that a row is the product of, from the base outward; see `Robot`."""
AXIS = {'theta': 2, 'd': 2, 'a': 0, 'alpha': 0, 'beta': 1}
"""The axis of its own frame that each of them turns about or slides along: 0 is x."""
TURNS = ('theta', 'alpha', 'beta')
"""Those that turn; the others slide."""
NO_SHIFT: Shift = {}


def row_factors(convention: str, *, without: str = '') -> list[tuple[str, ...]]:
    """Return the motions of a row from the base outward, those about one axis together."""
    order = (kind for kind in ROW_ORDER[convention] if kind != without)
    return [tuple(kinds) for _, kinds in groupby(order, AXIS.__getitem__)]
