# Copyright 2026 weld_twin contributors
# SPDX-License-Identifier: Apache-2.0
"""
The kinematic chain: poses, frames and the derivative of the pose by every channel.

Inside, vectors are kept components first (see `vectors`); public results have the samples first.
"""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import replace
from typing import Any, NamedTuple

import numpy as np
from numpy.typing import ArrayLike

from ..arrays import Array
from ..errors import DataError
from .bulk import kernel_of
from .channels import AXIS, NO_SHIFT, ROW_CHANNELS, ROW_ORDER, TURNS, Channel, Shift
from .robot import Robot
from .rotation import left_jacobian, rotation_matrix, transform
from .vectors import components, cross, pad, samples_first

MANY = 5000
"""Joint positions from which `forward` leaves the work to `bulk`..."""
_MOST_JOINTS = 8
"""... and joints up to which it does: there the work grows threefold with every other joint."""
_RIGHT = 1e-15
"""Cosine up to which an angle is a right one, as most twists of links are: rounding."""


class _RowAxes(NamedTuple):
    """Axes of one DH row in the world frame, components first, shape (3, ...) each [-, m]."""

    z: Array
    z_point: Array
    x: Array
    x_point: Array
    y: Array
    y_point: Array


class Frames(NamedTuple):
    """
    The chain at joint positions, all in the world: tool, rows, flange, base and root.

    The flange is the chain's end before the tool frame; the root, where the robot's rows begin, is
    the base unless a positioner stands between. Rotations are (..., 3, 3), points (..., 3).
    ``ends`` are axes x, y, z and origin, components first, at the outer end of the rows that the
    chain passes backwards.
    """

    rotation: Array
    position: Array
    rows: tuple[_RowAxes, ...]
    flange_rotation: Array
    flange_point: Array
    base_rotation: Array
    base_point: Array
    root_rotation: Array
    root_point: Array
    ends: tuple[tuple[Array, ...], ...] = ()


def _six(shift: Shift, name: str) -> Array | None:
    """Stack the six components of a frame channel, shape (..., 6), or None when untouched."""
    if not any((name, k) in shift for k in range(6)):
        return None
    parts = [np.asarray(shift.get((name, k), 0.0), dtype=np.float64) for k in range(6)]
    return np.stack(np.broadcast_arrays(*parts), axis=-1)


def base_frame(robot: Robot, shift: Shift = NO_SHIFT) -> tuple[Array, Array]:
    """Return rotation (..., 3, 3) and origin (..., 3) of the displaced base in the world."""
    rotation, origin = robot.T_world_base[:3, :3], robot.T_world_base[:3, 3]
    error = _six(shift, 'base')
    if error is None:
        return rotation, origin
    return rotation_matrix(error[..., 3:]) @ rotation, origin + error[..., :3]


def tool_frame(robot: Robot, shift: Shift = NO_SHIFT) -> tuple[Array, Array]:
    """Return rotation (..., 3, 3) and origin (..., 3) of the displaced tool in the flange."""
    rotation, origin = robot.T_flange_tool[:3, :3], robot.T_flange_tool[:3, 3]
    error = _six(shift, 'tool')
    if error is None:
        return rotation, origin
    return rotation @ rotation_matrix(error[..., 3:]), origin + error[..., :3]


def root_frame(robot: Robot, shift: Shift = NO_SHIFT) -> tuple[Array, Array]:
    """Return rotation (..., 3, 3) and origin (..., 3) of the base in the positioner's displaced foot."""
    rotation, origin = robot.T_root_base[:3, :3], robot.T_root_base[:3, 3]
    error = _six(shift, 'root')
    if error is None:
        return rotation, origin
    turned = rotation @ np.swapaxes(rotation_matrix(error[..., 3:]), -1, -2)
    foot = -(rotation.T @ origin) + error[..., :3]
    return turned, -(turned @ foot[..., None])[..., 0]


def _nothing(value: Any) -> bool:
    """Return whether a value is the number zero, as half the values of most arms are."""
    return isinstance(value, float) and value == 0.0


def _turn(first: Array, second: Array, angle: Array) -> tuple[Array, Array]:
    """Turn the pair of axes (first, second) by an angle in their plane."""
    if _nothing(angle):
        return first, second
    cosine, sine = np.cos(angle), np.sin(angle)
    if isinstance(angle, float) and abs(cosine) < _RIGHT:
        return second * sine, first * -sine
    return first * cosine + second * sine, second * cosine - first * sine


