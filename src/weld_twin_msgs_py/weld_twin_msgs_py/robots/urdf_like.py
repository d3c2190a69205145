# Copyright 2026 weld_twin contributors
# SPDX-License-Identifier: Apache-2.0
"""A corrected robot in the URDF it came from: every name, mesh and limit stays, origins move."""

from __future__ import annotations

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
from .urdf_read import chain_of, read_urdf
from .urdf_tree import MOVABLE, Joint
from .urdf_write import joint_frames, numbers, roll_pitch_yaw


class GivenUrdf(NamedTuple):
    """A URDF and the links between which it was read."""

    path: Path
    base_link: str | None = None
    tip_link: str | None = None


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
    robot has them; the origin of the last fixed joint before the tip holds the tool.

    Parameters
    ----------
    path : Path or str
    given : GivenUrdf
    robot : Robot
        The corrected one, with the joints of the given file; where its base stands in the world
        is not written.
    overwrite : bool
    notes : sequence of str
        Comments at the top.

    Raises
    ------
    DataError
        The file exists and ``overwrite`` is not set, or the place cannot be written.
    ModelError
        The given file cannot be read, or its chain ends in a moving joint, so that a tool that
        moved has no place in it.

    """
    nominal = read_urdf(*given)
    based = replace(robot, T_world_base=nominal.T_world_base)
    chain, start = chain_of(*given)
    root = fromstring(read_text(given.path, 'URDF'), forbid_dtd=True)
    named = {
        item.get('name'): item for item in root.iter('joint') if item.find('parent') is not None
    }
    for joint, origin in _origins(chain, start, nominal, based):
        _set(named[joint.name], origin)
    for k, note in enumerate(notes):
        root.insert(k, Comment(f' {note.replace("--", "-")} '))
    text = '<?xml version="1.0"?>\n' + tostring(root, encoding='unicode') + '\n'
    write_text(path, text, overwrite=overwrite)


def _origins(
    chain: list[Joint], start: Array, nominal: Robot, robot: Robot
) -> list[tuple[Joint, Array]]:
    """Return the joints whose origin changes, each with its new origin (4, 4)."""
    was, now = joint_frames(nominal), joint_frames(robot)
    moving = [joint.kind in MOVABLE for joint in chain]
    out: list[tuple[Joint, Array]] = []
    before, after, fixed, k = start, start, np.eye(4), 0
    last = len(moving) - 1 - moving[::-1].index(True)
    for joint, moves in zip(chain[: last + 1], moving, strict=False):
        before = before @ joint.T_parent_joint
        if not moves:
            fixed = fixed @ joint.T_parent_joint
            continue
        new = now[k] @ inverse(was[k]) @ before
        out.append((joint, inverse(after @ fixed) @ new))
        after, fixed, k = new, np.eye(4), k + 1
    behind = chain[last + 1 :]
    if behind:
        for joint in behind[:-1]:
            fixed = fixed @ joint.T_parent_joint
        out.append((behind[-1], inverse(after @ fixed) @ now[-1]))
    return out


def _set(joint: Element, origin: Array) -> None:
    item = joint.find('origin')
    if item is None:
        item = SubElement(joint, 'origin')
    item.set('xyz', numbers(origin[:3, 3]))
    item.set('rpy', numbers(roll_pitch_yaw(origin[:3, :3])))
