# Copyright 2026 weld_twin contributors
# SPDX-License-Identifier: Apache-2.0
"""
Arms drawn at random, told to the product as a URDF and to the plant as rows.

The arm is placed by the plant's screws at a posture that the URDF calls zero. Its joints get the
signs, frames and link names of a maker's URDFs there; no formula is shared with what reads them.
"""

from __future__ import annotations

from dataclasses import dataclass
from typing import Any, NamedTuple

import numpy as np
from scipy.spatial.transform import Rotation

from ..plant import exponentials, screws
from .plain_arm import ScrewArm, about, along

KINDS = ('up', 'down', 'sideways')
"""Where the first axis points in the base link."""
MAKERS = ('kuka', 'abb', 'fanuc', 'ur', 'comau', 'franka', 'yaskawa')
"""Whose names of links a URDF has."""
HANDS = {
    'kuka': ('link_6', ('tool0',), 'tool0'),
    'abb': ('link_6', ('flange', 'tool0'), 'tool0'),
    'fanuc': ('link_6', ('tool0',), 'tool0'),
    'ur': ('wrist_3_link', ('flange', 'tool0'), 'tool0'),
    'comau': ('link_6', (), 'link_6'),
    'franka': ('arm_link6', ('arm_link7',), 'arm_link7'),
    'yaskawa': ('link_6_t', ('flange',), 'flange'),
}
"""Last link that moves, links fixed to it one after the other, and the controller's flange."""
GRAVITY = 9.80665
"""Standard gravity [m/s^2]."""
RANGE = 2.8
"""Half the range of every joint [rad]."""


@dataclass(frozen=True, eq=False)
class DrawnArm:
    """
    One arm.

    Attributes
    ----------
    number : int
    kind, maker, root : str
        Of `KINDS` and `MAKERS`; 'base_link', or 'world' with the base link turned in it.
    plant : dict
        A robot file for the plant: base in the controller's base, no tool.
    sign, zero : array, shape (6,)
        Joints of the plant are sign * joints of the URDF + zero [rad].
    controller : ScrewArm
        The arm as its controller knows it: from its base to its flange, the torch on that.
    urdf : str
    options : list of str
        How the product is told base and tip.

    """

    number: int
    kind: str
    maker: str
    root: str
    plant: dict[str, Any]
    sign: np.ndarray
    zero: np.ndarray
    controller: ScrewArm
    urdf: str
    options: list[str]

    def of_plant(self, q: np.ndarray) -> np.ndarray:
        """Return joints of the plant, shape (N, 6), from those of the URDF."""
        return np.asarray(q * self.sign + self.zero)


def drawn_arm(seed: int, number: int) -> DrawnArm:
    """
    Return an arm.

    Parameters
    ----------
    seed, number : int
        Decide everything random in it.

    """
    rng = np.random.default_rng([seed, number, 51])
    kind, maker = KINDS[number % 3], MAKERS[number % 7]
    names = [f'{"joint_a" if maker == "kuka" else "joint_"}{k + 1}' for k in range(6)]
    plant = _rows(rng, names, maker == 'ur')
    sign = rng.choice([-1.0, 1.0], 6)
    stand = _stand(rng, kind, maker)
    if kind != 'sideways':
        sign[0] = 1.0 if kind == 'up' else -1.0
    down = stand.upright.T @ [0.0, 0.0, -GRAVITY]
    plant['gravity'] = (stand.column[:3, :3].T @ down).tolist()
    foot = np.linalg.inv(stand.origin) @ stand.column
    plant['base'] = _entry(foot)
    zero = 0.5 * np.pi * np.round(rng.uniform(-1.0, 1.0, 6)) * (np.arange(6) > 0)
    links = _links(plant, zero)
    torch = along(0, rng.uniform(-0.1, 0.1)) @ along(2, rng.uniform(0.2, 0.4))
    torch = torch @ about(1, rng.uniform(-0.8, 0.8)) @ about(2, rng.uniform(-3.0, 3.0))
    hand = np.eye(4)
    hand[:3, :3], hand[:3, 3] = links[-1].rotation @ _cube(rng), links[-1].position
    axes = [(sign[k] * axis, point) for k, (axis, point) in enumerate(_axes(plant, zero))]
    controller = ScrewArm(
        f'arm {number}',
        np.array([foot[:3, :3] @ axis for axis, _ in axes]),
        np.array([foot[:3, :3] @ point + foot[:3, 3] for _, point in axes]),
        foot @ hand,
        torch,
    )
    urdf = _urdf(rng, f'drawn_{number}', maker, stand, (plant, axes, links), (hand, torch))
    options = [*(['--base-link', 'base_link'] if stand.told else []), '--tip-link', 'tcp']
    return DrawnArm(number, kind, maker, stand.root, plant, sign, zero, controller, urdf, options)


