# Copyright 2026 weld_twin contributors
# SPDX-License-Identifier: Apache-2.0
"""A robot to a URDF whose frames are exact, such as a corrected model for the controller."""

from __future__ import annotations

from collections.abc import Sequence
from pathlib import Path
from xml.etree.ElementTree import Comment, Element, SubElement, indent, tostring

import numpy as np

from weld_twin_core.arm.controller_lookup import controller_frames
from weld_twin_core.arm.robot import Robot
from weld_twin_core.arm.rotation import transform
from weld_twin_core.arrays import Array

from ..files.whole_files import write_text
from .axes_to_dh import inverse
from .controller_links import BASE, FLANGE
from .urdf_tree import turn

EFFORT = '1000.0'
_NOTE = (
    ' Kinematics and masses of {name}. Effort limits and inertias are placeholders: a model of '
    'positional accuracy has none. Gravity in the base frame: {gravity} m/s^2. '
)


def write_urdf(
    path: Path | str, robot: Robot, *, overwrite: bool = False, notes: Sequence[str] = ()
) -> None:
    """
    Write a URDF from the measuring frame (link ``world``) to the tool (link ``tool``).

    The controller's base and flange are links too, so that they are read again.

    Parameters
    ----------
    path : Path or str
    robot : Robot
    overwrite : bool
    notes : sequence of str
        Comments at the top.

    Raises
    ------
    DataError
        The file exists and ``overwrite`` is not set, or the place cannot be written.

    """
    root = Element('robot', {'name': robot.name})
    gravity = ' '.join(f'{value:g}' for value in robot.gravity)
    root.append(Comment(_NOTE.format(name=robot.name.replace('--', '-'), gravity=gravity)))
    for note in notes:
        root.append(Comment(f' {note.replace("--", "-")} '))
    SubElement(root, 'link', {'name': 'world'})
    parent, ahead = 'world', robot.T_world_base
    for k, name in enumerate(robot.joint_names):
        before, after = _split_row(robot, k)
        joint = fix(root, name, parent, f'link_{k + 1}', ahead @ before)
        _motion(joint, robot, k)
        parent, ahead = f'link_{k + 1}', after
        link = SubElement(root, 'link', {'name': parent})
        if robot.mass is not None and robot.com is not None:
            _inertial(link, float(robot.mass[k]), after[:3, :3] @ robot.com[k] + after[:3, 3])
    frames = controller_frames(robot)
    tool_on_flange = inverse(frames.flange) @ robot.T_flange_tool
    add_fixed(root, 'world', BASE, robot.T_world_base @ frames.base)
    add_fixed(root, 'world', 'base_link', robot.T_world_origin)
    add_fixed(root, parent, FLANGE, ahead @ frames.flange)
    fix(root, 'flange_to_tool', FLANGE, 'tool', tool_on_flange)
    tool = SubElement(root, 'link', {'name': 'tool'})
    if robot.payload_mass > 0.0:
        _inertial(tool, robot.payload_mass, robot.payload_com)
    indent(root)
    text = '<?xml version="1.0"?>\n' + tostring(root, encoding='unicode') + '\n'
    write_text(path, text, overwrite=overwrite)


def add_fixed(root: Element, parent: str, name: str, T: Array) -> None:
    """Add a link that is fixed to another at a place (4, 4) in it."""
    fix(root, f'{parent}_to_{name}', parent, name, T)
    SubElement(root, 'link', {'name': name})


def joint_frames(robot: Robot) -> list[Array]:
    """
    Return the frame of every joint at zero, axis z, and of the tool last, (4, 4) each.

    Parameters
    ----------
    robot : Robot

    """
    out, ahead = [], robot.T_world_base
    for k in range(robot.n):
        before, after = _split_row(robot, k)
        out.append(ahead @ before)
        ahead = out[-1] @ after
    return [*out, ahead @ robot.T_flange_tool]


def _split_row(robot: Robot, k: int) -> tuple[Array, Array]:
    """Return the parts of a row before and after its motion, which is about or along z."""
    turned = turn(0, robot.alpha[k]) @ turn(1, robot.beta[k])
    spin = transform(turn(2, robot.theta[k]), np.array([0.0, 0.0, robot.d[k]]))
    along = np.array([robot.a[k], 0.0, 0.0])
    if robot.convention == 'standard':
        return np.eye(4), spin @ transform(turned, along)
    return transform(turned, turned @ along) @ spin, np.eye(4)


def fix(root: Element, name: str, parent: str, child: str, T: Array) -> Element:
    """Add a fixed joint between two links, the child at a place (4, 4) in the parent."""
    joint = SubElement(root, 'joint', {'name': name, 'type': 'fixed'})
    SubElement(joint, 'parent', {'link': parent})
    SubElement(joint, 'child', {'link': child})
    SubElement(
        joint, 'origin', {'xyz': numbers(T[:3, 3]), 'rpy': numbers(roll_pitch_yaw(T[:3, :3]))}
    )
    return joint


def _motion(joint: Element, robot: Robot, k: int) -> None:
    lower, upper, speed = robot.lower[k], robot.upper[k], robot.max_velocity[k]
    limit = {'effort': EFFORT, 'velocity': repr(float(speed if np.isfinite(speed) else 0.0))}
    bounded = bool(np.isfinite(lower) and np.isfinite(upper))
    if bounded:
        limit |= {'lower': repr(float(lower)), 'upper': repr(float(upper))}
    kind = 'prismatic' if robot.prismatic[k] else 'revolute' if bounded else 'continuous'
    joint.set('type', kind)
    SubElement(joint, 'axis', {'xyz': '0 0 1'})
    SubElement(joint, 'limit', limit)


def _inertial(link: Element, mass: float, com: Array) -> None:
    inertial = SubElement(link, 'inertial')
    SubElement(inertial, 'origin', {'xyz': numbers(com), 'rpy': '0 0 0'})
    SubElement(inertial, 'mass', {'value': repr(float(mass))})
    SubElement(inertial, 'inertia', dict.fromkeys(('ixx', 'ixy', 'ixz', 'iyy', 'iyz', 'izz'), '0'))


def roll_pitch_yaw(rotation: Array) -> Array:
    """Return fixed-axis roll, pitch, yaw; each angle is taken out before the next is read."""
    yaw = np.arctan2(rotation[1, 0], rotation[0, 0])
    rest = turn(2, yaw).T @ rotation
    pitch = np.arctan2(-rest[2, 0], rest[0, 0])
    return np.array([np.arctan2(-rest[1, 2], rest[1, 1]), pitch, yaw])


def numbers(values: Array) -> str:
    """Return numbers as a URDF has them, so that they are read back as they are."""
    return ' '.join(repr(float(value)) for value in values)
