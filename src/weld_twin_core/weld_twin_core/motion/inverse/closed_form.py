# Copyright 2026 weld_twin contributors
# SPDX-License-Identifier: Apache-2.0
"""
All joint positions that bring the tool to one pose: in closed form for two families of arm.

The family of a six-joint arm is read off the joint axes at position zero, so the DH convention and
where its frames sit do not matter: *spherical wrist* (axes 4, 5, 6 meet in a point; 2 and 3
parallel; shoulder and elbow offsets allowed) and *three parallel* (axes 2, 3, 4 parallel; 5 and 6
meet).
"""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass, replace
from functools import lru_cache

import numpy as np

from ...arm.chain import forward, frames
from ...arm.robot import Robot
from ...arm.rotation import skew, wrapped
from ...arrays import Array
from ...errors import ReachError
from .newton import CLOSED, centred, polish, search

_EXACT = 1e-9
"""How far [m, rad] axes may be from meeting or parallel; an arm with errors is not exact."""


@dataclass(frozen=True, eq=False)
class _Screws:
    """Joint axes (6, 3), a point on each (6, 3) [m], and the tool pose (4, 4), all at q = 0."""

    axis: Array
    point: Array
    home: Array


_Solver = Callable[[_Screws, Array, Array], Array]


@lru_cache(maxsize=8)
def _screws(robot: Robot) -> _Screws:
    """Return the joint axes of a robot at joint position zero, in the world frame."""
    zero = np.zeros(robot.n)
    rows = frames(robot, zero).rows
    return _Screws(
        np.array([row.z for row in rows]),
        np.array([row.z_point for row in rows]),
        forward(robot, zero),
    )


@lru_cache(maxsize=8)
def family(robot: Robot) -> str | None:
    """Return 'spherical wrist', 'three parallel', or None where no closed form applies."""
    if robot.n != 6 or robot.prismatic.any():
        return None
    arm = _screws(robot)
    wrist = _meeting(arm, 4, 5)
    if wrist is None or not _parallel(arm, 1, 2):
        return None
    if _parallel(arm, 2, 3) and not _parallel(arm, 0, 1) and not _parallel(arm, 3, 4):
        return 'three parallel'
    if _off_axis(arm, 3, wrist) < _EXACT and not _parallel(arm, 3, 4):
        return 'spherical wrist'
    return None


def branches(robot: Robot, poses: Array) -> Array:
    """Return all branches (8, N, 6) [rad], one posture each, NaN where one does not reach a pose."""
    arm = _screws(robot)
    solver = _SOLVERS[str(family(robot))]
    rotation = poses[:, :3, :3] @ arm.home[:3, :3].T
    wrist = _meeting(arm, 4, 5)
    centre = np.asarray(wrist) - arm.home[:3, 3]
    point = (rotation @ centre) + poses[:, :3, 3]
    q = wrapped(solver(arm, rotation, point))
    # The nearest angle stands in where none exists; those samples do not close.
    gap = np.abs(forward(robot, q) - poses).max(axis=(-2, -1))
    return np.where((gap < 1e-6)[..., None], q, np.nan)


def _spherical(arm: _Screws, rotation: Array, point: Array) -> Array:
    """Return q (8, N, 6): shoulder, elbow and wrist, each two ways."""
    h, p = arm.axis, arm.point
    centre = np.asarray(_meeting(arm, 4, 5))
    q1 = -_angle_to_height(h[1], h[0], point - p[0], h[1] @ (centre - p[0]))
    # Minus: it is the arm that turns back onto the point.
    reach = _turn(h[0], -q1, point - p[0]) - (p[1] - p[0])
    length = np.linalg.norm(reach, axis=-1)
    q3 = _two_ways(_angle_to_distance(p[2] - p[1], h[2], centre - p[2], length), 1)
    bent = p[2] - p[1] + _turn(h[2], q3, np.broadcast_to(centre - p[2], (*q3.shape, 3)))
    q2 = _angle_onto(h[1], bent, reach[:, None])
    shoulder = _turn_matrix(h[0], q1)[:, None]
    arm_turn = shoulder @ _turn_matrix(h[1], q2) @ _turn_matrix(h[2], q3)
    wrist = np.swapaxes(arm_turn, -1, -2) @ rotation
    angles = _wrist(h[3], h[4], h[5], wrist)
    return _listed(q1[:, None, None], q2[:, :, None], q3[:, :, None], *angles)