class _Stand(NamedTuple):
    """
    How an arm stands.

    ``column`` is the arm's column in the base link, ``upright`` turns the base link in the root,
    whose z is up; ``beside`` is ROS-Industrial's link `base`, and ``told`` that the user names the
    base link.
    """

    column: np.ndarray
    root: str
    upright: np.ndarray
    beside: np.ndarray | None
    told: bool

    @property
    def origin(self) -> np.ndarray:
        """Return the controller's base in the base link, shape (4, 4)."""
        return np.eye(4) if self.told or self.beside is None else self.beside


def _stand(rng: np.random.Generator, kind: str, maker: str) -> _Stand:
    column = np.eye(4)
    column[:3, :3] = _column(rng, kind)
    root = 'world' if rng.random() < 0.5 else 'base_link'
    upright = np.eye(3) if root == 'base_link' else Rotation.random(random_state=rng).as_matrix()
    return _Stand(column, root, upright, _beside(rng, maker), bool(rng.random() < 0.6))


def _rows(rng: np.random.Generator, names: list[str], ur: bool) -> dict[str, Any]:
    """Return a robot file for the plant: an arm with a spherical wrist, or one of UR's kind."""
    q = 0.5 * np.pi
    upper, fore = rng.uniform(0.4, 1.1, 2)
    if ur:
        a = [0.0, -upper, -fore, 0.0, 0.0, 0.0]
        d = [rng.uniform(0.1, 0.2), 0.0, 0.0, *rng.uniform(0.08, 0.16, 3)]
        alpha, theta = [q, 0.0, 0.0, q, -q, 0.0], [0.0] * 6
    else:
        a = [rng.uniform(0.0, 0.35), upper, rng.uniform(-0.1, 0.2), 0.0, 0.0, 0.0]
        d = [rng.uniform(0.3, 0.7), 0.0, 0.0, fore, 0.0, rng.uniform(0.08, 0.2)]
        alpha, theta = [-q, 0.0, -q, q, -q, 0.0], [0.0, -q, 0.0, 0.0, 0.0, 0.0]
    weight = 60.0 * (upper + fore) ** 2
    shares = np.array([0.4, 0.3, 0.2, 0.06, 0.03, 0.01])
    links = [
        {'mass': float(weight * share), 'com': [-0.4 * float(a[k]), 0.0, 0.02]}
        for k, share in enumerate(shares)
    ]
    joints = [
        {'name': name, 'a': a[k], 'd': d[k], 'alpha': alpha[k], 'theta_offset': theta[k]}
        for k, name in enumerate(names)
    ]
    return {'name': 'drawn', 'joints': joints, 'links': links}


def _column(rng: np.random.Generator, kind: str) -> np.ndarray:
    """Return the axes of the arm's column in the base link: its z leads from the foot up the arm."""
    yaw = about(2, rng.uniform(-np.pi, np.pi))[:3, :3]
    if kind != 'sideways':
        return yaw
    side = about(int(rng.integers(2)), float(rng.choice([-1.0, 1.0])) * 0.5 * np.pi)[:3, :3]
    return np.asarray(side @ yaw)


