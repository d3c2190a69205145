# Copyright 2026 weld_twin contributors
# SPDX-License-Identifier: Apache-2.0
"""
A plain controller that knows no error, and readers of programs that share nothing with the package.

The readers are short, as they know only the forms that the programs of tests and studies have. Each
takes the texts of a program's files and returns its moves: the word, and the places, each a pose
(4, 4) [m] or joint positions (n,) [rad] of the robot's model. The controller takes moves, and gives
joint positions over time.
"""

from __future__ import annotations

import csv
import re
from collections.abc import Sequence
from typing import Any, NamedTuple

import numpy as np
import yaml
from scipy.spatial.transform import Rotation

from weld_twin_core.arm.robot import Robot

Lengths = np.ndarray | float
STILL = np.eye(4)
"""Pose of what has neither moved nor turned."""
CLOSED, REACHED = 1e-11, 1e-7
"""Gap [m, rad] at which there is no further round, and up to which a pose counts as reached."""
ROUNDS = 50
"""Most rounds of Newton; from one place to the next it takes three."""
LONGEST = 0.3
"""Most that any joint turns in a round [rad]: farther away the tangent tells nothing."""


def along(axis: int, length: Lengths) -> np.ndarray:
    """Return shifts along an axis, shape (..., 4, 4)."""
    out = _still(length)
    out[..., axis, 3] = length
    return out


def about(axis: int, angle: Lengths) -> np.ndarray:
    """Return turns about an axis, shape (..., 4, 4)."""
    out = _still(angle)
    one, two = (axis + 1) % 3, (axis + 2) % 3
    out[..., one, one] = out[..., two, two] = np.cos(angle)
    out[..., two, one] = np.sin(angle)
    out[..., one, two] = -out[..., two, one]
    return out


def _still(values: Lengths) -> np.ndarray:
    out = np.empty((*np.shape(values), 4, 4))
    out[...] = STILL
    return out


def tool_pose(
    robot: Robot, q: np.ndarray, tool: np.ndarray, offsets: np.ndarray | float = 0.0
) -> np.ndarray:
    """
    Return the poses of the tool at joints (..., n), shape (..., 4, 4).

    offsets: how much further each joint really stands, shape (n,) or of the joints.
    """
    return np.asarray(_frames(robot, q + offsets)[-1] @ tool)


def _frames(robot: Robot, q: np.ndarray) -> list[np.ndarray]:
    """Return the frame that each joint turns in, and the last frame, each of shape (..., 4, 4)."""
    angles = np.moveaxis(robot.theta + q, -1, 0)
    at, out = _still(angles[0]), []
    rows = zip(robot.a, robot.alpha, robot.d, angles, strict=True)
    for a, alpha, d, theta in rows:
        if robot.convention == 'standard':
            out.append(at)
            at = at @ about(2, theta) @ along(2, d) @ along(0, a) @ about(0, alpha)
        else:
            out.append(at @ about(0, alpha) @ along(0, a))
            at = out[-1] @ about(2, theta) @ along(2, d)
    return [*out, at]


def joints_for(robot: Robot, pose: np.ndarray, tool: np.ndarray, near: np.ndarray) -> np.ndarray:
    """Return what a controller, which knows no error, makes of a pose."""
    q = np.array(near, dtype=float)
    for _ in range(ROUNDS):
        *axes, last = _frames(robot, q)
        got = last @ tool
        turn = Rotation.from_matrix(pose[:3, :3] @ got[:3, :3].T).as_rotvec()
        gap = np.concatenate([pose[:3, 3] - got[:3, 3], turn])
        if np.abs(gap).max() < CLOSED:
            break
        z = np.array([frame[:3, 2] for frame in axes])
        arms = np.array([got[:3, 3] - frame[:3, 3] for frame in axes])
        moves = np.concatenate([np.cross(z, arms), z], axis=1).T
        step = np.linalg.lstsq(moves, gap, rcond=1e-9)[0]
        q = q + step * min(1.0, LONGEST / max(float(np.abs(step).max()), 1e-12))
    if np.abs(gap).max() > REACHED:
        raise ValueError(f'{robot.name} does not reach a pose from where it stands')
    return q


