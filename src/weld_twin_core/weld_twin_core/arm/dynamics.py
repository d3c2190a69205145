# Copyright 2026 weld_twin contributors
# SPDX-License-Identifier: Apache-2.0
"""
Load torque on the joints from gravity, payload and the wrench on the tool.

A positive torque turns the joint in its positive direction; it is what the load does to the
joint, the negative of what the motor must hold.

The joints of a positioner carry what stands on them, and not the robot: both hang on the same
foot. The force of a process acts between tool and workpiece, and so on the joints of both.
"""

from collections.abc import Sequence
from typing import Any

import numpy as np
from numpy.typing import ArrayLike

from ..arrays import Array
from .chain import Frames, frames, positions
from .channels import NO_SHIFT, Shift
from .robot import Robot
from .vectors import components, cross, dot, pad


def point_force_torque(
    robot: Robot, chain: Frames, point: Array, force: Array, *, contact: bool = False
) -> Array:
    """
    Return joint torques (n, ...) of a force [N] at a point [m] that the tool carries, (3, ...).

    In a contact the force pushes back on the workpiece; otherwise a positioner does not feel it.
    """
    axes = max(point.ndim, force.ndim, chain.position.ndim) - 1
    point, force = pad(point, axes), pad(force, axes)
    torques = []
    for i, row in enumerate(chain.rows):
        z = pad(row.z, axes)
        way = z if robot.prismatic[i] else cross(z, point - pad(row.z_point, axes))
        torque = dot(way, force)
        if i < robot.behind:
            torque = -torque if contact else np.zeros_like(torque)
        torques.append(torque)
    return np.stack(np.broadcast_arrays(*torques))


def _gravity_direction(robot: Robot, chain: Frames) -> Array:
    """Return gravity in the world frame, components first, shape (3, ...) [m/s^2]."""
    return pad(components(chain.root_rotation @ robot.gravity), chain.position.ndim - 1)


def payload_torque(robot: Robot, chain: Frames, mass: Array | float, com: Array) -> Array:
    """Return torques (n, ...) [N m] of a mass [kg] that the tool carries at com (..., 3) [m]."""
    weight = mass * pad(_gravity_direction(robot, chain), np.ndim(mass))
    return point_force_torque(robot, chain, _in_world(chain, com), weight)


def _in_world(chain: Frames, point: Array) -> Array:
    """Return a point of the tool frame, shape (..., 3), in the world, components first [m]."""
    return components(chain.position + (chain.rotation @ np.asarray(point)[..., None])[..., 0])


def wrench_rotation(robot: Robot, chain: Frames, frame: str) -> Array:
    """Return a wrench's axes in the world, (..., 3, 3): of the 'tool', or 'base', the foot."""
    if frame == 'tool':
        return chain.rotation
    return np.asarray(chain.root_rotation @ robot.T_base_foot[:3, :3])


def _wrench_in_world(
    robot: Robot, chain: Frames, wrench: Array, frame: str
) -> tuple[Array, Array]:
    """Return force and moment of a wrench in the world frame, components first, (3, ...) each."""
    rotation = wrench_rotation(robot, chain, frame)
    force = components((rotation @ wrench[..., :3, None])[..., 0])
    return force, components((rotation @ wrench[..., 3:, None])[..., 0])


def wrench_torque(robot: Robot, chain: Frames, wrench: Array, frame: str = 'tool') -> Array:
    """Return torques (n, ...) [N m] of a wrench (..., 6) [N, N m] at the tool point: J^T w."""
    force, moment = _wrench_in_world(robot, chain, wrench, frame)
    torque = point_force_torque(robot, chain, components(chain.position), force, contact=True)
    moment = pad(moment, torque.ndim - 1)
    for i, row in enumerate(chain.rows):
        if not robot.prismatic[i]:
            own = dot(pad(row.z, torque.ndim - 1), moment)
            torque[i] += -own if i < robot.behind else own
    return torque


def gravity_torque(robot: Robot, q: ArrayLike, shift: Shift = NO_SHIFT) -> Array:
    """
    Return load torques, shape (..., n) [N m], of the links and the robot's own payload.

    The negative of the generalised gravity of a rigid chain (Siciliano et al. 2009, eq. 7.39).

    Parameters
    ----------
    robot : Robot
        Links without masses weigh nothing.
    q : array_like, shape (..., n) [rad or m]
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
    >>> torque = wt.gravity_torque(wt.load('ur5'), np.zeros(6))
    >>> print(torque[:3].round(1), 'N m')
    [ 0.  53.8 15.6] N m

    """
    q = positions(robot, q)
    return np.moveaxis(chain_gravity_torque(robot, frames(robot, q, shift)), 0, -1)


def chain_gravity_torque(robot: Robot, chain: Frames) -> Array:
    """Return load torques, shape (n, ...) [N m], for frames already at hand."""
    torque = np.zeros((robot.n, *chain.position.shape[:-1]))
    gravity = _gravity_direction(robot, chain)
    for i, (mass, lever) in enumerate(_loads(robot, chain)):
        z = chain.rows[i].z
        torque[i] = mass * dot(z, gravity) if robot.prismatic[i] else dot(cross(z, lever), gravity)
    return torque


def _loads(robot: Robot, chain: Frames) -> list[tuple[float, Array]]:
    """Return the mass beyond each joint, and its first moment about the joint, (3, ...) [kg m]."""
    samples = chain.position.shape[:-1]
    mass = robot.payload_mass
    moment = np.zeros((3, *samples))
    if mass:
        centre = chain.position + chain.rotation @ robot.payload_com
        moment = mass * components(centre)
    robots = _heaped(robot, chain, list(range(robot.behind, robot.n))[::-1], mass, moment)
    if not robot.behind:
        return robots[::-1]
    outward = list(range(robot.behind))
    return _heaped(robot, chain, outward, 0.0, np.zeros((3, *samples))) + robots[::-1]


