# Copyright 2026 weld_twin contributors
# SPDX-License-Identifier: Apache-2.0
"""A URDF chain to an exact standard Denavit-Hartenberg robot; numbers in wrong units are refused."""

from collections.abc import Sequence
from dataclasses import replace
from pathlib import Path
from typing import NamedTuple

import numpy as np

from weld_twin_core.arm.controller_frames import ControllerFrames
from weld_twin_core.arm.robot import STANDARD_GRAVITY, Robot
from weld_twin_core.arrays import Array
from weld_twin_core.errors import ModelError

from ..files.yaml_file import read_text
from .urdf_tree import (
    CORRECTED,
    FLANGE,
    MOVABLE,
    TURN,
    Axis,
    FixedLink,
    Joint,
    Tree,
    dh_rows,
    flange_link_of,
    foot_of,
    inverse,
    parse_tree,
    read_tree,
)

_MANY_TURNS = 60.0
"""Joint limits beyond this [rad] are degrees: no arm turns ten times."""
_LONG = 20.0
"""Lengths of an arm beyond this [m] are millimetres."""
_LIGHTEST, _HEAVIEST = 9.5, 10.1
"""Gravity on earth [m/s^2] is 9.76 to 9.83; people round it to 9.8, and to 10."""


def read_urdf(
    path: Path | str,
    base_link: str | None = None,
    tip_link: str | None = None,
    flange_link: str | None = None,
) -> Robot:
    """
    Read a URDF.

    The world frame of the robot is the base link, its tool the tip link; poses agree with the
    URDF's to rounding. Where joints of a positioner lie between the base link and the link that
    both branches hang on, the chain leads up one branch and down the other. Links on fixed joints,
    and whatever else hangs on the chain, lend their mass to the link that carries them.

    Parameters
    ----------
    base_link, tip_link : str, optional
        Left out: the root, and the only leaf that moves or ``tool0``. The base may also be a link
        that is fixed beside the chain, as ``base`` of a UR arm is, or the table of a positioner.
    flange_link : str, optional
        Where the controller has its flange; left out, it is found by its name, see
        `controller_links`. Its base is the base link that was asked for; left out, ``base`` beside
        ``base_link``, or that, where the chain has them.

    Raises
    ------
    ModelError
        The file is no usable URDF, or the chain between the links is no serial arm.

    """
    return parse_urdf(read_text(path, 'URDF'), path, base_link, tip_link, flange_link)