STEP = 0.005
"""Way between two places that joints are worked out for [m]."""
FINE = 0.001
"""The same where they are straight in the joints, and the tool goes in a bow [m]."""
REST = 2.3
"""Stay at either end [s], as exported programs say: 0.3 until the arm stands, and 2 that are recorded;
what grows with time has grown by then."""
TURNING = 0.2
"""A turn of the tool takes as long as its end takes to go so far [m/rad]."""
RISE, TICK = 0.2, 0.008
"""Time from rest to full speed and back [s], and between two places a controller commands [s]. A speed
that is there at once would throw the arm off by what its joints give, as no controller does it: by
0.14 mm at the end of one seam."""
BY_JOINTS = ('movej', 'PTP', 'MoveAbsJ', 'MOVJ', 'J', 'joint', 'point')
"""Words of moves that are straight in the joints; a trajectory's points are reached so."""


class Driven(NamedTuple):
    """
    Times (N,) [s], joints (N, n) [rad], and where the controller believes the tool, (N, 3).

    ``way`` (N,) [s] is how far along it is then, as the time that takes at full speed. ``ends`` (K,) [s]
    are the times at which the moves end.
    """

    clock: np.ndarray
    joints: np.ndarray
    tool: np.ndarray
    way: np.ndarray
    ends: np.ndarray

    def believed(self, t: np.ndarray) -> np.ndarray:
        """Return where the controller believes the tool at times (M,), shape (M, 3)."""
        return np.stack([np.interp(t, self.clock, column) for column in self.tool.T], axis=1)


def driven(robot: Robot, moves: Moves, start: np.ndarray, speed: float) -> Driven:
    """
    Return what a controller makes of moves; it stands at the end of the first when it begins.

    moves: as a reader returns them, their places in the robot's base.
    start: joints near the end of the first move, shape (n,).
    speed: of the tool [m/s].
    """
    tool = np.array(robot.T_flange_tool)
    q, at = np.array(start), 0.0
    clock: list[float] = []
    ends: list[float] = []
    joints: list[np.ndarray] = []
    for k, (word, places) in enumerate(moves):
        place = places[-1]
        if k == 0:
            way = [place if place.ndim == 1 else joints_for(robot, place, tool, q)]
        elif word in BY_JOINTS:
            way = _by_joints(robot, q, place, tool)
        else:
            end = tool_pose(robot, place, tool) if place.ndim == 1 else place
            way = _straight(robot, q, end, tool)
        for step, length in zip(way, _lengths(robot, [q, *way], tool), strict=True):
            at += length / speed if k else 0.0
            q = step
            if not clock or at > clock[-1] + 1e-6:
                clock.append(at)
                joints.append(q)
        ends.append(at)
    t, passed = _eased(np.array(clock))
    rows = np.stack([np.interp(passed, clock, column) for column in np.array(joints).T], axis=1)
    believed = tool_pose(robot, rows, tool)[:, :3, 3]
    return Driven(t, rows, believed, passed, np.interp(ends, passed, t))


