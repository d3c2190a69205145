# Copyright 2026 weld_twin contributors
# SPDX-License-Identifier: Apache-2.0
"""
Readers of robot programs that share nothing with the package: what a controller would be told.

Short, as they know only the forms that the programs of tests and studies have. Every reader takes the
texts of a program's files and returns its moves: the word, and the places, each a pose (4, 4) [m]
or joint positions (n,) [rad] of the robot's model.
"""

from __future__ import annotations

import csv
import re
from collections.abc import Sequence
from typing import Any

import numpy as np
import yaml
from scipy.spatial.transform import Rotation

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
