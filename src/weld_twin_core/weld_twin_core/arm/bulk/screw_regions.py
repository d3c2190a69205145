# Copyright 2026 weld_twin contributors
# SPDX-License-Identifier: Apache-2.0
"""
Where along a chain a DH value acts, which says how little is needed for its screw.

Before the first joint turns, a screw stands still in the world; after the last one, in the tool:
both follow from the pose by a constant matrix. Up to the cut between the two pieces of `bulk_kernel`, a
screw is linear in the features of the near piece. Only the rest has to be carried by it.
"""

from __future__ import annotations

from collections.abc import Sequence
from enum import Enum
from itertools import groupby
from typing import NamedTuple

import numpy as np

from ...arrays import Array
from ...errors import ModelError
from ..channels import Channel
from ..robot import Robot
from .weights import Piece, factors, generator

ROWS = 13
"""Rows that hold a pose: columns x, y, z and origin, three components each, and 1."""
_ORIGIN = slice(9, 12)
"""Rows of a frame that hold its origin; the nine before hold its axes."""


class Region(Enum):
    """Stretches of the chain, from the base outward."""

    FIRST, NEAR, FAR, LAST = range(4)


class _Place(NamedTuple):
    """A DH value acts before some factor of the chain, about one of its coordinate axes."""

    before: int
    axis: int
    region: Region


class _Run(NamedTuple):
    """Channels of one region that follow each other; ``part`` counts them within the region."""

    region: Region
    channels: slice
    part: slice


class Division:
    """A robot's chain of factors, divided in two pieces at a joint, for some channels."""

    def __init__(self, robot: Robot, channels: Sequence[Channel]) -> None:
        self._robot = robot
        self._rows = [(i, factor) for i in range(robot.n) for factor in factors(robot, i)]
        self._factors = [factor for _, factor in self._rows]
        self._moving = [k for k, f in enumerate(self._factors) if len(f.matrices) > 1]
        half = (robot.n + 1) // 2
        self.sizes = (half, robot.n - half)
        """Joints of either piece."""
        self._cut = self._moving[half] if half < robot.n else len(self._factors)
        self.near = Piece(self._factors[: self._cut], robot.T_world_base, np.eye(4))
        self.far = Piece(self._factors[self._cut :], np.eye(4), robot.T_flange_tool)
        self.places = [self._place(channel) for channel in channels]

    def _place(self, channel: Channel) -> _Place:
        kind, row = channel
        for before, (i, factor) in enumerate(self._rows):
            if i == row and kind in factor.kinds:
                return _Place(before, factor.axis, self._region(before))
        raise ModelError(
            f'channel {channel} is no DH value of robot {self._robot.name!r}, whose rows are 0 to '
            f'{self._robot.n - 1}'
        )

    def _region(self, before: int) -> Region:
        if before <= self._moving[0]:
            return Region.FIRST
        if before >= self._moving[-1]:
            return Region.LAST
        return Region.NEAR if before <= self._cut else Region.FAR

    def inner(self) -> dict[int, tuple[int, int]]:
        """Return where in the near piece channels act, and about which axes, by their number."""
        return {
            k: (p.before, p.axis) for k, p in enumerate(self.places) if p.region is Region.NEAR
        }

    def outer(self) -> list[tuple[int, int]]:
        """Return the same of the far piece, in the order of its channels."""
        return [(p.before - self._cut, p.axis) for p in self.places if p.region is Region.FAR]

    def runs(self) -> list[_Run]:
        """Return the channels as runs of one region each."""
        out, first, met = [], 0, dict.fromkeys(Region, 0)
        for region, places in groupby(place.region for place in self.places):
            count = len(list(places))
            part = slice(met[region], met[region] + count)
            out.append(_Run(region, slice(first, first + count), part))
            first += count
            met[region] += count
        return out

    def ends(self) -> dict[int, Array]:
        """Return, per channel at either end, the matrix (6, ROWS) from a pose to its screw."""
        of = {Region.FIRST: self._in_world, Region.LAST: self._in_tool}
        return {k: of[p.region](p) for k, p in enumerate(self.places) if p.region in of}

    def _in_world(self, place: _Place) -> Array:
        """Return the matrix of a screw that stands still in the world: m + axis x origin."""
        moment, axis = self.near.screws([(place.before, place.axis)])[0, 0]
        out = np.zeros((6, ROWS))
        out[:3, _ORIGIN] = np.cross(axis, np.eye(3)).T
        out[:3, 12], out[3:, 12] = moment, axis
        return out

    def _in_tool(self, place: _Place) -> Array:
        """Return the matrix of a screw still in the tool: it may as well act behind the joint."""
        after = np.eye(4)
        for factor in self._factors[max(place.before, self._moving[-1] + 1) :]:
            after = after @ factor.matrices[0]
        after = after @ self._robot.T_flange_tool
        twist = np.linalg.solve(after, generator(place.axis) @ after)
        out = np.zeros((6, ROWS))
        out[:3, :9] = np.kron(twist[:3, 3], np.eye(3))
        out[3:, :9] = np.kron(after[place.axis, :3], np.eye(3))
        return out
