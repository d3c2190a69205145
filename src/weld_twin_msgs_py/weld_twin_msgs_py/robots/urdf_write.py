# Copyright 2026 weld_twin contributors
# SPDX-License-Identifier: Apache-2.0
"""A robot to a URDF whose frames are exact, or into the one it came from: there origins alone move."""

from collections.abc import Sequence
from dataclasses import replace
from pathlib import Path
from typing import NamedTuple
from xml.etree.ElementTree import Comment, Element, SubElement, indent, tostring

import numpy as np
from defusedxml.ElementTree import fromstring

from weld_twin_core.arm.known_arms import controller_frames
from weld_twin_core.arm.robot import Robot
from weld_twin_core.arm.rotation import rotation_matrix, transform
from weld_twin_core.arrays import Array

from ..files.whole_files import write_text
from ..files.yaml_file import read_text
from .urdf_read import Chain, chain_of, read_urdf
from .urdf_tree import BASE, FLANGE, MOVABLE, Joint, inverse, read_tree, turn

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


SAME = 1e-12
"""Numbers of frames [m, and parts of unit vectors] that differ by rounding alone."""


class GivenUrdf(NamedTuple):
    """A URDF, the links between which it was read, and the link of the controller's flange."""

    path: Path
    base_link: str | None = None
    tip_link: str | None = None
    flange_link: str | None = None


class Hand(NamedTuple):
    """Frames of the last joint, the tip, and the tip with its given tool, in the base."""

    carrier: Array
    plain: Array
    tip: Array


def write_urdf_like(
    path: Path | str,
    given: GivenUrdf,
    robot: Robot,
    *,
    overwrite: bool = False,
    notes: Sequence[str] = (),
) -> None:
    """
    Write a robot into a copy of the URDF that it was read from.

    The origin of every moving joint is set so that its axis and the links behind it are where the
    robot has them; the origin of the last fixed joint before the tip holds the tool. Where the tip
    is the controller's flange, or carries it, a link ``controller_flange`` keeps the flange where
    it is, and a fixed joint more holds the tool. Where its base stands is not written.
    """
    chain = chain_of(*given[:3])
    nominal, arm = read_urdf(*given), robot
    moved: list[tuple[Joint, Array]] = []
    table: Hand | None = None
    if chain.up:
        nominal, arm, moved, table = _beside(given, chain, nominal, robot)
    based = replace(arm, T_world_base=nominal.T_world_base)
    root = fromstring(read_text(given.path, 'URDF'), forbid_dtd=True)
    joints = {
        item.get('name'): item for item in root.iter('joint') if item.find('parent') is not None
    }
    last = _last(chain.down)
    was, now = joint_frames(nominal), joint_frames(based)
    origins, carrier = _moving(chain.down[: last + 1], chain.start, was, now)
    plain = now[-1] @ inverse(based.T_flange_tool) @ nominal.T_flange_tool
    hand = Hand(carrier, plain, now[-1])
    on_tip = _flange_on_tip(given, nominal, chain.down[-1].child)
    for joint, origin in [*moved, *origins, *_fixed(chain.down[last + 1 :], hand, on_tip)]:
        _set(joints[joint.name], origin)
    if on_tip:
        at = hand.plain if len(chain.down) > last + 1 else hand.carrier
        end = _put_between(root, joints[chain.down[-1].name], inverse(at) @ hand.tip)
        if end:
            assert nominal.controller is not None
            flange = inverse(nominal.T_flange_tool) @ nominal.controller.flange
            add_fixed(root, end, FLANGE, inverse(at) @ hand.plain @ flange)
    if table is not None and chain.up[-1].kind in MOVABLE:
        _put_between(root, joints[chain.up[-1].name], inverse(table.carrier) @ table.tip)
    for k, note in enumerate(notes):
        root.insert(k, Comment(f' {note.replace("--", "-")} '))
    text = '<?xml version="1.0"?>\n' + tostring(root, encoding='unicode') + '\n'
    write_text(path, text, overwrite=overwrite)


