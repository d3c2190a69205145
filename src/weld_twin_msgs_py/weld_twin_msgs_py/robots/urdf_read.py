# Copyright 2026 weld_twin contributors
# SPDX-License-Identifier: Apache-2.0
"""A URDF chain to an exact standard Denavit-Hartenberg robot."""

from __future__ import annotations

from dataclasses import replace
from pathlib import Path

import numpy as np

from weld_twin_core.arm.controller_frames import ControllerFrames
from weld_twin_core.arm.robot import STANDARD_GRAVITY, Robot
from weld_twin_core.arrays import Array
from weld_twin_core.errors import ModelError

from .axes_to_dh import Axis, dh_rows, inverse
from .controller_links import FLANGE, Placed, flange_link_of, foot_of
from .urdf_tree import MOVABLE, Joint, Tree, parse_tree, read_tree
from .wrong_units import refuse_wrong_units


def read_urdf(
    path: Path | str,
    base_link: str | None = None,
    tip_link: str | None = None,
    flange_link: str | None = None,
) -> Robot:
    """
    Read a URDF.

    The world frame of the robot is the base link, its tool the tip link; poses agree with the
    URDF's to rounding. Links on fixed joints, and whatever else hangs on the chain, lend their
    mass to the link that carries them.

    Parameters
    ----------
    path : Path or str
    base_link, tip_link : str, optional
        Left out: the root, and the only leaf that moves or ``tool0``. The base may also be a link
        that is fixed beside the chain, as ``base`` of a UR arm is.
    flange_link : str, optional
        Where the controller has its flange; left out, it is found by its name, see
        `controller_links`. Its base is the base link that was asked for; left out, ``base`` beside
        ``base_link``, or that, where the chain has them.

    Raises
    ------
    ModelError
        The file is no usable URDF, or the chain between the links is no serial arm.

    """
    return _of_tree(read_tree(path), path, base_link, tip_link, flange_link)


def parse_urdf(
    text: str,
    source: str,
    base_link: str | None = None,
    tip_link: str | None = None,
    flange_link: str | None = None,
) -> Robot:
    """
    Read the text of a URDF, as `/robot_description` carries it; otherwise as `read_urdf`.

    Raises
    ------
    ModelError
        The text is no usable URDF, or the chain between the links is no serial arm.

    """
    return _of_tree(parse_tree(text, source), source, base_link, tip_link, flange_link)


def chain_of(
    path: Path | str, base_link: str | None = None, tip_link: str | None = None
) -> tuple[list[Joint], Array]:
    """
    Return the joints from base to tip, fixed ones too, and where the first hangs in the base.

    Parameters
    ----------
    path, base_link, tip_link
        As for `read_urdf`.

    """
    tree = read_tree(path)
    base = _base(tree, base_link)
    tip = _tip(tree, base, tip_link)
    start, T_base_start = _start(tree, base, tip)
    return _chain(tree, start, tip), T_base_start


def _of_tree(
    tree: Tree,
    path: Path | str,
    base_link: str | None,
    tip_link: str | None,
    flange_link: str | None,
) -> Robot:
    try:
        base = _base(tree, base_link)
        tip = _tip(tree, base, tip_link)
        start, T_base_start = _start(tree, base, tip)
        chain = _chain(tree, start, tip)
        origin = foot_of(tree, base, chain, base_link)
        flange = flange_link_of(tree, chain, tip, flange_link)
        robot = _robot(tree, chain, base, T_base_start, f'URDF {Path(path).name}')
        robot = replace(robot, controller=_controller(robot, origin, flange))
        refuse_wrong_units(robot)
    except ModelError as error:
        raise ModelError(f"URDF '{path}': {error}") from None
    return robot


def _controller(
    robot: Robot, origin: tuple[Placed, Placed], flange: tuple[str, Array]
) -> ControllerFrames:
    """Return the frames of links: foot and base placed in the first, the flange in the tip."""
    (foot, base), (flange_link, T_tip) = origin, flange
    rows = inverse(robot.T_world_base)
    return ControllerFrames(
        rows @ base.T, robot.T_flange_tool @ T_tip, rows @ foot.T, base.link, flange_link
    )


def _base(tree: Tree, wanted: str | None) -> str:
    if wanted is not None:
        return _known(tree, wanted, 'base')
    if len(tree.roots) != 1:
        raise ModelError(f'there is no single root link; it has {", ".join(tree.roots) or "none"}')
    return tree.roots[0]


def _tip(tree: Tree, base: str, wanted: str | None) -> str:
    if wanted is not None:
        return _known(tree, wanted, 'tip')
    leaves = [leaf for leaf in tree.leaves if leaf != FLANGE]
    ends = [leaf for leaf in leaves if _moves(tree, leaf)] or leaves
    if len(ends) == 1:
        return ends[0]
    if 'tool0' in tree.links:
        return 'tool0'
    raise ModelError(f'the chain has several ends ({", ".join(ends)}); say which with --tip-link')


def _moves(tree: Tree, link: str) -> bool:
    """Tell whether a joint moves somewhere above a link."""
    for _ in tree.links:
        joint = tree.above.get(link)
        if joint is None or joint.kind in MOVABLE:
            return joint is not None
        link = joint.parent
    return False