def _heaped(
    robot: Robot, chain: Frames, inward: list[int], mass: float, moment: Array
) -> list[tuple[float, Array]]:
    """Return mass and first moment beyond each joint, from the outermost joint to the foot."""
    loads = []
    for i in inward:
        if robot.mass is not None and robot.com is not None:
            moment = moment + robot.mass[i] * link_point(robot, chain, i, robot.com[i])
            mass += robot.mass[i]
        loads.append((mass, moment - mass * chain.rows[i].z_point))
    return loads


def torque_slope(
    robot: Robot, chain: Frames, wrench: Array | None = None, frame: str = 'tool'
) -> Array:
    """
    Return how the load torques change with the joints, d tau_i / d q_j, shape (n, n, ...).

    Of gravity it is minus the Hessian of the potential: what joint j sets in motion shifts the
    first moment that joint i carries. A wrench, see `wrench_torque`, that is fixed to the tool
    turns along.
    """
    slope = _weight_slope(robot, chain, _loads(robot, chain))
    return slope if wrench is None else slope + _wrench_slope(robot, chain, wrench, frame)


def payload_slope(robot: Robot, chain: Frames, mass: Array | float, com: Array) -> Array:
    """Return how torques of `payload_torque` change with the joints, (n, n, ...), torque first."""
    centre = _in_world(chain, com)
    levers = [mass * (centre - pad(row.z_point, centre.ndim - 1)) for row in chain.rows]
    loads: list[tuple[Any, Array]] = [(mass, lever) for lever in levers]
    for i in range(robot.behind):
        loads[i] = (0.0, np.zeros_like(levers[i]))
    return _weight_slope(robot, chain, loads)


def _weight_slope(robot: Robot, chain: Frames, loads: Sequence[tuple[Any, Array]]) -> Array:
    """Return d tau_i / d q_j of weights, by the mass and first moment beyond each joint."""
    axes = loads[0][1].ndim - 1
    gravity = pad(_gravity_direction(robot, chain), axes)
    slope = np.zeros((robot.n, robot.n, *loads[0][1].shape[1:]))
    for j, (mass, lever) in enumerate(loads):
        z = pad(chain.rows[j].z, axes)
        shifted = mass * z if robot.prismatic[j] else cross(z, lever)
        pull = cross(shifted, gravity)
        # The joints between joint j and the foot carry what it moves.
        for i in range(j, robot.behind) if j < robot.behind else range(robot.behind, j + 1):
            if not robot.prismatic[i]:
                slope[i, j] = slope[j, i] = dot(pad(chain.rows[i].z, axes), pull)
    return slope


def _wrench_slope(robot: Robot, chain: Frames, wrench: Array, frame: str) -> Array:
    """Return d tau_i / d q_j of a wrench on the tool, shape (n, n, ...)."""
    force, moment = _wrench_in_world(robot, chain, wrench, frame)
    tip, still = components(chain.position), np.zeros_like(force)
    slides = robot.prismatic
    levers = [tip - row.z_point for row in chain.rows]
    ways = [-row.z if i < robot.behind else row.z for i, row in enumerate(chain.rows)]
    slope = np.zeros((robot.n, robot.n, *chain.position.shape[:-1]))
    for j, way in enumerate(ways):
        turned = np.zeros_like(way) if slides[j] else way
        moved = way if slides[j] else cross(way, levers[j])
        for i in range(robot.n):
            beyond = j > i
            # The force turns with the tool, or with the arm's foot, against what carries joint i.
            turns = turned * ((frame == 'tool' or j < robot.behind) - (not beyond))
            by_force, by_moment = cross(turns, force), cross(turns, moment)
            shifted = moved if beyond else still
            own = by_moment + cross(levers[i], by_force) + cross(shifted, force)
            slope[i, j] = dot(ways[i], by_force if slides[i] else own)
    return slope


def carried_moment(
    robot: Robot, chain: Frames, i: int, about: Array, wrench: Array | None, frame: str
) -> Array:
    """Return the moment of what joint i of the robot carries about a point, (3, ...) [N m]."""
    mass, lever = _loads(robot, chain)[i]
    gravity = _gravity_direction(robot, chain)
    moment: Array = cross(lever + mass * (chain.rows[i].z_point - about), gravity)
    if wrench is not None:
        force, own = _wrench_in_world(robot, chain, wrench, frame)
        moment = moment + own + cross(components(chain.position) - about, force)
    return moment


def link_point(robot: Robot, chain: Frames, i: int, point: Array) -> Array:
    """Return a point (3,) of link i's DH frame, at its far end, in the world, (3, ...) [m]."""
    if i + 1 == robot.n:
        return components(chain.flange_point + chain.flange_rotation @ point)
    if i < robot.behind:
        x, y, z, origin = chain.ends[i]
    # The frame at the end of row i is where row i + 1 starts.
    elif robot.convention == 'standard':
        origin, y, z = chain.rows[i + 1].z_point, chain.rows[i].y, chain.rows[i + 1].z
        x = cross(y, z)
    else:
        origin, x, z = chain.rows[i + 1].x_point, chain.rows[i + 1].x, chain.rows[i].z
        y = cross(z, x)
    place: Array = origin + point[0] * x + point[1] * y + point[2] * z
    return place