def _two_ways(both: Array, axis: int) -> Array:
    """Return two angles, the axis of which is first, with that axis behind those before them."""
    return np.moveaxis(both, 0, axis)


def _listed(*angles: Array) -> Array:
    """Return joint positions (8, N, 6) of angles that broadcast to (2, 2, 2, N)."""
    q = np.stack(np.broadcast_arrays(*angles), axis=-1)
    return q.reshape(8, *q.shape[3:])


def _wrist(h4: Array, h5: Array, h6: Array, rotation: Array) -> tuple[Array, Array, Array]:
    """Return both (q4, q5, q6), each (2, 2, 2, N), of wrists' rotations (2, 2, N, 3, 3)."""
    last = rotation @ h6
    q5 = _two_ways(_angle_to_height(h4, h5, np.broadcast_to(h6, last.shape), last @ h4), 2)
    q4 = _angle_onto(h4, _turn(h5, q5, np.broadcast_to(h6, (*q5.shape, 3))), last[:, :, None])
    before = _turn_matrix(h4, q4) @ _turn_matrix(h5, q5)
    return q4, q5, _rest(h6, np.swapaxes(before, -1, -2) @ rotation[:, :, None])


def _three_parallel(arm: _Screws, rotation: Array, point: Array) -> Array:
    """Return q (8, N, 6): shoulder, wrist and elbow, each two ways."""
    h, p = arm.axis, arm.point
    centre = np.asarray(_meeting(arm, 4, 5))
    q1 = -_angle_to_height(h[1], h[0], point - p[0], h[1] @ (centre - p[0]))
    turned = _turn_matrix(h[0], -q1) @ rotation
    last = turned @ h[5]
    straight = np.broadcast_to(h[5], last.shape)
    q5 = _two_ways(_angle_to_height(h[1], h[4], straight, last @ h[1]), 1)
    turned = turned[:, None]
    # Turns about the parallel axes leave h2 alone, so h2 shows the wrist's turn.
    seen = _turn(h[4], -q5, np.broadcast_to(h[1], (*q5.shape, 3)))
    q6 = -_angle_onto(h[5], seen, np.swapaxes(turned, -1, -2) @ h[1])
    after = _turn_matrix(h[4], q5) @ _turn_matrix(h[5], q6)
    total = _rest(h[1], turned @ np.swapaxes(after, -1, -2))
    foot = _turn(h[0], -q1, point - p[0])[:, None] - (p[1] - p[0])
    foot = foot - _turn(h[1], total, np.broadcast_to(centre - p[3], foot.shape))
    q2, q3, q4 = _planar(arm, foot, total)
    return _listed(q1[:, None, None], q2, q3, q4, q5[:, :, None], q6[:, :, None])


def _planar(arm: _Screws, foot: Array, total: Array) -> tuple[Array, Array, Array]:
    """Return both (q2, q3, q4), each (2, 2, 2, N), of axis 4's foot from axis 2 and total turn."""
    h, upper, fore = arm.axis, arm.point[2] - arm.point[1], arm.point[3] - arm.point[2]
    q3 = _two_ways(_angle_to_distance(upper, h[2], fore, np.linalg.norm(foot, axis=-1)), 2)
    bent = upper + _turn(h[2], q3, np.broadcast_to(fore, (*q3.shape, 3)))
    q2 = _angle_onto(h[1], bent, foot[:, :, None])
    signs = h[1] @ h[2], h[1] @ h[3]
    return q2, q3, signs[1] * (total[:, :, None] - q2 - signs[0] * q3)


