# Copyright 2026 weld_twin contributors
# SPDX-License-Identifier: Apache-2.0
"""
Which links of a URDF are the controller's base and its flange.

Packages of ROS-Industrial end in `tool0`, the controller's flange with z out of it, and hang `base`,
the controller's own base, beside `base_link`; REP 199 adds `flange`. Franka numbers its flange as
one link more, and arms without any such link end in their last one.

References
----------
.. [1] G. van der Hoorn, "Create a URDF for an industrial robot", ROS-Industrial tutorial:
   `base`, `base_link`, `tool0`.
.. [2] REP 199, "Coordinate frames for serial industrial manipulators".
.. [3] frankaemika/franka_description: `fr3_link8`; doosan-robotics/doosan-robot2: `link_6`;
   UniversalRobots/Universal_Robots_ROS2_Description: `base`, `flange`, `tool0`.

"""

import re
from collections.abc import Sequence
from typing import NamedTuple

import numpy as np

from weld_twin_core.arrays import Array
from weld_twin_core.errors import ModelError

from .urdf_tree import MOVABLE, Joint, Tree, inverse

BASE, FLANGE = 'controller_base', 'controller_flange'
"""Links of files of our own; a URDF that has them says what is meant."""
_BASES = (BASE, 'base')
"""What the controller's base is called, the surest name first."""
_WORLDS = ('world', 'map', 'odom', 'cell', 'ground')
"""Roots that are a place and no robot."""
APART = 1e-3
"""Distance [m] from which `tool0` is not in the flange, which is that of the maker's by definition."""
_ENDS = re.compile(
    r'ee_link|link_eef?|eef(_link)?|end_effector(_link)?|tool_mount|mounting_plate|faceplate'
    r'|mechanical_interface'
)
"""What is a flange where a tool hangs on it, and may be the tool's tip where it is the last link."""


class FixedLink(NamedTuple):
    """A link that is fixed to another, where it is in that one (4, 4), and on how many joints."""

    link: str
    T: Array
    steps: int


def foot_of(
    tree: Tree, base: str, chain: Sequence[Joint], wanted: str | None
) -> tuple[FixedLink, FixedLink]:
    """
    Return the link that the arm stands in and the controller's base, placed in the first link.

    The link that was asked for with --base-link is both.
    """
    if wanted is not None:
        return FixedLink(base, np.eye(4), 0), FixedLink(base, np.eye(4), 0)
    fixed = _fixed_to(tree, base)
    moving = [joint for joint in chain if joint.kind in MOVABLE]
    prefix = _prefix([joint.name for joint in moving])
    named = {name.removeprefix(prefix): link for name, link in fixed.items()}
    foot = fixed[moving[0].parent if base in _WORLDS and moving[0].parent in fixed else base]
    foot = named.get('base_link', foot)
    for name in _BASES:
        if name in named and not (name == 'base' and _above(tree, named, 'base', 'base_link')):
            return foot, named[name]
    return foot, foot


def flange_link_of(
    tree: Tree, chain: Sequence[Joint], tip: str, wanted: str | None
) -> tuple[str, Array]:
    """Return the link of the controller's flange, and where it is in the tip link."""
    moving = [joint for joint in chain if joint.kind in MOVABLE]
    last = moving[-1].child
    fixed = _fixed_to(tree, last, down_only=True)
    if wanted is not None:
        if wanted not in tree.links:
            raise ModelError(
                f'there is no flange link {wanted!r}; its links are {", ".join(tree.links)}'
            )
        if wanted not in fixed:
            raise ModelError(
                f'flange link {wanted!r} is not fixed to {last!r}, the last link that moves; '
                f'those fixed to it are {", ".join(fixed)}'
            )
        chosen = wanted
    else:
        behind = chain[chain.index(moving[-1]) + 1 :]
        chosen = _likeliest(fixed, [last, *(joint.child for joint in behind)])
    return chosen, inverse(fixed[tip].T) @ fixed[chosen].T


def _likeliest(fixed: dict[str, FixedLink], way: list[str]) -> str:
    """Return the link that is the flange by its name; ``way`` leads to the tip."""
    ranks = {link: _rank(link, link != way[0], link in way[:-1]) for link in fixed}
    ordered = sorted(fixed, key=lambda link: (ranks[link], link not in way, fixed[link].steps))
    first, named = ordered[0], [link for link in ordered if ranks[link] == 2]
    if ranks[first] == 1 and named:
        apart = fixed[first].T[:3, 3] - fixed[named[0]].T[:3, 3]
        # Some files call the tip of the tool tool0; the maker's lies in the flange.
        return named[0] if np.linalg.norm(apart) > APART else first
    return first


def _rank(link: str, fixed: bool, carries: bool) -> int:
    """Return how surely a link is the flange, 0 most."""
    name = link.lower()
    words = f'_{name}'
    if words.endswith(f'_{FLANGE}'):
        return 0
    if words.endswith('_tool0'):
        return 1
    if 'flange' in name:
        return 2
    if fixed and re.search(r'(^|_)link_?\d+$', name):  # a number is of the arm, not of a tool
        return 3
    return 4 if fixed and carries and re.search(rf'(^|_)({_ENDS.pattern})$', name) else 5


def _fixed_to(tree: Tree, link: str, *, down_only: bool = False) -> dict[str, FixedLink]:
    """Return all links that fixed joints hold to a link, itself first, by name."""
    out: dict[str, FixedLink] = {}
    ahead = [FixedLink(link, np.eye(4), 0)]
    while ahead:
        at = ahead.pop(0)
        if at.link in out:
            continue
        out[at.link] = at
        ahead += [
            FixedLink(joint.child, at.T @ joint.T_parent_joint, at.steps + 1)
            for joint in tree.below(at.link)
            if joint.kind == 'fixed'
        ]
        over = tree.above.get(at.link)
        if over is not None and over.kind == 'fixed' and not down_only:
            ahead.append(FixedLink(over.parent, at.T @ inverse(over.T_parent_joint), at.steps + 1))
    return out


def _above(tree: Tree, named: dict[str, FixedLink], upper: str, lower: str) -> bool:
    """Tell whether a link hangs somewhere below another: then that is a stand and no base."""
    link = named[lower].link if lower in named else ''
    while link in tree.above:
        link = tree.above[link].parent
        if link == named[upper].link:
            return True
    return False


def _prefix(names: Sequence[str]) -> str:
    """Return what all joints' names begin with, up to an underscore, as of one arm of two."""
    first, last = min(names), max(names)
    same = next((k for k, (a, b) in enumerate(zip(first, last, strict=False)) if a != b), 0)
    return first[: first[:same].rfind('_') + 1] if len(names) > 1 else ''