def _known(tree: Tree, link: str, end: str) -> str:
    if link not in tree.links:
        raise ModelError(f'there is no {end} link {link!r}; its links are {", ".join(tree.links)}')
    return link


def _start(tree: Tree, base: str, tip: str) -> tuple[str, Array]:
    """
    Return the link above both base and tip that is fixed to the base, and where it is in the base.

    The description of a UR arm has 'base' and the arm side by side below 'base_link'.
    """
    above, link = {tip}, tip
    while link in tree.above and tree.above[link].parent not in above:
        link = tree.above[link].parent
        above.add(link)
    T_base_link, link = np.eye(4), base
    for _ in tree.links:
        if link in above:
            return link, T_base_link
        joint = tree.above.get(link)
        if joint is None or joint.kind != 'fixed':
            break
        T_base_link, link = T_base_link @ inverse(joint.T_parent_joint), joint.parent
    return base, np.eye(4)


def _chain(tree: Tree, base: str, tip: str) -> list[Joint]:
    """Return the joints from base to tip."""
    joints: list[Joint] = []
    link = tip
    while link != base:
        joint = tree.above.get(link)
        if joint is None or len(joints) > len(tree.links):
            raise ModelError(f'no chain of joints leads from {base!r} to {tip!r}')
        joints.append(joint)
        link = joint.parent
    joints.reverse()
    for joint in joints:
        if joint.kind not in MOVABLE | {'fixed'}:
            raise ModelError(f'joint {joint.name!r} is {joint.kind}; an arm cannot have that')
        if joint.mimic and joint.kind in MOVABLE:
            raise ModelError(f'joint {joint.name!r} mimics another; a serial arm cannot have that')
    if not any(joint.kind in MOVABLE for joint in joints):
        raise ModelError(f'no joint moves between {base!r} and {tip!r}')
    return joints


def _robot(tree: Tree, chain: list[Joint], base: str, T_base_start: Array, source: str) -> Robot:
    moving = [joint for joint in chain if joint.kind in MOVABLE]
    T = T_base_start
    axes: list[Axis] = []
    carried: list[list[tuple[float, Array]]] = []
    on_chain = {joint.name for joint in chain}
    for joint in chain:
        T = T @ joint.T_parent_joint
        if joint.kind in MOVABLE:
            axes.append(Axis(T[:3, :3] @ joint.axis, T[:3, 3], joint.kind == 'prismatic'))
            carried.append([])
        if carried:
            carried[-1] += _masses(tree, joint.child, T, on_chain)
    T_base_first, rows, frames = dh_rows(axes, T)
    mass, com = _merged(carried, frames)
    gravity = T_base_first[:3, :3].T @ _gravity(tree, base)
    theta, d, a, alpha, beta = np.array(rows).T
    limits = np.array([(joint.lower, joint.upper, joint.velocity) for joint in moving])
    return Robot(
        name=tree.name,
        joint_names=tuple(joint.name for joint in moving),
        theta=theta,
        d=d,
        a=a,
        alpha=alpha,
        beta=beta,
        prismatic=np.array([axis.prismatic for axis in axes]),
        lower=limits[:, 0],
        upper=limits[:, 1],
        max_velocity=limits[:, 2],
        max_acceleration=np.full(len(moving), np.inf),
        T_world_base=T_base_first,
        T_flange_tool=inverse(frames[-1]) @ T,
        mass=mass,
        com=com,
        gravity=gravity,
        source=source,
    )


def _masses(tree: Tree, link: str, T: Array, on_chain: set[str]) -> list[tuple[float, Array]]:
    """Return mass and centre in the base of a link and of all that hangs beside the chain."""
    own = tree.links[link]
    out = [(own.mass, T[:3, :3] @ own.com + T[:3, 3])]
    for joint in tree.below(link):
        if joint.name not in on_chain:
            out += _masses(tree, joint.child, T @ joint.T_parent_joint, on_chain)
    return out


def _merged(
    carried: list[list[tuple[float, Array]]], frames: list[Array]
) -> tuple[Array | None, Array | None]:
    """Return mass (n,) and centre (n, 3) in the DH end frames; None when nothing weighs."""
    mass = np.array([sum(m for m, _ in bodies) for bodies in carried])
    if not mass.any():
        return None, None
    com = np.zeros((mass.size, 3))
    for k in np.flatnonzero(mass):
        centre = sum(m * c for m, c in carried[k]) / mass[k]
        com[k] = frames[k][:3, :3].T @ (centre - frames[k][:3, 3])
    return mass, com


def _gravity(tree: Tree, base: str) -> Array:
    """Return gravity in the base link, upright in the root when only fixed joints lie between."""
    rotation, link = np.eye(3), base
    while link in tree.above:
        joint = tree.above[link]
        if joint.kind != 'fixed':
            return np.array(STANDARD_GRAVITY)
        rotation, link = joint.T_parent_joint[:3, :3] @ rotation, joint.parent
    return np.asarray(rotation.T @ np.array(STANDARD_GRAVITY))