def _last(joints: list[Joint]) -> int:
    return max(k for k, joint in enumerate(joints) if joint.kind in MOVABLE)


def _beside(
    given: GivenUrdf, chain: Chain, nominal: Robot, robot: Robot
) -> tuple[Robot, Robot, list[tuple[Joint, Array]], Hand]:
    """
    Return given and corrected robot without their positioner, and what becomes of that.

    The robot stays where it stands, and the positioner moves. Where the recording was measured on
    the table is not written.
    """
    root = chain.down[0].parent
    alone = read_urdf(given.path, root, chain.down[-1].child, given.flange_link)
    (was, _), (now, arm) = nominal.branches, robot.branches
    frames = [
        joint_frames(
            foot.with_frames(
                base=alone.T_world_base @ inverse(cell.T_root_base), tool=was.T_flange_tool
            )
        )
        for foot, cell in ((was, nominal), (now, robot))
    ]
    last = _last(chain.up)
    origins, carrier = _moving(chain.up[: last + 1], np.eye(4), *frames)
    table = Hand(carrier, frames[1][-1], frames[1][-1])
    return alone, arm, [*origins, *_fixed(chain.up[last + 1 :], table, False)], table


def _moving(
    chain: list[Joint], start: Array, was: list[Array], now: list[Array]
) -> tuple[list[tuple[Joint, Array]], Array]:
    """Return the moving joints, each with its new origin (4, 4), and where the last one is."""
    out: list[tuple[Joint, Array]] = []
    before, after, fixed, k = start, start, np.eye(4), 0
    for joint in chain:
        before = before @ joint.T_parent_joint
        if joint.kind not in MOVABLE:
            fixed = fixed @ joint.T_parent_joint
            continue
        new = now[k] @ inverse(was[k]) @ before
        out.append((joint, inverse(after @ fixed) @ new))
        after, fixed, k = new, np.eye(4), k + 1
    return out, after


def _flange_on_tip(given: GivenUrdf, nominal: Robot, tip: str) -> bool:
    """Tell whether the flange is the tip or hangs on it: a tool that moves must not take it along."""
    assert nominal.controller is not None
    above, link = read_tree(given.path).above, nominal.controller.flange_link
    while link != tip and link in above:
        link = above[link].parent
    return link == tip


def _fixed(behind: list[Joint], hand: Hand, on_tip: bool) -> list[tuple[Joint, Array]]:
    """Return the fixed joints before the tip whose origins change: the first, and that of the tool."""
    if not behind:
        return []
    goal = hand.plain if on_tip or len(behind) > 1 else hand.tip
    rest = np.eye(4)
    for joint in behind[1:]:
        rest = rest @ joint.T_parent_joint
    out = [(behind[0], inverse(hand.carrier) @ goal @ inverse(rest))]
    if len(behind) > 1 and not on_tip:
        tool = behind[-1].T_parent_joint @ inverse(hand.plain) @ hand.tip
        out.append((behind[-1], tool))
    return out


def _put_between(root: Element, joint: Element, T_end_tip: Array) -> str:
    """Let a joint lead to a new link that its child is fixed to; return it, empty for no need."""
    if np.abs(T_end_tip - np.eye(4)).max() < SAME:
        return ''
    child = joint.find('child')
    assert child is not None
    tip, end = str(child.get('link')), f'{joint.get("name")}_end'
    child.set('link', end)
    SubElement(root, 'link', {'name': end})
    fix(root, f'{end}_to_{tip}', end, tip, T_end_tip)
    return end


def _set(joint: Element, origin: Array) -> None:
    item = joint.find('origin')
    if item is None:
        item = SubElement(joint, 'origin')
    item.set('xyz', numbers(origin[:3, 3]))
    item.set('rpy', numbers(roll_pitch_yaw(origin[:3, :3])))