def _eased(clock: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
    """Return times, and how far along a way of places at full speed, (N,), one is then [s]."""
    whole = float(clock[-1])
    rise = max(min(RISE, whole), 1e-9)
    end = whole + rise
    gone = np.minimum(clock, whole - clock)
    early = np.where(gone < 0.5 * rise, np.sqrt(2.0 * rise * gone), gone + 0.5 * rise)
    passed = np.where(2.0 * clock < whole, early, end - early)
    t = np.union1d(passed, np.linspace(0.0, end, int(end / TICK) + 2))
    left = np.minimum(t, end - t)
    gone = 0.5 * np.minimum(left, rise) ** 2 / rise + np.maximum(left - rise, 0.0)
    return t, np.where(2.0 * t < end, gone, whole - gone)


def _by_joints(
    robot: Robot, q: np.ndarray, place: np.ndarray, tool: np.ndarray
) -> list[np.ndarray]:
    end = place if place.ndim == 1 else joints_for(robot, place, tool, q)
    count = max(int(np.ceil(_lengths(robot, [q, end], tool)[0] / FINE)), 1)
    return [q + share * (end - q) for share in np.arange(1, count + 1) / count]


def _straight(robot: Robot, q: np.ndarray, end: np.ndarray, tool: np.ndarray) -> list[np.ndarray]:
    begin = tool_pose(robot, q, tool)
    way = end[:3, 3] - begin[:3, 3]
    turn = Rotation.from_matrix(end[:3, :3] @ begin[:3, :3].T).as_rotvec()
    count = max(int(np.ceil(_size(way, turn) / STEP)), 1)
    out = []
    for share in np.arange(1, count + 1) / count:
        pose = np.eye(4)
        pose[:3, 3] = begin[:3, 3] + share * way
        pose[:3, :3] = Rotation.from_rotvec(share * turn).as_matrix() @ begin[:3, :3]
        q = joints_for(robot, pose, tool, q)
        out.append(q)
    return out


def _lengths(robot: Robot, stops: Sequence[np.ndarray], tool: np.ndarray) -> np.ndarray:
    """Return how long the way from each of some joint positions (M, n) to the next is, (M - 1,)."""
    poses = tool_pose(robot, np.array(stops), tool)
    turned = poses[1:, :3, :3] @ np.swapaxes(poses[:-1, :3, :3], -1, -2)
    return _size(np.diff(poses[:, :3, 3], axis=0), Rotation.from_matrix(turned).as_rotvec())


def _size(way: np.ndarray, turn: np.ndarray) -> np.ndarray:
    far, round_ = np.linalg.norm(way, axis=-1), np.linalg.norm(turn, axis=-1)
    return np.asarray(np.maximum(far, TURNING * round_))


def evenly(made: Driven, rate: float, rest: float = REST) -> tuple[np.ndarray, np.ndarray]:
    """Return even stamps (N,) [s] and joints (N, n), with a stay [s] at either end."""
    end = float(made.clock[-1]) + 2.0 * rest
    t = np.arange(int(end * rate) + 1) / rate
    columns = [np.interp(t - rest, made.clock, column) for column in made.joints.T]
    return t, np.stack(columns, axis=1)


Place = np.ndarray
Moves = list[tuple[str, list[Place]]]
Texts = Sequence[str]

NUMBER = r'[-+]?(?:\d+\.?\d*|\.\d+)(?:[eE][-+]?\d+)?'
"""A number in any of the languages."""


def numbers(text: str) -> list[float]:
    return [float(v) for v in re.findall(NUMBER, text)]


def pose(position: Any, rotation: Rotation) -> Place:
    out = np.eye(4)
    out[:3, :3], out[:3, 3] = rotation.as_matrix(), position
    return out


def krl_pose(fields: dict[str, float]) -> Place:
    """A about z, then B about the new y, then C about the new x: scipy's capital letters."""
    angles = [fields[k] for k in 'ABC']
    return pose(
        np.array([fields[k] for k in 'XYZ']) / 1e3,
        Rotation.from_euler('ZYX', angles, degrees=True),
    )


def krl_fields(text: str) -> dict[str, float]:
    """Return the components of an aggregate."""
    return {
        k: float(v) for k, v in re.findall(rf'\b([A-Z]\d?)\s+({NUMBER})', text.partition('{')[2])
    }


def krl(files: Texts) -> Moves:
    """Return the targets of the moves: (word, list of poses or joint positions)."""
    src, dat = files[0], files[1] if len(files) > 1 else ''
    known: dict[str, dict[str, float]] = {}
    for name, body in re.findall(r'DECL \w+ (X?\w+)=(\{[^}]*\})', dat):
        known[name] = krl_fields(body)
    out: Moves = []
    for line in src.splitlines():
        line = line.split(';')[0].strip()
        match = re.match(r'(PTP|LIN|CIRC) (.*)', line)
        if not match:
            continue
        places = []
        for item in re.findall(r'\{[^}]*\}|XP\d+', match[2]):
            fields = known[item] if item in known else krl_fields(item)
            if 'A1' in fields:
                places.append(np.radians([fields[f'A{k}'] for k in range(1, 7)]))
            else:
                places.append(krl_pose(fields))
        out.append((match[1], places))
    return out


def rapid(files: Texts) -> Moves:
    """Return the moves of a module; work object wobjTable stands at 0.5 0 0.1 m."""
    text = re.sub(r'"[^"\n]*"', '', re.sub(r'!.*', '', files[0]))
    text = text.replace('\\NoEOffs', '')
    known: dict[str, Place] = {}
    for kind, name, body in re.findall(r'CONST (robtarget|jointtarget) (\w+)\s*:=([^;]*);', text):
        known[name] = rapid_target(kind, body)
    at = [0.5, 0.0, 0.1] if 'wobjTable' in text else [0.0, 0.0, 0.0]
    table = pose(at, Rotation.identity())
    out: Moves = []
    body = text.partition('PROC')[2]
    for word, rest in re.findall(r'(MoveAbsJ|MoveL|Arc[LC]\w*)\s+([^;]*);', body):
        places = []
        for item in re.findall(r'Offs\([^)]*\)|\bp\w+|jHome|^\[\[.*?\]\s*,\s*\[.*?\]', rest, re.S):
            if item.startswith('Offs'):
                name, *shift = re.split(r'[(,)]', item)[1:5]
                moved = known[name].copy()
                moved[:3, 3] += np.array([float(v) for v in shift]) / 1e3
                places.append(table @ moved)
                continue
            kind = 'jointtarget' if word == 'MoveAbsJ' else 'robtarget'
            value = rapid_target(kind, item) if item.startswith('[') else known[item]
            places.append(value if value.ndim == 1 else table @ value)
        out.append((word, places))
    return out


def rapid_target(kind: str, body: str) -> Place:
    values = numbers(body)
    if kind == 'jointtarget':
        return np.radians(values[:6])
    w, x, y, z = values[3:7]
    return pose(np.array(values[:3]) / 1e3, Rotation.from_quat([x, y, z, w]))


def urscript(files: Texts) -> Moves:
    text = re.sub(r'"[^"\n]*"', '', re.sub(r'#.*', '', files[0]))
    known: dict[str, Place] = {}
    for name, body in re.findall(r'(\w+)\s*=\s*(p?\[[^\]]*\])', text):
        known[name] = ur_value(body)
    out: Moves = []
    for word, rest in re.findall(r'\b(move[jlpc])\((.*)\)', text):
        items = [
            known[i] if i in known else ur_value(i)
            for i in re.findall(r'p?\[[^\]]*\]|\b(?:Start_q|Waypoint_1_p|arc_via)\b', rest)
        ]
        if 'pose_trans' in rest:
            items = [items[0] @ items[1]]
        out.append((word, items))
    return out


def ur_value(text: str) -> Place:
    values = numbers(text)
    if not text.startswith('p'):
        return np.array(values)
    return pose(values[:3], Rotation.from_rotvec(values[3:]))


def fanuc(files: Texts) -> Moves:
    """W about the fixed x, then P about y, then R about z; the origin 0.45 m above the floor."""
    moves, _, positions = files[0].partition('/POS')
    known: dict[str, Place] = {}
    for index, body in re.findall(r'P\[(\d+)[^\]]*\]\{(.*?)\};', positions, re.S):
        fields = {k: float(v) for k, v in re.findall(rf'\b([JXYZWPR]\d?)\s*=\s*({NUMBER})', body)}
        if 'J1' in fields:
            q = np.radians([fields[f'J{k}'] for k in range(1, 7)])
            q[2] += q[1]
            known[index] = q
        else:
            turn = Rotation.from_euler('xyz', [fields[k] for k in 'WPR'], degrees=True)
            at = np.array([fields[k] for k in 'XYZ']) / 1e3
            known[index] = pose(at + [0.0, 0.0, 0.45], turn)
    out: Moves = []
    for word, rest in re.findall(r'^\s*\d+:([JLC]) (P\[[^;]*);', moves, re.M):
        out.append((word, [known[i] for i in re.findall(r'P\[(\d+)', rest)]))
    return out


def inform(files: Texts) -> Moves:
    """Return the moves of a job with pulses of 1000, -1200, 1100, 900, -800, 700 a degree."""
    pulses = np.array([1000.0, -1200.0, 1100.0, 900.0, -800.0, 700.0])
    known: dict[str, Place] = {}
    for name, body in re.findall(r'^(C\d+)=(.*?)\r?$', files[0], re.M):
        values = np.array(numbers(body))
        if abs(values).max() > 2000.0:
            known[name] = np.radians(values / pulses)
        else:
            turn = Rotation.from_euler('xyz', values[3:], degrees=True)
            known[name] = pose(values[:3] / 1e3 + [0.0, 0.0, 0.45], turn)
    return [(word, [known[name]]) for word, name in re.findall(r'^(MOV\w) (C\d+)', files[0], re.M)]


def trajectory(files: Texts, joints: Sequence[str] = ()) -> Moves:
    """Return the points of a trajectory; of a UR arm where no joints are named."""
    content = yaml.safe_load(files[0])
    names = list(joints or UR_JOINTS)
    order = [names.index(name) for name in content['joint_names']]
    out: Moves = []
    for point in content['points']:
        q = np.zeros(len(names))
        q[order] = point['positions']
        out.append(('point', [q]))
    return out


UR_JOINTS = [
    'shoulder_pan_joint',
    'shoulder_lift_joint',
    'elbow_joint',
    'wrist_1_joint',
    'wrist_2_joint',
    'wrist_3_joint',
]
"""In the order of the model."""


def table(files: Texts, joints: Sequence[str] = ()) -> Moves:
    """Return the lines of a table; of a UR arm where no joints are named."""
    lines = [line for line in files[0].splitlines() if not line.startswith('#')]
    return [
        (row['move'], [np.array([float(row[name]) for name in joints or UR_JOINTS])])
        for row in csv.DictReader(lines)
    ]
