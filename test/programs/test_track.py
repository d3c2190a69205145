# Copyright 2026 weld_twin contributors
# SPDX-License-Identifier: Apache-2.0
"""Where a track of a URDF begins in the controller's world is told of the link it stands in."""

import re

import numpy as np
from command_line import done
from scipy.spatial.transform import Rotation

JOINTS = [
    # what it hangs on, where, about or along which axis
    ('rail', 'prismatic', '0 0 0.2', '1 0 0'),
    ('joint_1', 'revolute', '0 0 0.45', '0 0 1'),
    ('joint_2', 'revolute', '0.15 0 0', '0 1 0'),
    ('joint_3', 'revolute', '0 0 0.7', '0 1 0'),
    ('joint_4', 'revolute', '0 0 0.115', '1 0 0'),
    ('joint_5', 'revolute', '0.72 0 0', '0 1 0'),
    ('joint_6', 'revolute', '0.085 0 0', '1 0 0'),
]
OFF = 4e-4
"""How much farther the real carriage stands [m]."""


def urdf():
    links, joints, last = ['<link name="foot"/>'], [], 'foot'
    for name, kind, xyz, axis in JOINTS:
        links.append(f'<link name="of_{name}"/>')
        joints.append(
            f'<joint name="{name}" type="{kind}"><parent link="{last}"/><child link="of_{name}"/>'
            f'<origin xyz="{xyz}"/><axis xyz="{axis}"/>'
            '<limit lower="-3" upper="3" effort="1" velocity="2"/></joint>'
        )
        last = f'of_{name}'
    return f'<robot name="cell">{"".join(links + joints)}</robot>'


def flange(q):
    """Return position and rotation of the flange, seen from the foot of the track."""
    at, turn = np.zeros(3), Rotation.identity()
    for (_, kind, xyz, axis), value in zip(JOINTS, q, strict=True):
        at = at + turn.apply(np.array(xyz.split(), dtype=float))
        along = value * np.array(axis.split(), dtype=float)
        if kind == 'prismatic':
            at = at + turn.apply(along)
        else:
            turn = turn * Rotation.from_rotvec(along)
    return at, turn


def test_a_track_of_a_urdf_stands_in_the_world_as_its_link_does(tmp_path):
    (tmp_path / 'cell.urdf').write_text(urdf(), encoding='utf-8')
    off = f'- {{effect: joint_offset, joint: rail, offset: {OFF}}}\n'
    (tmp_path / 'found.yaml').write_text(off, encoding='utf-8')
    # The foot lies 1 m along the world's x, turned by a quarter about z: the track goes along y.
    quarter = Rotation.from_euler('Z', 90, degrees=True)
    home = [0.5, 0.0, -0.1, 0.2, 0.0, 1.0, 0.0]
    lines = [f'PTP {{{", ".join(f"A{k} {np.degrees(home[k])}" for k in range(1, 7))}, E1 500}}']
    for rail in (0.5, 0.6, 0.7):
        at, turn = flange([rail, 0.1 * rail, *home[2:]])
        place = [*(1e3 * (quarter.apply(at) + [1, 0, 0]))]
        place += [*(quarter * turn).as_euler('ZYX', degrees=True), 1e3 * rail]
        named = zip(('X', 'Y', 'Z', 'A', 'B', 'C', 'E1'), place, strict=True)
        lines.append('LIN {' + ','.join(f'{name} {value:.5f}' for name, value in named) + '}')
    frames = [f'${name}={{X 0,Y 0,Z 0,A 0,B 0,C 0}}' for name in ('TOOL', 'BASE')]
    text = '\n'.join(['DEF seam()', *frames, *lines, 'END', ''])
    (tmp_path / 'seam.src').write_text(text, encoding='utf-8')
    words = ['correct', tmp_path / 'seam.src', '--robot', tmp_path / 'cell.urdf', '--out']
    words += [tmp_path / 'out', '--model', tmp_path / 'found.yaml', '--external', 'E1=rail']
    said = done(*words, '--base-link', 'foot', '--world', '1000,0,0,90,0,0')
    assert 'where the first link of the chain stands' in ' '.join(said.split())
    after = (tmp_path / 'out' / 'seam.src').read_text(encoding='utf-8')
    moved = numbers(after) - numbers(text)
    wanted = np.zeros((3, 7))
    wanted[:, 1] = -1e3 * OFF
    np.testing.assert_allclose(moved, wanted, atol=2e-4)


def numbers(text):
    rows = re.findall(r'LIN (.*)', text)
    return np.array([[float(v) for v in re.findall(r' (-?[\d.]+)', row)] for row in rows])