def parse_urdf(
    text: str,
    source: Path | str,
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
    tree = parse_tree(text, source)
    try:
        base = _base(tree, base_link)
        tip = _tip(tree, base, tip_link)
        chain = _chain(tree, base, tip)
        root = chain.down[0].parent if chain.up else base
        robot = _robot(tree, chain.down, _gravity(tree, root), chain.start, source)
        origin = foot_of(tree, root, chain.down, None if chain.up else base_link)
        flange = flange_link_of(tree, chain.down, tip, flange_link)
        robot = replace(robot, controller=_controller(robot, origin, flange))
        if chain.up:
            gravity = _gravity(tree, chain.up[0].parent)
            cell = robot.behind_workpiece(_robot(tree, chain.up, gravity, np.eye(4), source))
            assert robot.controller is not None
            # What people call the base is the link that was asked for: the table.
            table = replace(robot.controller, foot=inverse(cell.T_world_base))
            robot = replace(cell, controller=table)
        refuse_wrong_units(robot)
    except ModelError as error:
        raise ModelError(f"URDF '{source}': {error}") from None
    return robot


class Chain(NamedTuple):
    """The joints from base to tip, fixed ones too."""

    up: list[Joint]
    """Those of a positioner, from its foot to the base link; empty for a robot alone."""
    down: list[Joint]  # those of the robot, from the link that both hang on to the tip
    start: Array
    """That link in the frame of reference: the base link, or itself beside a positioner, shape (4,
    4)."""


def chain_of(path: Path | str, base_link: str | None = None, tip_link: str | None = None) -> Chain:
    tree = read_tree(path)
    base = _base(tree, base_link)
    return _chain(tree, base, _tip(tree, base, tip_link))


def _controller(
    robot: Robot, origin: tuple[FixedLink, FixedLink], flange: tuple[str, Array]
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


def _chain(tree: Tree, base: str, tip: str) -> Chain:
    """
    Return the joints from base to tip, up to the link that both hang on and down from it.

    The description of a UR arm has 'base' and the arm side by side below 'base_link'; joints that
    are fixed on the way up only say where the base is.
    """
    down, up = _to_root(tree, tip), _to_root(tree, base)
    while down and up and down[-1] is up[-1]:
        down.pop()
        up.pop()
    if (down[-1].parent if down else tip) != (up[-1].parent if up else base):
        raise ModelError(f'no chain of joints leads from {base!r} to {tip!r}')
    down.reverse()
    up.reverse()
    _refuse_unfit([*up, *down])
    climbs, moves = (any(j.kind in MOVABLE for j in joints) for joints in (up, down))
    if climbs and not moves:
        raise ModelError(f'no joint moves between {tip!r} and the foot of {base!r}; swap the two')
    if not moves:
        raise ModelError(f'no joint moves between {base!r} and {tip!r}')
    if climbs:
        return Chain(up, down, np.eye(4))
    T_start_base = np.eye(4)
    for joint in up:
        T_start_base = T_start_base @ joint.T_parent_joint
    return Chain([], down, inverse(T_start_base))


def _refuse_unfit(joints: list[Joint]) -> None:
    for joint in joints:
        if joint.kind not in MOVABLE | {'fixed'}:
            raise ModelError(f'joint {joint.name!r} is {joint.kind}; an arm cannot have that')
        if joint.mimic and joint.kind in MOVABLE:
            raise ModelError(f'joint {joint.name!r} mimics another; a serial arm cannot have that')


def _to_root(tree: Tree, link: str) -> list[Joint]:
    """Return the joints above a link, the nearest first."""
    out: list[Joint] = []
    while link in tree.above:
        out.append(tree.above[link])
        link = out[-1].parent
        if len(out) > len(tree.links):
            raise ModelError(f'no chain of joints leads to {link!r}: they go round in a circle')
    return out


def _robot(
    tree: Tree, chain: list[Joint], gravity: Array, start: Array, path: Path | str
) -> Robot:
    """Return a robot of the joints of one branch; gravity is in the link where they start."""
    moving = [joint for joint in chain if joint.kind in MOVABLE]
    T = start
    axes: list[Axis] = []
    loads: list[list[tuple[float, Array]]] = []
    on_chain = {joint.name for joint in chain}
    for joint in chain:
        T = T @ joint.T_parent_joint
        if joint.kind in MOVABLE:
            axes.append(Axis(T[:3, :3] @ joint.axis, T[:3, 3], joint.kind == 'prismatic'))
            loads.append([])
        if loads:
            loads[-1] += _masses(tree, joint.child, T, on_chain)
    T_base_first, rows, frames = dh_rows(axes, T)
    mass, com = _merged(loads, frames)
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
        gravity=T_base_first[:3, :3].T @ gravity,
        source=f'URDF {Path(path).name}' + (f'; {CORRECTED}' if tree.corrected else ''),
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
    loads: list[list[tuple[float, Array]]], frames: list[Array]
) -> tuple[Array | None, Array | None]:
    """Return mass (n,) and centre (n, 3) in the DH end frames; None when nothing weighs."""
    mass = np.array([sum(m for m, _ in bodies) for bodies in loads])
    if not mass.any():
        return None, None
    com = np.zeros((mass.size, 3))
    for k in np.flatnonzero(mass):
        centre = sum(m * c for m, c in loads[k]) / mass[k]
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


def refuse_wrong_units(robot: Robot) -> None:
    """Refuse a robot whose numbers look like degrees or millimetres."""
    names, turning = robot.joint_names, ~robot.prismatic
    for key in ('alpha', 'theta', 'beta'):
        _check(names, getattr(robot, key), TURN, key, 'degrees in a radian field')
    for key in ('a', 'd'):
        _check(names, getattr(robot, key), _LONG, key, 'millimetres in a metre field')
    for key in ('lower', 'upper'):
        values = np.where(turning & np.isfinite(getattr(robot, key)), getattr(robot, key), 0.0)
        _check(names, values, _MANY_TURNS, key, 'degrees in a radian field')
    if robot.com is not None:
        _check(names, abs(robot.com).max(axis=1), _LONG, 'com', 'millimetres in a metre field')
    places = {
        'tool': robot.T_flange_tool[:3, 3],
        "the payload's com": robot.payload_com,
        **({} if robot.controller is None else {'flange': robot.controller.flange[:3, 3]}),
    }
    for key, place in places.items():
        if abs(place).max() > _LONG:
            far = f'{abs(place).max():.6g}'
            raise ModelError(f'{key} is {far} away, which looks like millimetres in a metre field')
    pull = float(np.linalg.norm(robot.gravity))
    if pull and not _LIGHTEST < pull < _HEAVIEST:
        raise ModelError(f'gravity is {pull:.6g}; it is in m/s^2, 9.81 on earth, or 0 for none')


def _check(names: Sequence[str], values: Array, limit: float, key: str, what: str) -> None:
    if (abs(values) > limit).any():
        k = int(np.argmax(abs(values) > limit))
        raise ModelError(f'joint {names[k]!r}: {key} is {values[k]:.6g}, which looks like {what}')