def _rest(axis: Array, rotation: Array) -> Array:
    """Return the angle of rotations (..., 3, 3) known to be about the axis."""
    aside = np.cross(axis, np.eye(3)[int(np.argmin(np.abs(axis)))])
    return _angle_onto(axis, np.broadcast_to(aside, rotation.shape[:-1]), rotation @ aside)


def _parallel(arm: _Screws, i: int, j: int) -> bool:
    return bool(np.linalg.norm(np.cross(arm.axis[i], arm.axis[j])) < _EXACT)


def _off_axis(arm: _Screws, i: int, point: Array) -> float:
    return float(np.linalg.norm(np.cross(point - arm.point[i], arm.axis[i])))


def _meeting(arm: _Screws, i: int, j: int) -> Array | None:
    """Return the point where two axes meet, or None when they are parallel or pass by."""
    if _parallel(arm, i, j):
        return None
    directions = np.stack([arm.axis[i], -arm.axis[j]], axis=-1)
    steps = np.linalg.lstsq(directions, arm.point[j] - arm.point[i], rcond=None)[0]
    point = arm.point[i] + steps[0] * arm.axis[i]
    return point if _off_axis(arm, j, point) < _EXACT else None


_SOLVERS: dict[str, _Solver] = {'spherical wrist': _spherical, 'three parallel': _three_parallel}


def _turn(axis: Array, angle: Array, vector: Array) -> Array:
    """Return vectors (..., 3) turned by angles (...) about a fixed unit axis (3,)."""
    cosine, sine = np.cos(angle)[..., None], np.sin(angle)[..., None]
    along = (vector @ axis)[..., None] * axis
    return along + cosine * (vector - along) + sine * _cross(axis, vector)


def _turn_matrix(axis: Array, angle: Array) -> Array:
    """Return rotation matrices (..., 3, 3) by angles (...) about a fixed unit axis (3,)."""
    along, around = np.outer(axis, axis), skew(axis)
    cosine, sine = np.cos(angle)[..., None, None], np.sin(angle)[..., None, None]
    return along + cosine * (np.eye(3) - along) + sine * around


def _angle_onto(axis: Array, start: Array, end: Array) -> Array:
    """Return the angle about an axis that turns one vector onto, or nearest to, another, (...)."""
    sine = _cross(start, end) @ axis
    cosine = (start * end).sum(axis=-1) - (start @ axis) * (end @ axis)
    return np.asarray(np.arctan2(sine, cosine))


def _angle_to_height(along: Array, axis: Array, start: Array, height: Array) -> Array:
    """Return both angles (2, ...) [rad] at which a turned vector has a component along another."""
    level = (start @ axis)[..., None] * axis
    cosine = ((start - level) * along).sum(axis=-1)
    sine = (_cross(axis, start) * along).sum(axis=-1)
    wanted = height - (level * along).sum(axis=-1)
    size = np.hypot(cosine, sine)
    spread = np.arccos(np.clip(wanted / np.where(size > 0.0, size, 1.0), -1.0, 1.0))
    middle = np.arctan2(sine, cosine)
    return np.stack([middle + spread, middle - spread])


def _angle_to_distance(offset: Array, axis: Array, start: Array, distance: Array) -> Array:
    """Return both angles at which ``offset`` plus the turned vector has a length, (2, ...)."""
    height = 0.5 * (distance**2 - (offset**2).sum(axis=-1) - (start**2).sum(axis=-1))
    return _angle_to_height(offset, axis, start, height)


