# Copyright 2026 weld_twin contributors
# SPDX-License-Identifier: Apache-2.0
"""
Geometry of the arm by product of exponentials.

The DH rows of the robot file are read once, to place the joint axes at the home position (all
joints at zero). From there on the arm is its screws and its home pose:
T(q) = exp(S_1 q_1) ... exp(S_n q_n) M. Brockett 1984; Lynch and Park, chapter 4.

A motion is a pair (rotation, position); a screw is a pair (omega, v) with omega a unit vector
(turning) or zero (sliding), batched over leading axes. Lynch and Park, section 3.3.3.
"""

from collections.abc import Mapping
from dataclasses import dataclass
from typing import Any, NamedTuple

import numpy as np
from scipy.interpolate import CubicSpline
from scipy.spatial.transform import Rotation


class Motion(NamedTuple):
    """Rigid motion, equally the pose of a frame."""

    rotation: np.ndarray
    """Shape (..., 3, 3)."""
    position: np.ndarray
    """Shape (..., 3) [m]."""


def identity() -> Motion:
    return Motion(np.eye(3), np.zeros(3))


def compose(*motions: Motion) -> Motion:
    """Return the product of the motions, the leftmost outermost."""
    total = motions[0]
    for motion in motions[1:]:
        position = np.einsum('...ij,...j->...i', total.rotation, motion.position)
        total = Motion(total.rotation @ motion.rotation, position + total.position)
    return total


def inverse(motion: Motion) -> Motion:
    back = np.swapaxes(motion.rotation, -1, -2)
    return Motion(back, -np.einsum('...ij,...j->...i', back, motion.position))


def skew(vector: np.ndarray) -> np.ndarray:
    """Return the cross-product matrix, shape (..., 3, 3), of a vector (..., 3)."""
    x, y, z = np.moveaxis(vector, -1, 0)
    zero = np.zeros_like(x)
    rows = [np.stack(row, axis=-1) for row in ((zero, -z, y), (z, zero, -x), (-y, x, zero))]
    return np.stack(rows, axis=-2)


def exp_screw(omega: np.ndarray, v: np.ndarray, amount: np.ndarray) -> Motion:
    """
    Return the motion along a screw by an amount (...) [rad or m].

    omega: unit axis, or zero for a slide, shape (..., 3).
    v: velocity of the origin per unit of the amount [m/rad or -], shape (..., 3).
    """
    w = skew(np.asarray(omega, dtype=float))
    ww = w @ w
    s = np.asarray(amount, dtype=float)[..., None, None]
    rotation = np.eye(3) + np.sin(s) * w + (1.0 - np.cos(s)) * ww
    lever = np.eye(3) * s + (1.0 - np.cos(s)) * w + (s - np.sin(s)) * ww
    return Motion(rotation, np.einsum('...ij,...j->...i', lever, np.asarray(v, dtype=float)))


def turn(axis: str, angle: np.ndarray) -> Motion:
    """Return the turn about a coordinate axis, 'x', 'y' or 'z', by an angle (...) [rad]."""
    return exp_screw(np.eye(3)['xyz'.index(axis)], np.zeros(3), angle)


def slide(axis: str, length: np.ndarray) -> Motion:
    """Return the shift along a coordinate axis, 'x', 'y' or 'z', by a length (...) [m]."""
    return exp_screw(np.zeros(3), np.eye(3)['xyz'.index(axis)], length)


def from_rotvec(rotvec: np.ndarray, position: np.ndarray) -> Motion:
    """Return the motion of a rotation vector (..., 3) [rad] and a position (..., 3) [m]."""
    rotvec = np.asarray(rotvec, dtype=float)
    flat = Rotation.from_rotvec(rotvec.reshape(-1, 3)).as_matrix()
    return Motion(flat.reshape(rotvec.shape + (3,)), np.asarray(position, dtype=float))


def from_quaternion(quaternion: np.ndarray, position: np.ndarray) -> Motion:
    """Return the motion of a quaternion (4,) x y z w and a position (3,) [m]."""
    rotation = Rotation.from_quat(np.asarray(quaternion, dtype=float)).as_matrix()
    return Motion(rotation, np.asarray(position, dtype=float))


Entry = Mapping[str, Any]
"""A robot file, one of its parts, or one effect of an effects file, as YAML gives it."""


