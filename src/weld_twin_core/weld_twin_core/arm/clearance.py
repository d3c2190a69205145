# Copyright 2026 weld_twin contributors
# SPDX-License-Identifier: Apache-2.0
"""
Does the arm hit itself, the floor, or the walls of its cell? Links as simple capsules.

The lines that the robot's table draws from joint to joint are made as thick as links of such an arm
usually are. Real links are not capsules: what is let through still has to be looked at.
"""

from __future__ import annotations

from itertools import combinations
from typing import NamedTuple

import numpy as np

from ..arrays import Array
from .chain import Frames, frames
from .robot import Robot

THICK = 0.05
"""Radius of a link as a share of the arm's whole length: a UR5, 1.2 m from joint to joint, has 0.06 m,
a KR 16 of 2.4 m has 0.12 m."""
TORCH = 0.03
"""Radius of what hangs on the flange [m]: a torch is about 60 mm thick."""
SHORT = 1e-3
"""Shorter lines [m] are no link."""
ALIKE = 1e-3
"""Distance [m] by which two postures may differ and be as near: links that cannot move against each
other differ by rounding."""
PLACES = 5
"""Places along each of two lines between which their distance is looked at."""


class Body(NamedTuple):
    """Capsules: ends, shape (..., S, 3) each [m], radius (S,) [m], and the link of each (S,)."""

    start: Array
    end: Array
    radius: Array
    link: Array


def body(robot: Robot, q: Array) -> Body:
    """
    Return the arm's capsules in the measuring frame.

    Parameters
    ----------
    robot : Robot
    q : array, shape (..., n) [rad or m]

    """
    points, link = _line(robot, frames(robot, np.asarray(q, dtype=float)))
    start, end = points[..., :-1, :], points[..., 1:, :]
    long = np.linalg.norm((end - start).reshape(-1, link.size, 3), axis=2).max(axis=0) > SHORT
    whole = float(np.abs(robot.a).sum() + np.abs(robot.d).sum())
    radius = np.where(link == robot.n, TORCH, THICK * whole)
    return Body(start[..., long, :], end[..., long, :], radius[long], link[long])


def _line(robot: Robot, chain: Frames) -> tuple[Array, Array]:
    """Return the points from base to tool, shape (..., S + 1, 3), and the link of every line."""
    points, link = [chain.base_point], []
    for k, row in enumerate(chain.rows):
        x, at, turned = (np.moveaxis(v, 0, -1) for v in (row.x, row.x_point, row.z_point))
        if robot.convention == 'standard':
            points += [at - robot.a[k] * x, at]
            link += [k, k]
        else:
            # Its own z begins where its x ended; what lies before still belongs to the row before.
            points += [at, turned]
            link += [max(k - 1, 0), k]
    points += [chain.flange_point, chain.position]
    link += [robot.n - 1, robot.n]
    return np.stack(np.broadcast_arrays(*points), axis=-2), np.array(link)


def clearances(shape: Body) -> Array:
    """
    Return how far links that are no neighbours stay apart, shape (..., pairs) [m].

    Negative where they overlap.

    Parameters
    ----------
    shape : Body
        As `body` returns it.

    """
    share = np.linspace(0.0, 1.0, PLACES)[:, None]
    out = []
    for i, j in combinations(range(shape.link.size), 2):
        if abs(int(shape.link[i]) - int(shape.link[j])) < 2:
            continue
        one, other = (
            shape.start[..., k, None, :] * (1.0 - share) + shape.end[..., k, None, :] * share
            for k in (i, j)
        )
        gap = np.linalg.norm(one[..., :, None, :] - other[..., None, :, :], axis=-1)
        out.append(gap.min(axis=(-1, -2)) - shape.radius[i] - shape.radius[j])
    empty = np.zeros((*shape.start.shape[:-2], 0))
    return np.stack(out, axis=-1) if out else empty


def free(robot: Robot, q: Array, seen: Array, box: Array | None = None) -> Array:
    """
    Return which postures are free, shape (N,), bool.

    Parameters
    ----------
    robot : Robot
    q : array, shape (N, n) [rad or m]
    seen : array, shape (K, n) [rad or m]
        Postures that the arm was in: whatever is near there is no collision, for the arm was there.
    box : array, shape (2, 3), optional [m]
        Corners, in the measuring frame, that the arm stays between. Without it an arm that stands
        upright stays above its foot, or above the lowest place that it was at.

    """
    known, asked = body(robot, seen), body(robot, q)
    usual = clearances(known).min(axis=0)
    good = (clearances(asked) >= np.minimum(usual, 0.0) - ALIKE).all(axis=-1)
    ends = np.concatenate([asked.start[:, asked.link > 0], asked.end], axis=1)
    if box is not None:
        return np.asarray(good & ((ends >= box[0]) & (ends <= box[1])).all(axis=(1, 2)))
    up = (
        -robot.T_world_base[:3, :3]
        @ robot.gravity
        / max(float(np.linalg.norm(robot.gravity)), 1e-9)
    )
    if up @ robot.T_world_base[:3, 2] < 0.99:
        return np.asarray(good)
    foot = min(float(robot.T_world_base[:3, 3] @ up), _lowest(known.end @ up).min())
    return np.asarray(good & (_lowest(ends @ up) >= foot))


def _lowest(heights: Array) -> Array:
    """Return the least along the last axis; an arm whose links have no length is nowhere low."""
    return np.asarray(heights.min(axis=-1, initial=np.inf))