def _cross(first: Array, second: Array) -> Array:
    """Return cross products (..., 3); numpy's own spends most of its time on moving axes."""
    a, b, c = first[..., 0], first[..., 1], first[..., 2]
    x, y, z = second[..., 0], second[..., 1], second[..., 2]
    out = np.empty(np.broadcast_shapes(first.shape, second.shape))
    out[..., 0] = b * z - c * y
    out[..., 1] = c * x - a * z
    out[..., 2] = a * y - b * x
    return out


OTHER_POSTURE = (
    'the arm would have to change its posture on the way; '
    'move the seam, turn the torch or sample the path more densely'
)


def solve(robot: Robot, pose: Array, seed: Array | None = None) -> Array:
    """
    Return every branch within the joint limits, shape (K, n) [rad or m].

    Each revolute joint is given once, on the turn nearest the middle of its range. A chain with
    more than six joints has no finite set; it gets a sample of postures.

    Parameters
    ----------
    pose : array, shape (4, 4)
        ``T_world_tool``.
    seed : array, shape (n,), optional
        A further start where the solution is searched for numerically.

    Raises
    ------
    ReachError
        No joint positions within the limits reach the pose.
    ModelError
        The robot has a positioner.

    Examples
    --------
    >>> import numpy as np
    >>> import weld_twin_core as wt
    >>> robot = wt.load('ur5')
    >>> pose = wt.forward(robot, [0.3, -1.2, 1.5, -1.8, -1.5, 0.2])
    >>> branches = wt.solve(robot, pose)
    >>> len(branches), np.allclose(wt.forward(robot, branches), pose, atol=1e-9)
    (8, True)

    """
    robot.refuse_positioner('inverse kinematics')
    if family(robot) is None:
        result, _ = search(robot, pose, seed)
    else:
        candidates = branches(robot, pose[None])[:, 0]
        candidates = candidates[np.isfinite(candidates).all(axis=-1)]
        poses = np.broadcast_to(pose, (len(candidates), 4, 4))
        result, error = polish(robot, candidates, poses)
        result = centred(robot, result)
        inside = ((result >= robot.lower) & (result <= robot.upper)).all(axis=-1)
        result = result[inside & (np.abs(error).max(axis=-1) < CLOSED)]
    if not len(result):
        raise ReachError(f'{robot.name} cannot reach {where(pose)}: {why_not(robot, pose)}')
    return result


def where(pose: Array) -> str:
    """Return the position of a pose for a message."""
    x, y, z = pose[:3, 3]
    return f'({x:.3f}, {y:.3f}, {z:.3f}) m'


def gap(missing: Array) -> str:
    """Return how far a pose error, shape (6,), is for a message."""
    away, turned = np.linalg.norm(missing[:3]), np.linalg.norm(missing[3:])
    return f'{away:.3g} m and {np.degrees(turned):.3g} degrees away'


def why_not(robot: Robot, pose: Array) -> str:
    """Return why a pose is not reached: too far, or past a joint limit."""
    result, missing = search(_without_limits(robot), pose)
    if not len(result):
        return f'the nearest the tool gets is {gap(missing)}; move the seam or turn the torch'
    excess = np.maximum(robot.lower - result, result - robot.upper)
    best = int(np.argmin(excess.max(axis=-1)))
    if excess[best].max() <= 0.0:
        return OTHER_POSTURE
    joint = int(np.argmax(excess[best]))
    return past_limit(robot, joint, result[best, joint])


def past_limit(robot: Robot, joint: int, value: float) -> str:
    """Return for a message that joint number ``joint`` would need a position [rad or m]."""
    return (
        f'joint {robot.joint_names[joint]!r} would have to be at {value:.3f}, outside '
        f'[{robot.lower[joint]:.3f}, {robot.upper[joint]:.3f}]; move the seam or turn the torch'
    )


def _without_limits(robot: Robot) -> Robot:
    lower = np.where(robot.prismatic, robot.lower, -np.inf)
    return replace(robot, lower=lower, upper=np.where(robot.prismatic, robot.upper, np.inf))
