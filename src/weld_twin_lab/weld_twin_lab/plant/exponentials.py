# Copyright 2026 weld_twin contributors
# SPDX-License-Identifier: Apache-2.0
"""
Geometry of the arm by product of exponentials.

The DH rows of the robot file are read once, to place the joint axes at the home position (all
joints at zero). From there on the arm is its screws and its home pose:
T(q) = exp(S_1 q_1) ... exp(S_n q_n) M. Brockett 1984; Lynch and Park, chapter 4.
"""

from dataclasses import dataclass
from typing import NamedTuple

import numpy as np

from . import screws
from .plant_recording import Entry
from .screws import Motion


class Rows(NamedTuple):
    """
    Numbers of the DH rows; leading axes, if any, are samples.

    Attributes
    ----------
    theta, alpha, beta : array, shape (..., n) [rad]
    d, a : array, shape (..., n) [m]

    """

    theta: np.ndarray
    d: np.ndarray
    a: np.ndarray
    alpha: np.ndarray
    beta: np.ndarray


@dataclass(frozen=True, eq=False)
class Arm:
    """The robot file, as geometry needs it."""

    names: tuple[str, ...]
    """Joints in chain order."""
    rows: Rows
    sliding: np.ndarray
    """True where the joint is prismatic, shape (n,), bool."""
    modified: bool
    """Craig's convention instead of the standard one."""
    base: Motion
    tool: Motion
    """World to base, flange to tool centre point."""


@dataclass(frozen=True, eq=False)
class Home:
    """Screws of the joints and poses of the links with every joint at zero, in the base frame."""

    omega: np.ndarray
    v: np.ndarray
    """Shape (..., n, 3)."""
    point: np.ndarray
    """A point on each axis, shape (..., n, 3) [m]."""
    across: np.ndarray
    """A unit vector square to each axis, fixed to the link before it, shape (..., n, 3)."""
    links: tuple[Motion, ...]
    """DH frame at the end of each link; the last is the flange."""


def arm_from(robot: Entry) -> Arm:
    """Read the geometry of a robot file, as docs/conventions.md has it."""
    convention = robot.get('convention', 'standard')
    if convention not in ('standard', 'modified'):
        raise ValueError(f'convention must be standard or modified, got {convention!r}')
    joints = robot['joints']

    def column(key: str) -> np.ndarray:
        return np.array([float(joint.get(key, 0.0)) for joint in joints])

    rows = Rows(
        column('theta_offset'), column('d'), column('a'), column('alpha'), np.zeros(len(joints))
    )
    sliding = np.array([joint.get('type', 'revolute') == 'prismatic' for joint in joints])
    names = tuple(joint['name'] for joint in joints)
    return Arm(
        names,
        rows,
        sliding,
        convention == 'modified',
        _frame(robot.get('base')),
        _frame(robot.get('tool')),
    )


def _frame(entry: Entry | None) -> Motion:
    entry = entry or {}
    return screws.from_quaternion(
        entry.get('quat_xyzw', [0.0, 0.0, 0.0, 1.0]), entry.get('xyz', [0.0, 0.0, 0.0])
    )


def home(arm: Arm, rows: Rows | None = None) -> Home:
    """
    Place the joint axes and the links of the arm at its home position.

    rows: the rows as built, where they differ from the file's.
    """
    rows = arm.rows if rows is None else rows
    at = screws.identity()
    axes, points, acrosses, links = [], [], [], []
    for i in range(len(arm.names)):
        theta, d, a, alpha, beta = (np.asarray(column)[..., i] for column in rows)
        lean = (screws.turn('x', alpha), screws.turn('y', beta))
        step = (screws.turn('z', theta), screws.slide('z', d))
        if arm.modified:
            at = screws.compose(at, *lean, screws.slide('x', a))
        axes.append(at.rotation[..., 2])
        acrosses.append(at.rotation[..., 0])
        points.append(at.position)
        at = screws.compose(at, *step)
        if not arm.modified:
            at = screws.compose(at, screws.slide('x', a), *lean)
        links.append(at)
    batch = np.broadcast_shapes(*(np.shape(column)[:-1] for column in rows))

    def stack(parts: list[np.ndarray]) -> np.ndarray:
        return np.stack([np.broadcast_to(part, (*batch, 3)) for part in parts], axis=-2)

    axis, point = stack(axes), stack(points)
    slides = arm.sliding[:, None]
    return Home(
        np.where(slides, 0.0, axis),
        np.where(slides, axis, np.cross(point, axis)),
        point,
        stack(acrosses),
        tuple(links),
    )


def flange(arm: Arm, at: Home, q: np.ndarray, wobble: np.ndarray | None = None) -> Motion:
    """
    Return the flange in the base frame.

    q: shape (..., n) [rad or m].
    wobble: lean of each axis about its `across` vector: a bearing that tilts as it turns, shape
    (..., n) [rad].
    """
    total = screws.identity()
    for i in range(len(arm.names)):
        if wobble is not None and np.any(wobble[..., i]):
            across = at.across[..., i, :]
            moment = np.cross(at.point[..., i, :], across)
            total = screws.compose(total, screws.exp_screw(across, moment, wobble[..., i]))
        step = screws.exp_screw(at.omega[..., i, :], at.v[..., i, :], q[..., i])
        total = screws.compose(total, step)
    return screws.compose(total, at.links[-1])
