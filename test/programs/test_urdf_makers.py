# Copyright 2026 weld_twin contributors
# SPDX-License-Identifier: Apache-2.0
"""Arms in the URDF conventions of seven makers: what a program says is meant in the links' frames."""

import csv
import io
import json
from pathlib import Path

import numpy as np
import pytest
import yaml
from command_line import done
from scipy.spatial.transform import Rotation

from weld_twin_lab.programs import plain as readers

pin = pytest.importorskip('pinocchio', reason='the arms are worked out by another library')

MAKERS = Path(__file__).parent / 'makers'
PULSES = ('--pulses-per-degree', '1000,-1200,1100,900,-800,700')


def table(files):
    rows = csv.DictReader(line for line in files[0].splitlines() if not line.startswith('#'))
    return [
        (
            row['move'],
            [
                readers.pose(
                    [float(row[k]) for k in 'xyz'],
                    Rotation.from_quat([float(row[f'q{k}']) for k in 'xyzw']),
                )
            ],
        )
        for row in rows
    ]


CASES = {
    # maker: language, suffix, reader, controller's base, its flange, rounding of the tool [m]
    'kuka': ('krl', '.src', readers.krl, 'base', 'tool0', 2e-7),
    'abb': ('rapid', '.mod', readers.rapid, 'base', 'tool0', 2e-7),
    'ur': ('urscript', '.script', readers.urscript, 'base', 'tool0', 2e-7),
    # These readers add the height at which the makers' controllers have their origin.
    'fanuc': ('fanuc-ls', '.ls', readers.fanuc, 'base_link', 'tool0', 5e-5),
    'yaskawa': ('inform', '.jbi', readers.inform, 'base_link', 'tool0', 5e-5),
    'doosan': ('csv', '.csv', table, 'base_link', 'link_6', 2e-7),
    'franka': ('csv', '.csv', table, 'base', 'fr3_link8', 2e-7),
}


class Arm:
    """A URDF as pinocchio reads it."""

    def __init__(self, path):
        self.model = pin.buildModelFromUrdf(str(path))
        self.data = self.model.createData()
        self.names = list(self.model.names)[1:]  # the first is the universe
        self.tip = self.model.getFrameId('tcp')

    def rotation(self, link):
        return self.data.oMf[self.model.getFrameId(link)].rotation

    def between(self, first, second, q):
        pin.framesForwardKinematics(self.model, self.data, np.asarray(q))
        one, other = (self.data.oMf[self.model.getFrameId(name)] for name in (first, second))
        return (one.inverse() * other).homogeneous

    def joints_for(self, base, pose, near):
        """Return the nearest joints whose torch is at a pose in a base."""
        q = np.array(near)
        for _ in range(60):
            got = self.between(base, 'tcp', q)
            turn = Rotation.from_matrix(pose[:3, :3] @ got[:3, :3].T).as_rotvec()
            gap = np.concatenate([pose[:3, 3] - got[:3, 3], turn])
            if np.abs(gap).max() < 1e-11:
                return q
            steps = pin.computeFrameJacobian(
                self.model, self.data, q, self.tip, pin.LOCAL_WORLD_ALIGNED
            )
            world = np.kron(np.eye(2), self.rotation(base))
            step = np.linalg.lstsq(steps, world @ gap, rcond=1e-9)[0]
            q = q + step * min(1.0, 0.3 / np.abs(step).max())
        raise AssertionError('a pose of the program is not where the arm can be')


def command(name, maker, *more):
    robot = MAKERS / f'{maker}.urdf'
    return done(*name.split(), *more, '--robot', robot, '--tip-link', 'tcp')


def test_every_makers_arm_is_planned_for_and_simulated(tmp_path):
    (tmp_path / 'none.yaml').write_text('[]')
    command('investigate', 'doosan', '--tolerance', 0.5, '--minutes', 5, '--seconds', 5)
    for maker in CASES.keys() - {'franka'}:  # seven joints take as long as the other arms together
        seam = ('--effects', tmp_path / 'none.yaml', '--path', 'line', '--profile', 'aggressive')
        command('simulate', maker, *seam, '--out', tmp_path / maker)


NEAR = {
    'fanuc': np.radians([5.0, 30.0, 10.0, 4.0, -60.0, -6.0]),
    'yaskawa': np.radians([8.0, 15.0, -10.0, 4.0, -75.0, -6.0]),
    'doosan': np.array([0.2, 0.4, 1.2, 0.3, 1.0, 0.2]),
    'franka': np.array([0.1, 0.2, -0.1, -1.9, 0.2, 2.3, 0.4]),
}
"""Joints at the first point of programs that are written here; the others are exported."""


def fixed_turns(T):
    at, turn = 1e3 * T[:3, 3], Rotation.from_matrix(T[:3, :3]).as_euler('xyz', degrees=True)
    return [float(v) for v in (*at, *turn)]


