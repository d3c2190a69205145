# Copyright 2026 weld_twin contributors
# SPDX-License-Identifier: Apache-2.0
"""
The part of a URDF that matters here: joints, their frames, link masses; its axes as exact DH rows.

Between clearly skew axes the common normal fixes the row [1]_. Between axes that are parallel, or
nearly so (a calibrated arm's are off by fractions of a degree), the common normal runs away; there
Hayati's row is used [2]_: d is zero and a small turn beta about y takes what alpha cannot.

Links are told to be the controller's base and its flange by their names [3]_ [4]_ [5]_. Packages of
ROS-Industrial end in `tool0`, the controller's flange with z out of it, and hang `base`,
the controller's own base, beside `base_link`; REP 199 adds `flange`. Franka numbers its flange as
one link more, and arms without any such link end in their last one.

References
----------
.. [1] J. Denavit, R. S. Hartenberg, "A kinematic notation for lower-pair mechanisms based on
   matrices", J. Appl. Mech. 22, 1955.
.. [2] S. Hayati, "Robot arm geometric link parameter estimation", IEEE CDC 1983.
.. [3] G. van der Hoorn, "Create a URDF for an industrial robot", ROS-Industrial tutorial:
   `base`, `base_link`, `tool0`.
.. [4] REP 199, "Coordinate frames for serial industrial manipulators".
.. [5] frankaemika/franka_description: `fr3_link8`; doosan-robotics/doosan-robot2: `link_6`;
   UniversalRobots/Universal_Robots_ROS2_Description: `base`, `flange`, `tool0`.

"""

import re
from collections.abc import Sequence
from pathlib import Path
from typing import Any, NamedTuple
from xml.etree.ElementTree import Element, ParseError

import numpy as np
from defusedxml import DefusedXmlException
from defusedxml.ElementTree import fromstring
from urdf_parser_py import urdf
from urdf_parser_py.xml_reflection.core import Path as XmlPath

from weld_twin_core.arm.rotation import transform
from weld_twin_core.arrays import Array, readonly
from weld_twin_core.errors import DataError, ModelError

from ..files.yaml_file import read_text

_KEPT = {
    'link': {'name'},
    'joint': {'name', 'type'},
    'inertial': set(),
    'mass': {'value'},
    'origin': {'xyz', 'rpy'},
    'axis': {'xyz'},
    'parent': {'link'},
    'child': {'link'},
    'limit': {'lower', 'upper', 'effort', 'velocity'},
    'mimic': {'joint', 'multiplier', 'offset'},
}
"""Tags the reading needs and their attributes; the parser complains on stderr of any other."""
MOVABLE = {'revolute', 'continuous', 'prismatic'}
TURN = 2.0 * np.pi + 1e-3
"""A whole turn [rad], and what rounding may add."""


class Link(NamedTuple):
    """Mass [kg] and centre of mass in the link frame [m]."""

    mass: float
    com: Array


class Joint(NamedTuple):
    """One joint: where its frame sits in its parent link, and how it moves."""

    name: str
    kind: str
    parent: str
    child: str
    T_parent_joint: Array
    axis: Array
    lower: float
    upper: float
    velocity: float
    mimic: bool


CORRECTED = 'corrected by a diagnosis'
"""What a corrected robot says of itself: where a robot file has its source, and a URDF a comment."""


class Tree(NamedTuple):
    """A URDF: its name, links by name, and the joint above each link."""

    name: str
    links: dict[str, Link]
    above: dict[str, Joint]
    corrected: bool = False  # a comment says that it holds the numbers of a diagnosis

    @property
    def roots(self) -> list[str]:
        """Return the links without a joint above them."""
        return [name for name in self.links if name not in self.above]

    @property
    def leaves(self) -> list[str]:
        """Return the links without a joint below them."""
        parents = {joint.parent for joint in self.above.values()}
        return [name for name in self.links if name not in parents]

    def below(self, link: str) -> list[Joint]:
        return [joint for joint in self.above.values() if joint.parent == link]


def read_tree(path: Path | str) -> Tree:
    return parse_tree(read_text(path, 'URDF'), path)