@dataclass(frozen=True, eq=False)
class Command:
    """What the controller commanded, and what the surroundings did meanwhile."""

    t: np.ndarray
    """Strictly increasing, shape (N,) [s]; evenly spaced unless static."""
    q: np.ndarray
    """Shape (N, n) [rad or m]."""
    static: bool = False
    """Each row is a pose at rest; the rows are visited in order."""
    wrench: np.ndarray | None = None
    """Force and torque on the tool, in the tool frame, at the tool centre point, shape (N, 6) [N,
    N m]."""
    temperature: np.ndarray | None = None
    """The arm's own temperature, shape (N,) [degC]."""

    def __post_init__(self) -> None:
        """Keep read-only copies of the arrays, of the right shape."""
        count = np.shape(self.t)[0]
        for name, shape in (
            ('t', (count,)),
            ('q', (count, np.shape(self.q)[-1])),
            ('wrench', (count, 6)),
            ('temperature', (count,)),
        ):
            value = getattr(self, name)
            if value is None:
                continue
            array = np.array(value, dtype=float)
            if array.shape != shape or not np.isfinite(array).all():
                raise ValueError(f'{name} must be finite, of shape {shape}, got {array.shape}')
            array.setflags(write=False)
            object.__setattr__(self, name, array)
        steps = np.diff(self.t)
        if (steps <= 0.0).any():
            raise ValueError('t must be strictly increasing')
        if not self.static and (count < 4 or np.ptp(steps) > 1e-6 * steps.mean() + 1e-9):
            raise ValueError('a moving command must be evenly spaced, four samples or more')


@dataclass(frozen=True, eq=False)
class PlantRecording:
    """What the cell recorded: several streams, each with its own stamps."""

    t_joint: np.ndarray
    """Shape (N,) [s]."""
    q: np.ndarray
    """As commanded: the controller does not know better, shape (N, n) [rad or m]."""
    qd: np.ndarray | None
    """Shape (N, n) [rad/s or m/s] or None."""
    t_measured: np.ndarray
    """Shape (M,) [s]."""
    position: np.ndarray
    """Tool centre point in the measuring frame, shape (M, 3) [m]."""
    quaternion: np.ndarray | None
    """Shape (M, 4) x y z w, or None."""
    wrench_t: np.ndarray | None
    wrench: np.ndarray | None
    """[s] and (W, 6) [N, N m], or None"""
    temperature_t: np.ndarray | None
    temperature: np.ndarray | None
    """[s] and (K,) [degC], or None"""
    static: bool


class Course:
    """
    The commanded motion between its samples.

    A cubic spline, so that the drives see a continuous acceleration; before and after the
    command the arm rests. Static stations are looked up, not interpolated.
    """

    def __init__(self, command: Command) -> None:
        self.command = command
        self._spline = None if command.static else CubicSpline(command.t, command.q)

    def q(self, t: np.ndarray, order: int = 0) -> np.ndarray:
        """Return the joint positions, or their derivative of that order, shape (len(t), n)."""
        if self._spline is None:
            rows = np.searchsorted(self.command.t, t)
            return self.command.q[rows] if order == 0 else np.zeros_like(self.command.q[rows])
        return np.asarray(self._spline(np.clip(t, self.command.t[0], self.command.t[-1]), order))

    def wrench(self, t: np.ndarray) -> np.ndarray | None:
        """Return the tool wrench, shape (len(t), 6), linear between samples."""
        if self.command.wrench is None:
            return None
        columns = [np.interp(t, self.command.t, column) for column in self.command.wrench.T]
        return np.stack(columns, axis=-1)

    def temperature(self, t: np.ndarray) -> np.ndarray | None:
        """Return the arm's temperature, shape (len(t),) [degC]."""
        if self.command.temperature is None:
            return None
        return np.asarray(np.interp(t, self.command.t, self.command.temperature))


class Rows(NamedTuple):
    """Numbers of the DH rows [rad, m], shape (..., n); leading axes, if any, are samples."""

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
    return from_quaternion(
        entry.get('quat_xyzw', [0.0, 0.0, 0.0, 1.0]), entry.get('xyz', [0.0, 0.0, 0.0])
    )


def home(arm: Arm, rows: Rows | None = None) -> Home:
    """Place axes and links at the home position, by the rows as built or those of the file."""
    rows = arm.rows if rows is None else rows
    at = identity()
    axes, points, acrosses, links = [], [], [], []
    for i in range(len(arm.names)):
        theta, d, a, alpha, beta = (np.asarray(column)[..., i] for column in rows)
        lean = (turn('x', alpha), turn('y', beta))
        step = (turn('z', theta), slide('z', d))
        if arm.modified:
            at = compose(at, *lean, slide('x', a))
        axes.append(at.rotation[..., 2])
        acrosses.append(at.rotation[..., 0])
        points.append(at.position)
        at = compose(at, *step)
        if not arm.modified:
            at = compose(at, slide('x', a), *lean)
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
    """Return the flange in the base frame; wobble: how far each axis leans about its `across`."""
    total = identity()
    for i in range(len(arm.names)):
        if wobble is not None and np.any(wobble[..., i]):
            across = at.across[..., i, :]
            moment = np.cross(at.point[..., i, :], across)
            total = compose(total, exp_screw(across, moment, wobble[..., i]))
        step = exp_screw(at.omega[..., i, :], at.v[..., i, :], q[..., i])
        total = compose(total, step)
    return compose(total, at.links[-1])
