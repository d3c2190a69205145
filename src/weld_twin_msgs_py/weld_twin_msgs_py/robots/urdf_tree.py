# Copyright 2026 weld_twin contributors
# SPDX-License-Identifier: Apache-2.0
"""
The part of a URDF that matters here: joints, their frames, link masses; its axes as exact DH rows.

Between clearly skew axes the common normal fixes the row [1]_. Between axes that are parallel, or
nearly so (a calibrated arm's are off by fractions of a degree), the common normal runs away; there
Hayati's row is used [2]_: d is zero and a small turn beta about y takes what alpha cannot.

References
----------
.. [1] J. Denavit, R. S. Hartenberg, "A kinematic notation for lower-pair mechanisms based on
   matrices", J. Appl. Mech. 22, 1955.
.. [2] S. Hayati, "Robot arm geometric link parameter estimation", IEEE CDC 1983.

"""

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
        model = urdf.URDF.from_xml(_pruned(root), XmlPath('robot'))
        return _tree(model)._replace(corrected=CORRECTED in text)
    except (ModelError, DataError) as error:
        raise ModelError(f"URDF '{path}': {error}") from None
    except Exception as error:  # the parser raises bare Exception and AssertionError
        raise ModelError(f"URDF '{path}': {' '.join(str(error).split())}") from None


def _pruned(root: Element) -> Element:
    out = Element('robot', {'name': root.get('name', 'robot')})
    out.extend(_kept(item) for item in root if item.tag in ('link', 'joint'))
    return out


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