def frames(robot: Robot, q: Array, shift: Shift = NO_SHIFT) -> Frames:
    """Return the frames at joint positions (..., n) [rad or m] with shifts like ``q[..., 0]``."""
    base_rotation, base_point = base_frame(robot, shift)
    axes = max([q.ndim - 1, *(np.ndim(value) for value in shift.values())])
    triad, p = _started(base_rotation, base_point, axes)
    root_rotation, root_point = base_rotation, base_point
    rows: list[_RowAxes] = []
    ends: list[tuple[Array, ...]] = []
    for i, values in enumerate(_row_values(robot, q, shift)):
        order = ROW_ORDER[robot.convention]
        if i < robot.behind:
            ends.append((*triad, p))
            order, values = order[::-1], {key: -value for key, value in values.items()}
        triad, p, row_axes = _row(order, triad, p, values)
        rows.append(row_axes)
        if i + 1 == robot.behind:
            root_rotation, root_point = _beyond(*_ended(triad, p), root_frame(robot, shift))
            triad, p = _started(root_rotation, root_point, axes)
    flange, flange_point = _ended(triad, p)
    return Frames(
        *_beyond(flange, flange_point, tool_frame(robot, shift)),
        tuple(rows),
        flange,
        flange_point,
        base_rotation,
        base_point,
        root_rotation,
        root_point,
        tuple(ends),
    )


def _row_values(robot: Robot, q: Array, shift: Shift) -> list[dict[str, Any]]:
    """Return the values of every row, with joint positions and displacements in them."""
    out: list[dict[str, Any]] = [dict(row) for row in robot.row_values]
    moved = ['d' if slides else 'theta' for slides in robot.prismatic.tolist()]
    for i, values in enumerate(out):
        values[moved[i]] = values[moved[i]] + q[..., i]
    for (name, i), value in shift.items():
        key = moved[i] if name == 'q' else name
        if key in ROW_CHANNELS:
            out[i][key] = out[i][key] + value
    return out


def _beyond(rotation: Array, point: Array, frame: tuple[Array, Array]) -> tuple[Array, Array]:
    """Return rotation and origin of a frame that is given in another one."""
    return rotation @ frame[0], point + (rotation @ frame[1][..., None])[..., 0]


def _started(rotation: Array, point: Array, axes: int) -> tuple[tuple[Array, ...], Array]:
    """Return axes and origin of a frame, components first, for samples of so many axes."""
    x, y, z, p = (pad(components(v), axes) for v in (*(rotation[..., k] for k in range(3)), point))
    return (x, y, z), p


def _ended(triad: tuple[Array, ...], p: Array) -> tuple[Array, Array]:
    """Return rotation (..., 3, 3) and origin (..., 3) of axes that had components first."""
    axes = [samples_first(v) for v in np.broadcast_arrays(*triad)]
    return np.stack(axes, axis=-1), samples_first(p)


def _row(
    order: tuple[str, ...], axes: tuple[Array, ...], p: Array, values: dict[str, Any]
) -> tuple[tuple[Array, ...], Array, _RowAxes]:
    """Return axes and origin behind a row, and where each of its motions began."""
    moving, met = list(axes), {}
    for kind in order:
        k = AXIS[kind]
        met[kind] = moving[k], p
        if kind in TURNS:
            i, j = (k + 1) % 3, (k + 2) % 3
            moving[i], moving[j] = _turn(moving[i], moving[j], values[kind])
        elif not _nothing(values[kind]):
            p = p + values[kind] * moving[k]
    # alpha turns about the x before beta and a moves along the x after it; the two differ only
    # when beta is not zero, so _RowAxes keeps alpha's axis and `column` rebuilds a's from y and z.
    x, y, z = moving
    return (x, y, z), p, _RowAxes(*met['theta'], *met['alpha'], *met['beta'])


def displaced_robot(robot: Robot, shift: Mapping[Channel, float]) -> Robot:
    """Return the robot with displacements of rows, base and tool built in, one number each."""
    rows: dict[str, Any] = {key: getattr(robot, key).copy() for key in ROW_CHANNELS}
    for (name, i), value in shift.items():
        if name in rows:
            rows[name][i] += value
    arrays = {key: np.asarray(value) for key, value in shift.items()}
    kinds = {'T_world_base': base_frame, 'T_root_base': root_frame, 'T_flange_tool': tool_frame}
    moved: dict[str, Any] = {key: transform(*frame(robot, arrays)) for key, frame in kinds.items()}
    return replace(robot, **(rows | moved))


