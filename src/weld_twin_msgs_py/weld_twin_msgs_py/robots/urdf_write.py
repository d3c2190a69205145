# Copyright 2026 weld_twin contributors
# SPDX-License-Identifier: Apache-2.0
"""A robot to a URDF whose frames are exact, such as a corrected model for the controller."""

from collections.abc import Sequence
from pathlib import Path
from xml.etree.ElementTree import Comment, Element, SubElement, indent, tostring

import numpy as np

from weld_twin_core.arm.known_arms import controller_frames
from weld_twin_core.arm.robot import Robot
from weld_twin_core.arm.rotation import rotation_matrix, transform
from weld_twin_core.arrays import Array

from ..files.whole_files import write_text
from .axes_to_dh import inverse
from .controller_links import BASE, FLANGE
from .urdf_tree import turn

EFFORT = '1000.0'
ROOT = 'root'
"""The link that positioner and robot stand on."""
_NOTE = (
    ' Kinematics and masses of {name}. Effort limits and inertias are placeholders: a model of '
    'positional accuracy has none. Gravity in the base frame: {gravity} m/s^2. '
)


def write_urdf(
    path: Path | str, robot: Robot, *, overwrite: bool = False, notes: Sequence[str] = ()
) -> None:
    """
    Write a URDF from the measuring frame (link ``world``) to the tool (link ``tool``).

    The controller's base and flange are links too, so that they are read again. Where a positioner
    moves the measuring frame, both stand on a link ``root`` that is upright.

    Parameters
    ----------
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
    arm, foot = robot, 'world'
    if robot.behind:
        arm, foot = _write_positioner(root, robot), ROOT
    parent, ahead = _write_rows(root, arm, foot)
    frames = controller_frames(arm)
    tool_on_flange = inverse(frames.flange) @ arm.T_flange_tool
    add_fixed(root, foot, BASE, arm.T_world_base @ frames.base)
    if not robot.behind:
        add_fixed(root, foot, 'base_link', arm.T_world_origin)
    add_fixed(root, parent, FLANGE, ahead @ frames.flange)
    fix(root, 'flange_to_tool', FLANGE, 'tool', tool_on_flange)
    tool = SubElement(root, 'link', {'name': 'tool'})
    if arm.payload_mass > 0.0:
        _inertial(tool, arm.payload_mass, arm.payload_com)
    indent(root)
    text = '<?xml version="1.0"?>\n' + tostring(root, encoding='unicode') + '\n'
    write_text(path, text, overwrite=overwrite)


def _write_positioner(root: Element, robot: Robot) -> Robot:
    """Write a positioner from its foot to the measuring frame; return the robot beside it."""
    upright = _upright(robot.T_root_base[:3, :3] @ robot.gravity)
    positioner, arm = (
        branch.with_frames(base=upright @ branch.T_world_base) for branch in robot.branches
    )
    SubElement(root, 'link', {'name': ROOT})
    parent, ahead = _write_rows(root, positioner, ROOT, 'workpiece')
    fix(root, f'{parent}_to_world', parent, 'world', ahead @ positioner.T_flange_tool)
    return arm


def _upright(gravity: Array) -> Array:
    """Return the turn (4, 4) that lets gravity pull down z, as that of a URDF does."""
    weight = float(np.linalg.norm(gravity))
    if weight == 0.0:
        return np.eye(4)
    down = gravity / weight
    across = np.cross(down, [0.0, 0.0, -1.0])
    sine = float(np.linalg.norm(across))
    axis = across / sine if sine > 0.0 else np.array([1.0, 0.0, 0.0])
    angle = float(np.arctan2(sine, -down[2]))
    return transform(rotation_matrix(angle * axis), np.zeros(3))


def _write_rows(
    root: Element, robot: Robot, foot: str, link_name: str = 'link'
) -> tuple[str, Array]:
    """Write joints and links from a foot; return the last link, and where the rows end in it."""
    parent, ahead = foot, robot.T_world_base
    for k, name in enumerate(robot.joint_names):
        before, after = _split_row(robot, k)
        joint = fix(root, name, parent, f'{link_name}_{k + 1}', ahead @ before)
        _motion(joint, robot, k)
        parent, ahead = f'{link_name}_{k + 1}', after
        link = SubElement(root, 'link', {'name': parent})
        if robot.mass is not None and robot.com is not None:
            _inertial(link, float(robot.mass[k]), after[:3, :3] @ robot.com[k] + after[:3, 3])
    return parent, ahead


def add_fixed(root: Element, parent: str, name: str, T: Array) -> None:
    """Add a link that is fixed to another at a place (4, 4) in it."""
    fix(root, f'{parent}_to_{name}', parent, name, T)
    SubElement(root, 'link', {'name': name})


def joint_frames(robot: Robot) -> list[Array]:
    """Return the frame of every joint at zero, axis z, and of the tool last, (4, 4) each."""
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
