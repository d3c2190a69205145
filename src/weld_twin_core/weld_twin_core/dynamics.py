# SPDX-FileCopyrightText: weld_twin contributors
# SPDX-License-Identifier: Apache-2.0
"""
Load torque on the joints from gravity, payload and the wrench on the tool.

A positive torque turns the joint in its positive direction; it is what the load does to the
joint, the negative of what the motor must hold.
"""

from typing import NamedTuple

import numpy as np

from .arrays import Array
from .chain import NO_SHIFT, Frames, Shift, _components, _cross, frames
from .robot import Robot


class Payload(NamedTuple):
    """A mass [kg] (..., N or scalar) at a centre (..., 3) [m] in the tool frame."""

    mass: Array
    com: Array


def point_force_torque(robot: Robot, chain: Frames, point: Array, force: Array) -> Array:
    """
    Return joint torques, shape (n, ...), of a force at a point carried by the tool.

    Parameters
    ----------
    point, force : array, shape (3, ...) [m, N]
        Components first, in the world frame.

    """
    torques = []
    for i, row in enumerate(chain.rows):
        if robot.prismatic[i]:
            torques.append((row.z * force).sum(axis=0))
        else:
            lever = _cross(*np.broadcast_arrays(row.z, point - row.z_point))
            torques.append((lever * force).sum(axis=0))
    return np.stack(np.broadcast_arrays(*torques))


def gravity_direction(robot: Robot, chain: Frames) -> Array:
    """Return gravity in the world frame, components first, shape (3, ...) [m/s^2]."""
    gravity = _components(chain.base_rotation @ robot.gravity)
    return gravity.reshape(gravity.shape + (1,) * (chain.position.ndim - gravity.ndim))


def payload_torque(robot: Robot, chain: Frames, mass: Array | float, com: Array) -> Array:
    """Return load torques, shape (n, ...) [N m], of a mass at ``com`` (..., 3) of the tool."""
    centre = chain.position + (chain.rotation @ np.asarray(com)[..., None])[..., 0]
    force = mass * gravity_direction(robot, chain)
    return point_force_torque(robot, chain, _components(centre), force)


def wrench_torque(robot: Robot, chain: Frames, wrench: Array, frame: str = 'tool') -> Array:
    """
    Return load torques, shape (n, ...) [N m], of a wrench (..., 6) on the tool: J^T w.

    ``frame`` says where force and torque are expressed: 'tool' or 'base'; both act at the tool
    centre point.
    """
    rotation = chain.rotation if frame == 'tool' else chain.base_rotation
    force = _components((rotation @ wrench[..., :3, None])[..., 0])
    moment = _components((rotation @ wrench[..., 3:, None])[..., 0])
    torque = point_force_torque(robot, chain, _components(chain.position), force)
    for i, row in enumerate(chain.rows):
        if not robot.prismatic[i]:
            torque[i] += (row.z * moment).sum(axis=0)
    return torque


def gravity_torque(robot: Robot, q: Array, shift: Shift = NO_SHIFT) -> Array:
    """
    Return load torques, shape (..., n) [N m], of the links and the robot's own payload.

    The negative of the generalised gravity of a rigid chain (Siciliano et al. 2009, eq. 7.39).
    """
    return np.moveaxis(chain_gravity_torque(robot, frames(robot, q, shift)), 0, -1)


def chain_gravity_torque(robot: Robot, chain: Frames) -> Array:
    """Return load torques, shape (n, ...) [N m], for frames already at hand."""
    samples = chain.position.shape[:-1]
    total = np.zeros((robot.n,) + samples)
    gravity = gravity_direction(robot, chain)
    if robot.mass is not None and robot.com is not None:
        mass_beyond = 0.0
        moment_beyond = np.zeros((3,) + samples)
        for i in reversed(range(robot.n)):
            centre = link_point(robot, chain, i, robot.com[i])
            moment_beyond = moment_beyond + robot.mass[i] * centre
            mass_beyond += robot.mass[i]
            row = chain.rows[i]
            if robot.prismatic[i]:
                total[i] = mass_beyond * (row.z * gravity).sum(axis=0)
            else:
                lever = moment_beyond - mass_beyond * row.z_point
                total[i] = (_cross(*np.broadcast_arrays(row.z, lever)) * gravity).sum(axis=0)
    if robot.payload_mass:
        total = total + payload_torque(robot, chain, robot.payload_mass, robot.payload_com)
    return total


def link_point(robot: Robot, chain: Frames, i: int, point: Array) -> Array:
    """Return a point (3,) of link i's DH frame in the world, components first (3, ...)."""
    if i + 1 < robot.n:
        # The frame at the end of row i is where row i + 1 starts.
        following = chain.rows[i + 1]
        if robot.convention == 'standard':
            origin, z = following.z_point, following.z
            x = chain.rows[i].x if not np.any(robot.beta[i]) else None
        else:
            origin, x, z = following.x_point, following.x, chain.rows[i].z
    else:
        rotation = chain.flange_rotation
        tool = robot.T_flange_tool[:3, 3]
        origin = _components(chain.position - (rotation @ tool[..., None])[..., 0])
        x, z = _components(rotation[..., 0]), _components(rotation[..., 2])
    if x is None:
        # beta turned x about the row's y, which stays.
        x = _cross(chain.rows[i].y, z)
    y = _cross(z, x)
    return origin + point[0] * x + point[1] * y + point[2] * z