def positions(robot: Robot, q: ArrayLike) -> Array:
    """Return joint positions as an array whose last axis has one entry per joint."""
    array: Array = np.asarray(q, dtype=np.float64)
    if array.ndim == 0 or array.shape[-1] != robot.n:
        raise DataError(
            f'robot {robot.name!r} has {robot.n} joints; joint positions must have shape '
            f'(..., {robot.n}), got {array.shape}'
        )
    return array


def forward(robot: Robot, q: ArrayLike, shift: Shift = NO_SHIFT) -> Array:
    """
    Return tool poses ``T_world_tool``, shape (..., 4, 4) [m].

    The product of the paper's eq. for T_i^{i-1} over the rows, between base and tool frame.

    Parameters
    ----------
    robot : Robot
    q : array_like, shape (..., n) [rad or m]
        Joint positions; leading axes are draws and samples.
    shift : mapping of channel to array, optional
        Displaced channels; each value broadcasts with ``q[..., 0]``.

    Raises
    ------
    DataError
        The last axis of ``q`` does not have one position for every joint.

    Examples
    --------
    >>> import numpy as np
    >>> import weld_twin_core as wt
    >>> pose = wt.forward(wt.load('ur5'), [0.0, -np.pi / 2, 0.0, 0.0, 0.0, 0.0])
    >>> print(pose[:3, 3].round(5), 'm')
    [-0.09465 -0.19145  0.90641] m

    """
    q = positions(robot, q)
    if robot.behind and not shift:
        foot, arm = robot.branches
        T_root_table = forward(foot, q[..., : robot.behind][..., ::-1])
        T_root_tool = forward(arm, q[..., robot.behind :])
        return np.asarray(np.linalg.inv(T_root_table) @ T_root_tool)
    if q.size >= MANY * robot.n and robot.n <= _MOST_JOINTS and not shift:
        return kernel_of(robot).poses(q.reshape(-1, robot.n)).reshape(*q.shape[:-1], 4, 4)
    chain = frames(robot, q, shift)
    return transform(chain.rotation, chain.position)


def column(robot: Robot, chain: Frames, channel: Channel, shift: Shift = NO_SHIFT) -> Array:
    """
    Return d(pose) / d(channel), shape (6, ...): velocity of the tool point, then turn.

    Screw columns as in Everett, Driels and Mooring (1987); 'base' and 'tool' turns use the left
    Jacobian of the rotation vector, so the derivative is exact at the shift that ``chain`` was
    made with.
    Raises KeyError: the channel has no direct column ('tau' reaches the tool through a spring).
    """
    name, i = channel
    if name == 'pose':
        return _unit(i, chain.position.shape[:-1])
    if name in ('base', 'tool'):
        return _frame_column(robot, chain, name, i, shift)
    if name == 'root':
        return _root_column(robot, chain, i, shift)
    if name == 'q':
        name = 'd' if robot.prismatic[i] else 'theta'
    out = _row_column(robot, chain.rows[i], name, components(chain.position))
    return -out if i < robot.behind else out


def _row_column(robot: Robot, row: _RowAxes, name: str, tip: Array) -> Array:
    """Return the velocity of the tip and its turn by one value of a row, passed forwards."""
    match name:
        case 'theta':
            return _turn_column(row.z, row.z_point, tip)
        case 'alpha':
            return _turn_column(row.x, row.x_point, tip)
        case 'beta':
            return _turn_column(row.y, row.y_point, tip)
        case 'd':
            return _slide_column(row.z, tip)
        case 'a':
            along = row.x if robot.convention == 'standard' else cross(row.y, row.z)
            return _slide_column(along, tip)
    raise KeyError(name)


def _turn_column(axis: Array, point: Array, tip: Array) -> Array:
    moment = cross(axis, tip - point)
    return np.concatenate([moment, np.broadcast_to(axis, moment.shape)])


def _slide_column(axis: Array, tip: Array) -> Array:
    out = np.zeros((6,) + np.broadcast_shapes(axis.shape, tip.shape)[1:])
    out[:3] = axis
    return out