def _beside(rng: np.random.Generator, maker: str) -> np.ndarray | None:
    """Return where ROS-Industrial's link `base` is in the base link, for makers that have one."""
    if maker == 'ur':
        return about(2, np.pi)
    return along(2, rng.uniform(0.2, 0.5)) if maker == 'fanuc' else None


def _cube(rng: np.random.Generator) -> np.ndarray:
    """Return one of the turns that lead axes to axes, as flanges are drawn in URDFs."""
    return np.asarray(Rotation.create_group('O').as_matrix()[int(rng.integers(24))])


def _before(plant: dict[str, Any], zero: np.ndarray) -> list[screws.Motion]:
    """Return what the joints do at the URDF's zero, up to each of them and up to the end."""
    arm = exponentials.arm_from(plant)
    at, out = exponentials.home(arm), [screws.identity()]
    for k in range(6):
        out.append(screws.compose(out[-1], screws.exp_screw(at.omega[k], at.v[k], zero[k])))
    return out


def _axes(plant: dict[str, Any], zero: np.ndarray) -> list[tuple[np.ndarray, np.ndarray]]:
    """Return direction and a point of every axis at the URDF's zero, in the column."""
    at, before = exponentials.home(exponentials.arm_from(plant)), _before(plant, zero)
    return [
        (b.rotation @ axis, b.rotation @ point + b.position)
        for b, axis, point in zip(before, at.omega, at.point, strict=False)
    ]


def _links(plant: dict[str, Any], zero: np.ndarray) -> list[screws.Motion]:
    """Return the ends of the rows at the URDF's zero, in the column."""
    at, before = exponentials.home(exponentials.arm_from(plant)), _before(plant, zero)
    return [screws.compose(b, link) for b, link in zip(before[1:], at.links, strict=True)]


def _entry(T: np.ndarray) -> dict[str, list[float]]:
    turn = Rotation.from_matrix(T[:3, :3]).as_quat().tolist()
    return {'xyz': T[:3, 3].tolist(), 'quat_xyzw': turn}


def _urdf(
    rng: np.random.Generator,
    name: str,
    maker: str,
    stand: _Stand,
    arm: tuple[Any, list[tuple[np.ndarray, np.ndarray]], list[screws.Motion]],
    hand: tuple[np.ndarray, np.ndarray],
) -> str:
    """Return the URDF: frames of links as a maker draws them, masses where the plant has them."""
    out = [f'<robot name="{name}">', '<link name="base_link"/>']
    if stand.root == 'world':
        turned = np.eye(4)
        turned[:3, :3], turned[:3, 3] = stand.upright, rng.uniform(-1.0, 1.0, 3)
        out += ['<link name="world"/>', _joint('stand', 'world', 'base_link', turned)]
    if stand.beside is not None:
        out += ['<link name="base"/>', _joint('base_fixed', 'base_link', 'base', stand.beside)]
    (plant, axes, links), (flange, torch) = arm, (stand.column @ hand[0], hand[1])
    last, fixed, named = HANDS[maker]
    prefix = 'arm_link' if maker == 'franka' else 'link_'
    children = [*(f'{prefix}{k + 1}' for k in range(5)), last]
    frames = _frames(rng, stand.column, axes, flange if last == named else None)
    parent, at = 'base_link', np.eye(4)
    for k, (child, frame) in enumerate(zip(children, frames, strict=True)):
        axis = frame[:3, :3].T @ (stand.column[:3, :3] @ axes[k][0])
        joint = plant['joints'][k]['name']
        out.append(_joint(joint, parent, child, np.linalg.inv(at) @ frame, axis))
        com = screws_point(links[k], plant['links'][k]['com'])
        com = np.linalg.inv(frame) @ stand.column @ [*com, 1.0]
        out.append(_link(child, plant['links'][k]['mass'], com[:3]))
        parent, at = child, frame
    for link in fixed:
        frame = flange if link == named else flange @ about(1, -0.5 * np.pi)
        out += [
            f'<link name="{link}"/>',
            _joint(f'{link}_fixed', parent, link, np.linalg.inv(at) @ frame),
        ]
        parent, at = link, frame
    out += ['<link name="tcp"/>', _joint('torch', parent, 'tcp', torch), '</robot>']
    return '\n'.join(out) + '\n'