def fanuc(near, poses):
    moves = ['   1:J P[1] 20% FINE    ;']
    moves += [f'   {k}:L P[{k}] 20mm/sec FINE    ;' for k in range(2, len(poses) + 2)]
    joints = ', '.join(f'J{k + 1}= {v:.6f} deg' for k, v in enumerate(np.degrees(near)))
    points = [f'P[1]{{\n   GP1:\n UF : 0, UT : 1,\n {joints}\n}};']
    for k, pose in enumerate(poses, start=2):
        x, y, z, w, p, r = fixed_turns(pose)
        place = f'X = {x:.6f} mm, Y = {y:.6f} mm, Z = {z:.6f} mm,\n'
        place += f' W = {w:.6f} deg, P = {p:.6f} deg, R = {r:.6f} deg'
        config = "UF : 0, UT : 1, CONFIG : 'N U T, 0, 0, 0',"
        points.append(f'P[{k}]{{\n   GP1:\n {config}\n {place}\n}};')
    head = ['/PROG  SEAM', '/ATTR', '/MN', '   0:  UTOOL_NUM=1 ;']
    return '\n'.join([*head, *moves, '/POS', *points, '/END', ''])


def inform(near, poses):
    pulses = np.degrees(near) * [1000.0, -1200.0, 1100.0, 900.0, -800.0, 700.0]
    rows = ['/JOB', '//NAME SEAM', '//POS', f'///NPOS {len(poses) + 1},0,0,0,0,0', '///TOOL 1']
    rows += ['///POSTYPE PULSE', '///PULSE', 'C00000=' + ','.join(f'{v:.0f}' for v in pulses)]
    rows += ['///POSTYPE ROBOT', '///RECTAN', '///RCONF 1' + 23 * ',0']
    for k, pose in enumerate(poses, start=1):
        rows.append(f'C{k:05d}=' + ','.join(f'{v:.4f}' for v in fixed_turns(pose)))
    rows += ['//INST', '///DATE 2024/03/11 09:43', '///ATTR SC,RW,RJ', '////FRAME ROBOT']
    rows += ['///GROUP1 RB1', 'NOP', 'MOVJ C00000 VJ=20.00']
    rows += [f'MOVL C{k:05d} V=20.0' for k in range(1, len(poses) + 1)]
    return '\r\n'.join([*rows, 'END', ''])


def rows_of_poses(near, poses):
    text = io.StringIO()
    out = csv.writer(text)
    out.writerow(['move', *'xyz', *(f'q{k}' for k in 'xyzw')])
    for pose in poses:
        turn = Rotation.from_matrix(pose[:3, :3]).as_quat()
        out.writerow(['linear', *(f'{v:.9f}' for v in [*pose[:3, 3], *turn])])
    return text.getvalue()


def program(maker, arm, folder):
    """Return a program, joints near its first point, and the options it is read with."""
    language, suffix, reader, base, flange, _ = CASES[maker]
    path = folder / f'seam{suffix}'
    if maker not in NEAR:
        command('export program', maker, 'arc', '--controller', language, '--out', path)
        (_, (near,)), *_ = reader([path.read_bytes().decode('latin-1')])
        return path, near, ()
    near = NEAR[maker]
    poses = [arm.between('base' if maker != 'doosan' else base, 'tcp', near)]
    for k in range(1, 5):
        poses.append(poses[0].copy())
        poses[-1][:3, 3] += [0.0, 0.02 * k, 0.01 * k]
    write = {'fanuc': fanuc, 'yaskawa': inform}.get(maker, rows_of_poses)
    path.write_bytes(write(near, poses).encode())
    if write is rows_of_poses:
        return path, near, ('--start=' + ','.join(f'{v:.9f}' for v in np.degrees(near)),)
    tool = fixed_turns(arm.between(flange, 'tcp', pin.neutral(arm.model)))
    pulses = PULSES if maker == 'yaskawa' else ()
    return path, near, ('--tool', '1=' + ','.join(map(repr, tool)), *pulses)


@pytest.mark.parametrize('maker', CASES)
def test_a_straight_move_is_corrected_in_the_frames_of_the_urdfs_links(maker, tmp_path):
    _, _, reader, base, _, rounding = CASES[maker]
    arm = Arm(MAKERS / f'{maker}.urdf')
    path, near, options = program(maker, arm, tmp_path)
    offsets = np.zeros(arm.model.nq)
    offsets[1:4] = 8e-4, -6e-4, 5e-4
    zeros = [
        {'effect': 'joint_offset', 'joint': arm.names[k], 'offset': float(offsets[k])}
        for k in (1, 2, 3)
    ]
    (tmp_path / 'zeros.yaml').write_text(yaml.safe_dump(zeros))
    model = ('--model', tmp_path / 'zeros.yaml', '--out', tmp_path / 'better')
    command('correct', maker, path, *model, *options)

    texts = [
        file.read_bytes().decode('latin-1') for file in (path, tmp_path / 'better' / path.name)
    ]
    wanted, told = (
        [place for _, places in reader([text]) for place in places if place.ndim == 2]
        for text in texts
    )
    assert len(wanted) == len(told) > 1
    before, after, q, real = [], [], np.array(near), np.array(near)
    for place, corrected in zip(wanted, told, strict=True):
        q, real = arm.joints_for(base, place, q), arm.joints_for(base, corrected, real)
        assert np.abs(q - near).max() < 1.5  # the seam lies where the first point says
        before.append(arm.between(base, 'tcp', q + offsets)[:3, 3] - place[:3, 3])
        after.append(arm.between(base, 'tcp', real + offsets)[:3, 3] - place[:3, 3])
    assert np.linalg.norm(before, axis=1).max() > 2e-4
    assert np.linalg.norm(after, axis=1).max() < 2e-6 + rounding
    promised = json.loads((tmp_path / 'better' / 'correction.json').read_text())['expected']
    largest = np.linalg.norm(before, axis=1).max()
    assert promised['before']['worst_m'] == pytest.approx(largest, rel=0.1)