def parse_tree(text: str, path: Path | str) -> Tree:
    """Read the text of a URDF; ``path`` says in errors where it came from."""
    try:
        root = fromstring(text, forbid_dtd=True)
    except ParseError as error:
        raise ModelError(f"URDF '{path}' is not well-formed XML: {error}") from None
    except DefusedXmlException:
        raise ModelError(
            f"URDF '{path}' has a document type or entities, which a robot needs none of; "
            'remove the <!DOCTYPE ...>'
        ) from None
    if root.tag != 'robot':
        raise ModelError(f"'{path}' is no URDF: its outermost tag is <{root.tag}>, not <robot>")
    if 'xacro' in text and any('xacro' in str(item.tag) for item in root.iter()):
        raise ModelError(f"'{path}' is a xacro file; run 'xacro {path}' to make the URDF of it")
    try:
        out = Element('robot', {'name': root.get('name', 'robot')})
        out.extend(_kept(item) for item in root if item.tag in ('link', 'joint'))
        model = urdf.URDF.from_xml(out, XmlPath('robot'))
        return _tree(model)._replace(corrected=CORRECTED in text)
    except (ModelError, DataError) as error:
        raise ModelError(f"URDF '{path}': {error}") from None
    except Exception as error:  # the parser raises bare Exception and AssertionError
        raise ModelError(f"URDF '{path}': {' '.join(str(error).split())}") from None


def _kept(item: Element) -> Element:
    known = _KEPT[item.tag]
    out = Element(item.tag, {key: value for key, value in item.attrib.items() if key in known})
    if item.tag == 'limit':  # the parser insists on both, hand-written files often have neither
        out.attrib = {'effort': '0', 'velocity': '0'} | out.attrib
    out.extend(_kept(child) for child in item if child.tag in _KEPT)
    return out


def _tree(model: Any) -> Tree:
    links = {link.name: _link(link) for link in model.links}
    above: dict[str, Joint] = {}
    for item in model.joints:
        joint = _joint(item)
        for end in (joint.parent, joint.child):
            if end not in links:
                raise ModelError(f'joint {joint.name!r} names a link {end!r} that is not there')
        if joint.child in above:
            raise ModelError(f'link {joint.child!r} hangs on two joints; a chain needs one')
        above[joint.child] = joint
    if not links:
        raise ModelError('there is no link in it')
    return Tree(model.name, links, above)


def _link(link: Any) -> Link:
    inertial = link.inertial
    if inertial is None or not inertial.mass:
        return Link(0.0, np.zeros(3))
    com = _frame(inertial.origin, f'inertial of link {link.name!r}')[:3, 3]
    return Link(float(inertial.mass), com)


def _joint(item: Any) -> Joint:
    where = f'joint {item.name!r}'
    axis = readonly((1.0, 0.0, 0.0) if item.axis is None else item.axis, (3,), f'axis of {where}')
    length = float(np.linalg.norm(axis))
    if item.type in MOVABLE and length < 1e-6:
        raise ModelError(f'the axis of {where} has no direction')
    lower, upper, velocity = _limits(item)
    return Joint(
        item.name,
        item.type,
        item.parent,
        item.child,
        _frame(item.origin, where),
        axis / max(length, 1e-300),
        lower,
        upper,
        velocity,
        item.mimic is not None,
    )


def _limits(item: Any) -> tuple[float, float, float]:
    """Return limits; equal ones (the default of an absent attribute) count as not given."""
    limit = item.limit
    if limit is None:
        return -np.inf, np.inf, np.inf
    lower, upper = float(limit.lower or 0.0), float(limit.upper or 0.0)
    if item.type == 'continuous' or lower == upper:
        lower, upper = -np.inf, np.inf
    return lower, upper, float(limit.velocity or np.inf)


def _frame(origin: Any, where: str) -> Array:
    if origin is None:
        return np.eye(4)
    xyz = readonly(origin.xyz or (0.0, 0.0, 0.0), (3,), f'origin xyz of {where}')
    roll, pitch, yaw = rpy = readonly(origin.rpy or (0.0,) * 3, (3,), f'origin rpy of {where}')
    if abs(rpy).max() > TURN:
        far = f'{rpy[abs(rpy).argmax()]:.6g}'
        raise ModelError(
            f'origin rpy of {where} is {far}, which looks like degrees in a radian field'
        )
    return transform(turn(2, yaw) @ turn(1, pitch) @ turn(0, roll), xyz)


