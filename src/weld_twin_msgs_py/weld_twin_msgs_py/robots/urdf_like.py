# Copyright 2026 weld_twin contributors
# SPDX-License-Identifier: Apache-2.0
"""A corrected robot in the URDF it came from: every name, mesh and limit stays, origins move."""

from collections.abc import Sequence
from dataclasses import replace
from pathlib import Path
from typing import NamedTuple
from xml.etree.ElementTree import Comment, Element, SubElement, tostring

import numpy as np
from defusedxml.ElementTree import fromstring

from weld_twin_core.arm.robot import Robot
from weld_twin_core.arrays import Array

from ..files.whole_files import write_text
from ..files.yaml_file import read_text
from .axes_to_dh import inverse
from .controller_links import FLANGE
from .urdf_read import Chain, chain_of, read_urdf
from .urdf_tree import MOVABLE, Joint, read_tree
from .urdf_write import add_fixed, fix, joint_frames, numbers, roll_pitch_yaw

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
