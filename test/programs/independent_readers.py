# SPDX-FileCopyrightText: weld_twin contributors
# SPDX-License-Identifier: Apache-2.0
"""Readers of robot programs that share nothing with the package: what a controller would be told."""

import re

import numpy as np
from scipy.spatial.transform import Rotation

NUMBER = r'[-+]?(?:\d+\.?\d*|\.\d+)(?:[eE][-+]?\d+)?'


def numbers(text):
    return [float(v) for v in re.findall(NUMBER, text)]


def pose(position, rotation):
    out = np.eye(4)
    out[:3, :3], out[:3, 3] = rotation.as_matrix(), position
    return out


def krl_pose(fields):
    """A about z, then B about the new y, then C about the new x: scipy's capital letters."""
    angles = [fields[k] for k in 'ABC']
    return pose(
        np.array([fields[k] for k in 'XYZ']) / 1e3,
        Rotation.from_euler('ZYX', angles, degrees=True),
    )


def krl_fields(text):
    return {
        k: float(v) for k, v in re.findall(rf'\b([A-Z]\d?)\s+({NUMBER})', text.partition('{')[2])
    }


def krl(files):
    """Return the targets of the moves: (word, list of poses or joint positions)."""
    src, dat = files
    known = {}
    for name, body in re.findall(r'DECL \w+ (X?\w+)=(\{[^}]*\})', dat):
        known[name] = krl_fields(body)
    out = []
    for line in src.splitlines():
        line = line.split(';')[0].strip()
        found = re.match(r'(PTP|LIN|CIRC) (.*)', line)
        if not found:
            continue
        places = []
        for item in re.findall(r'\{[^}]*\}|XP\d+', found[2]):
            fields = known[item] if item in known else krl_fields(item)
            if 'A1' in fields:
                places.append(np.radians([fields[f'A{k}'] for k in range(1, 7)]))
            else:
                places.append(krl_pose(fields))
        out.append((found[1], places))
    return out


def rapid(files):
    text = re.sub(r'"[^"\n]*"', '', re.sub(r'!.*', '', files[0]))
    text = text.replace('\\NoEOffs', '')
    known = {}
    for kind, name, body in re.findall(r'CONST (robtarget|jointtarget) (\w+)\s*:=([^;]*);', text):
        known[name] = rapid_target(kind, body)
    table = pose([0.5, 0.0, 0.1], Rotation.identity())
    out = []
    body = text.partition('PROC')[2]
    for word, rest in re.findall(r'(MoveAbsJ|MoveL|Arc[LC]\w*)\s+([^;]*);', body):
        places = []
        for item in re.findall(r'Offs\([^)]*\)|\bp\w+|jHome|^\[\[.*?\]\s*,\s*\[.*?\]', rest, re.S):
            if item.startswith('Offs'):
                name, *shift = re.split(r'[(,)]', item)[1:5]
                moved = known[name].copy()
                moved[:3, 3] += np.array([float(v) for v in shift]) / 1e3
                places.append(table @ moved)
            elif item.startswith('['):
                places.append(table @ rapid_target('robtarget', item))
            else:
                value = known[item]
                places.append(value if value.ndim == 1 else table @ value)
        out.append((word, places))
    return out


def rapid_target(kind, body):
    values = numbers(body)
    if kind == 'jointtarget':
        return np.radians(values[:6])
    w, x, y, z = values[3:7]
    return pose(np.array(values[:3]) / 1e3, Rotation.from_quat([x, y, z, w]))


def urscript(files):
    text = re.sub(r'"[^"\n]*"', '', re.sub(r'#.*', '', files[0]))
    known = {}
    for name, body in re.findall(r'(\w+)\s*=\s*(p?\[[^\]]*\])', text):
        known[name] = ur_value(body)
    out = []
    for word, rest in re.findall(r'\b(move[jlpc])\((.*)\)', text):
        items = [
            known[i] if i in known else ur_value(i)
            for i in re.findall(r'p?\[[^\]]*\]|\b(?:Start_q|Waypoint_1_p|arc_via)\b', rest)
        ]
        if 'pose_trans' in rest:
            items = [items[0] @ items[1]]
        out.append((word, items))
    return out


def ur_value(text):
    values = numbers(text)
    if not text.startswith('p'):
        return np.array(values)
    return pose(values[:3], Rotation.from_rotvec(values[3:]))
