# Copyright 2026 weld_twin contributors
# SPDX-License-Identifier: Apache-2.0
"""The carriage of a joint that slides: what moves where it leaves its straight guide."""

from __future__ import annotations

import numpy as np

from ..arm.channels import Shift
from ..arm.robot import Robot
from ..arm.vectors import components, cross, pad
from ..arrays import Array
from .effect import LinearEffect
from .hooks import Hooked, SearchHooks, Traits
from .view import View


class _Search(SearchHooks):
    def fits(self, robot: Robot, joint: str | None) -> bool:
        """Return whether the joint slides."""
        return joint is not None and bool(robot.prismatic[robot.index(joint)])


class GuideError(LinearEffect):
    """An error of a guide; its carriage leaves the straight line by the posture of one joint."""

    of = 'joint'
    traits = Traits(
        depends_on='angle',
        common=False,
        by_motion=True,
        lacking='is of a joint that slides, and {site!r} turns',
    )
    search = Hooked(_Search)


def carriage_axes(view: View, i: int) -> tuple[Array, Array, Array]:
    """Return the x, y and z of a guide in the world at the samples, each (3, ...); z is along it."""
    row, width = view.frames.rows[i], view.frames.position.ndim - 1
    z = pad(row.z, width)
    x = pad(row.x if view.robot.convention == 'standard' else cross(row.y, row.z), width)
    return x, cross(z, x), z


def carried(view: View, i: int, slide: Array | None, turn: Array | None) -> Shift:
    """
    Return how the pose moves where the carriage of joint i is slid, or turned about itself.

    i: the joint, counted from 0.
    slide, turn: in the world, components first, shape (3, ...) [m, rad]; what is carried moves so
    against the guide.
    """
    way = -1.0 if i < view.robot.behind else 1.0
    if turn is None:
        assert slide is not None
        return {('pose', k): way * slide[k] for k in range(3)}
    row, tip = view.frames.rows[i], components(view.frames.position)
    travel = view.robot.d[i] + view.joint(i)
    origin = pad(row.z_point, tip.ndim - 1) + travel * pad(row.z, tip.ndim - 1)
    moved = cross(turn, tip - origin)
    parts = np.broadcast_arrays(*moved, *turn)
    return {('pose', k): way * part for k, part in enumerate(parts)}