def turn(axis: int, angle: float) -> Array:
    """Return the rotation (3, 3) about a coordinate axis [rad]."""
    c, s = np.cos(angle), np.sin(angle)
    out = np.eye(3)
    i, j = (axis + 1) % 3, (axis + 2) % 3
    out[i, i], out[j, j], out[i, j], out[j, i] = c, c, -s, s
    return out


NEARLY_PARALLEL = 0.05
"""Sine of the angle between axes below which the row is Hayati's."""
ROUNDING = 1e-14
"""Numbers below this are left over from rounding [m or rad]."""


class Axis(NamedTuple):
    """A joint axis at joint position zero, in the base: unit direction and a point on it [m]."""

    direction: Array
    point: Array
    prismatic: bool = False


class Row(NamedTuple):
    """One row: Rz(theta) Tz(d) Tx(a) Rx(alpha) Ry(beta) [rad, m]."""

    theta: float
    d: float
    a: float
    alpha: float
    beta: float

    def matrix(self) -> Array:
        """Return the transform of the row at joint position zero, shape (4, 4)."""
        rotation = turn(2, self.theta)
        position = np.array([0.0, 0.0, self.d]) + self.a * rotation[:, 0]
        return transform(rotation @ turn(0, self.alpha) @ turn(1, self.beta), position)


def dh_rows(axes: list[Axis], T_base_tip: Array) -> tuple[Array, list[Row], list[Array]]:
    """
    Return the first frame, the rows of a chain of axes, and the frame at the end of each.

    All are in the base, at joint position zero, where the tip is ``T_base_tip``.
    """
    first = _first_frame(axes[0])
    frame, rows, frames = first, [], []
    for k in range(len(axes)):
        if k + 1 < len(axes):
            u = frame[:3, :3].T @ axes[k + 1].direction
            p = frame[:3, :3].T @ (axes[k + 1].point - frame[:3, 3])
            row = _row_to_axis(u, p)
        else:
            row = _last_row(inverse(frame) @ T_base_tip)
        row = Row(*(0.0 if abs(value) < ROUNDING else float(value) for value in row))
        frame = frame @ row.matrix()
        rows.append(row)
        frames.append(frame)
    return first, rows, frames


def inverse(T: Array) -> Array:
    """Return the inverse of a homogeneous transform, shape (4, 4)."""
    rotation = T[:3, :3].T
    return transform(rotation, -rotation @ T[:3, 3])


def _first_frame(axis: Axis) -> Array:
    """Return the frame on the first axis that lies closest to the base link."""
    z = axis.direction
    x = np.eye(3)[0] - z[0] * z
    if np.linalg.norm(x) < 0.1:
        x = np.eye(3)[1] - z[1] * z
    x = x / np.linalg.norm(x)
    point = axis.point if axis.prismatic else axis.point - (axis.point @ z) * z
    return transform(np.stack([x, np.cross(z, x), z], axis=1), point)


def _row_to_axis(u: Array, p: Array) -> Row:
    """Return the row from the z axis to the line through p along u, all in the local frame."""
    sine = float(np.hypot(u[0], u[1]))
    if sine < NEARLY_PARALLEL:
        return _hayati_row(u, p)
    normal = np.array([-u[1], u[0], 0.0]) / sine
    sign = -1.0 if normal[0] < -ROUNDING else 1.0  # keep x as near to the last x as it can be
    d = p[2] - (p[0] * u[0] + p[1] * u[1]) * u[2] / sine**2
    theta = np.arctan2(sign * normal[1], sign * normal[0])
    return Row(theta, d, sign * float(p @ normal), sign * np.arctan2(sine, u[2]), 0.0)


def _hayati_row(u: Array, p: Array) -> Row:
    crossing = p - u * (p[2] / u[2])
    a = float(np.hypot(crossing[0], crossing[1]))
    theta = 0.0
    if a > ROUNDING:
        a = -a if crossing[0] < -ROUNDING else a
        theta = float(np.arctan2(crossing[1] / a, crossing[0] / a))
    turned = turn(2, theta).T @ u
    return Row(theta, 0.0, a, np.arctan2(-turned[1], turned[2]), np.arcsin(turned[0]))


def _last_row(T: Array) -> Row:
    """Return the row that ends beside the tip; the tool frame takes what is left."""
    x, y = T[0, 0], T[1, 0]
    theta = np.arctan2(y, x) if np.hypot(x, y) > 0.1 else 0.0
    return Row(theta, T[2, 3], 0.0, 0.0, 0.0)


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