def _frames(
    rng: np.random.Generator,
    column: np.ndarray,
    axes: list[tuple[np.ndarray, np.ndarray]],
    last: np.ndarray | None,
) -> list[np.ndarray]:
    """Return the joints' frames in the base link; ``last`` is that of the last one if it is fixed."""
    along_axes = bool(rng.random() < 0.5)
    out = [_frame(rng, column, axis, point, along_axes) for axis, point in axes]
    return out if last is None else [*out[:-1], last]


def screws_point(motion: screws.Motion, point: list[float]) -> np.ndarray:
    """Return a point moved by a motion."""
    return np.asarray(motion.rotation @ np.array(point) + motion.position)


def _frame(
    rng: np.random.Generator,
    column: np.ndarray,
    axis: np.ndarray,
    point: np.ndarray,
    along_axes: bool,
) -> np.ndarray:
    """Return a joint's frame in the base link: z along its axis, or the axes of the column."""
    out = np.eye(4)
    out[:3, :3] = column[:3, :3]
    if along_axes:
        aside = np.eye(3)[int(np.argmin(np.abs(axis)))]
        x = np.cross(aside, axis) / np.linalg.norm(np.cross(aside, axis))
        out[:3, :3] = column[:3, :3] @ np.stack([x, np.cross(axis, x), axis], axis=1)
    out[:3, 3] = column[:3, :3] @ (point + rng.uniform(-0.1, 0.1) * axis) + column[:3, 3]
    return out


def _joint(
    name: str, parent: str, child: str, T: np.ndarray, axis: np.ndarray | None = None
) -> str:
    rpy = _roll_pitch_yaw(T[:3, :3])
    kind, moves = ('fixed', '') if axis is None else ('revolute', _moves(axis))
    return (
        f'<joint name="{name}" type="{kind}"><parent link="{parent}"/><child link="{child}"/>'
        f'<origin xyz="{_text(T[:3, 3])}" rpy="{_text(rpy)}"/>{moves}</joint>'
    )


def _roll_pitch_yaw(rotation: np.ndarray) -> np.ndarray:
    """Return turns about the fixed x, y and z; where pitch is a right angle, yaw is none."""
    pitch = np.arctan2(-rotation[2, 0], np.hypot(rotation[0, 0], rotation[1, 0]))
    yaw = np.arctan2(rotation[1, 0], rotation[0, 0]) if abs(np.cos(pitch)) > 1e-6 else 0.0
    flat = about(2, -yaw)[:3, :3] @ rotation
    rest = about(1, -pitch)[:3, :3] @ flat
    return np.array([np.arctan2(rest[2, 1], rest[1, 1]), pitch, yaw])


def _moves(axis: np.ndarray) -> str:
    return (
        f'<axis xyz="{_text(axis)}"/>'
        f'<limit lower="{-RANGE}" upper="{RANGE}" effort="1" velocity="2"/>'
    )


def _link(name: str, mass: float, com: np.ndarray) -> str:
    zeros = ' '.join(f'{key}="1"' for key in ('ixx', 'iyy', 'izz'))
    zeros += ' ' + ' '.join(f'{key}="0"' for key in ('ixy', 'ixz', 'iyz'))
    return (
        f'<link name="{name}"><inertial><origin xyz="{_text(com)}"/><mass value="{mass!r}"/>'
        f'<inertia {zeros}/></inertial></link>'
    )


def _text(values: np.ndarray) -> str:
    return ' '.join(repr(float(v)) for v in values)