def _unit(i: int, samples: tuple[int, ...]) -> Array:
    out = np.zeros((6,) + samples)
    out[i] = 1.0
    return out


def _frame_column(robot: Robot, chain: Frames, name: str, i: int, shift: Shift) -> Array:
    samples = chain.position.shape[:-1]
    if name == 'base' and i < 3:
        return _unit(i, samples)
    if name == 'tool' and i < 3:
        return _slide_column(components(chain.flange_rotation[..., i]), components(chain.position))
    error = _six(shift, name)
    turns = np.eye(3) if error is None else left_jacobian(error[..., 3:])
    axis = turns[..., i - 3]
    if name == 'base':
        axis = np.broadcast_to(axis, samples + (3,))
        point = np.broadcast_to(chain.base_point, samples + (3,))
        return _turn_column(components(axis), components(point), components(chain.position))
    turned = (chain.flange_rotation @ (robot.T_flange_tool[:3, :3] @ axis[..., None]))[..., 0]
    out = np.zeros((6,) + samples)
    out[3:] = components(turned)
    return out


def _root_column(robot: Robot, chain: Frames, i: int, shift: Shift) -> Array:
    """Return the column of a displacement of the positioner's foot: the robot goes the other way."""
    tip = components(chain.position)
    if i < 3:
        return -_slide_column(components(chain.root_rotation[..., i]), tip)
    error = _six(shift, 'root')
    axis = (np.eye(3) if error is None else left_jacobian(error[..., 3:]))[..., i - 3]
    rotation, origin = root_frame(robot, shift)
    to_foot = np.swapaxes(rotation, -1, -2) @ origin[..., None]
    foot = chain.root_point - (chain.root_rotation @ to_foot)[..., 0]
    turned = (chain.root_rotation @ axis[..., None])[..., 0]
    return -_turn_column(components(turned), components(foot), tip)


def jacobian(robot: Robot, q: ArrayLike, shift: Shift = NO_SHIFT) -> Array:
    """
    Return the geometric Jacobian at the tool, shape (..., 6, n), linear part first.

    Its columns are in the world frame: m (or 1) and rad per unit of joint position.

    Parameters
    ----------
    robot : Robot
    q : array_like, shape (..., n) [rad or m]
    shift : mapping of channel to array, optional
        Displaced channels; each value broadcasts with ``q[..., 0]``.

    Raises
    ------
    DataError
        The last axis of ``q`` does not have one position for every joint.

    Examples
    --------
    A turn of the first joint moves the tool of a stretched arm sideways.

    >>> import numpy as np
    >>> import weld_twin_core as wt
    >>> jacobian = wt.jacobian(wt.load('ur5'), np.zeros(6))
    >>> print(jacobian[:3, 0].round(3), 'm/rad')
    [ 0.191 -0.817  0.   ] m/rad

    """
    return chain_jacobian(robot, frames(robot, positions(robot, q), shift), shift)


def chain_jacobian(robot: Robot, chain: Frames, shift: Shift = NO_SHIFT) -> Array:
    """Return the Jacobian, shape (..., 6, n), of frames already at hand."""
    columns = [column(robot, chain, ('q', i), shift) for i in range(robot.n)]
    return np.moveaxis(np.stack(np.broadcast_arrays(*columns), axis=1), (0, 1), (-2, -1))


_FLAT = 0.02
"""Share of the arm's length that the second axis lies beyond the foot, from which it tells the way."""


def up(robot: Robot) -> Array:
    """
    Return the direction against gravity in the base frame of the rows, shape (3,).

    The z axis of the first row does not tell it: a URDF may let that point down, as KUKA's do.
    """
    weight = float(np.linalg.norm(robot.gravity))
    return np.asarray(-robot.gravity / weight) if weight > 0.0 else np.array([0.0, 0.0, 1.0])


def rising(robot: Robot) -> float:
    """Return 1 where the arm rises from its foot along z of its first row, -1 where against it."""
    if robot.n > 1 and not robot.prismatic[0]:
        chain = frames(robot.with_frames(base=np.eye(4)), np.zeros(robot.n))
        rise = float(chain.rows[1].z_point[2])
        if abs(rise) > _FLAT * float(np.abs(robot.a).sum() + np.abs(robot.d).sum()):
            return float(np.sign(rise))
    return -1.0 if robot.T_base_origin[2, 2] < -0.5 else 1.0
