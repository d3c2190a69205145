# Copyright 2026 weld_twin contributors
# SPDX-License-Identifier: Apache-2.0
"""Contacts and cameras, from files to a corrected robot."""

import json
import re
from dataclasses import replace

import numpy as np
import pytest
import yaml
from command_line import done
from scipy.spatial.transform import Rotation

import weld_twin_core as wt
from weld_twin_core.arm.chain import forward
from weld_twin_core.effects import REGISTRY
from weld_twin_core.motion.inverse.newton import reaching
from weld_twin_msgs_py.bags.writers import BagWriter
from weld_twin_msgs_py.messages.to_messages import bag_messages
from weld_twin_msgs_py.robots import load_robot, write_urdf
from weld_twin_nodes.cli.in_process import weld_twin

# theta offset, d, a, alpha of an arm that nobody sells
ROWS = np.array(
    [
        [0.0, 0.42, 0.16, -np.pi / 2],
        [-np.pi / 2, 0.0, 0.58, 0.0],
        [0.0, 0.0, 0.11, -np.pi / 2],
        [0.0, 0.61, 0.0, np.pi / 2],
        [0.0, 0.0, 0.0, -np.pi / 2],
        [0.0, 0.12, 0.0, 0.0],
    ]
)
NAMES = [f'axis_{k}' for k in range(1, 7)]
GEOMETRY = {'joint_offset', 'link_length', 'link_offset', 'link_twist', 'axis_parallelism'}
OTHERS = ('--exclude-effect', *(REGISTRY.keys() - GEOMETRY))
"""Kinds that need not be tried beside those of the geometry: the fewer, the sooner."""
FEW = ('--exclude-effect', *(REGISTRY.keys() - {'joint_offset', 'link_length'}))
"""The same where it is about how well a zero is known."""


def flange(q, zeros):
    """Return the flange at joint angles (M, 6), zeros off by so much, (M, 4, 4)."""
    out = np.tile(np.eye(4), (len(q), 1, 1))
    for k, (offset, d, a, alpha) in enumerate(ROWS):
        angle = q[:, k] + offset + zeros[k]
        step = np.zeros_like(out)
        step[:, :3, :3] = (
            Rotation.from_rotvec(angle[:, None] * [0.0, 0.0, 1.0])
            * Rotation.from_rotvec([alpha, 0.0, 0.0])
        ).as_matrix()
        step[:, :3, 3] = np.stack([a * np.cos(angle), a * np.sin(angle), 0 * angle + d], axis=1)
        step[:, 3, 3] = 1.0
        out = out @ step
    return out


def joints_called(names):
    """Return the arm's joints as a robot file has them."""
    keys = ('theta_offset', 'd', 'a', 'alpha')
    return [
        dict(zip(keys, map(float, row), strict=True), name=name)
        for name, row in zip(names, ROWS, strict=True)
    ]


def robot_file(folder):
    path = folder / 'arm.yaml'
    arm = {'name': 'arm', 'convention': 'standard', 'joints': joints_called(NAMES)}
    path.write_text(yaml.safe_dump(arm))
    return path


def found_in(out, *words):
    """Diagnose, whatever it comes to, and return the answer."""
    weld_twin('diagnose', *words, '--out', out)
    return json.loads((out / 'diagnosis.json').read_text())


def board_bag(path, kind, q, poses, covariance):
    """Write joint states and poses of a board, as one or another type of message."""
    make = bag_messages()
    with BagWriter(path, provenance={'static': True}) as bag:
        for k, (row, pose, own) in enumerate(zip(q, poses, covariance, strict=True)):
            ns = (k + 1) * 1_000_000_000
            where = pose[:3, 3], pose[:3, :3]
            state = make.joint_state(ns, tuple(NAMES), row, None)
            seen = (
                make.pose_with_covariance(ns, *where, own, 'camera')
                if kind == 'sure'
                else make.pose(ns, *where, 'camera')
            )
            bag.write('/joint_states', state, ns)
            bag.write('/measured/tool_pose', seen, ns)


def test_a_board_counts_less_along_the_line_of_sight(tmp_path):
    rng = np.random.default_rng(8)
    q = rng.uniform(-0.7, 0.7, (40, 6))
    zeros = np.array([0.0, 0.0, 6e-4, 0.0, 0.0, 0.0])
    board = flange(q, zeros)
    sizes = np.array([1.6e-5, 1.6e-5, 1e-3, 8e-4, 8e-4, 6e-5])
    # The board turns with the tool, and so do the directions in which it is seen well.
    sight = Rotation.from_rotvec(rng.normal(0.0, 0.3, (40, 3))).as_matrix()
    turn = np.zeros((40, 6, 6))
    turn[:, :3, :3] = turn[:, 3:, 3:] = sight
    error = np.einsum('mij,mj->mi', turn, sizes * rng.normal(size=(40, 6)))
    covariance = turn @ np.diag(sizes**2) @ np.swapaxes(turn, 1, 2)
    board[:, :3, :3] = Rotation.from_rotvec(error[:, 3:]).as_matrix() @ board[:, :3, :3]
    board[:, :3, 3] += error[:, :3]
    robot, off = robot_file(tmp_path), {}
    for kind in ('plain', 'sure'):
        board_bag(tmp_path / kind, kind, q, board, covariance)
        words = (tmp_path / kind, '--robot', robot, '--align', 'base,tool', *FEW)
        found = found_in(tmp_path / f'{kind} out', *words)
        told = {(e['effect'], e['joint']): e for e in found['verdict']['effects']}
        one = told.get(('joint_offset', 'axis_3'))
        off[kind] = 1.0 if one is None else abs(one['parameters']['offset'] - 6e-4)
    assert off['sure'] < 4e-5
    assert off['plain'] > 2.0 * off['sure']


# fx fy cx cy [px], k1 k2 p1 p2 k3, and where the lens is in the world
LENSES = {
    'left': ((2600.0, 2590.0, 1010.0, 770.0), (-0.11, 0.08, 4e-4, -6e-4, 0.0), (-0.55, -0.3)),
    'right': ((2640.0, 2655.0, 985.0, 760.0), (-0.09, 0.05, -3e-4, 5e-4, 0.0), (0.5, -0.25)),
}
BOARD = {'board': 'charuco', 'squares': [8, 6], 'square': 0.025}


def corners(side=0.025, wide=7, high=5):
    """Return the inner corners of the board as OpenCV counts them (35, 3)."""
    return np.array([[c + 1.0, r + 1.0, 0.0] for r in range(high) for c in range(wide)]) * side


def pixels(points, numbers, bent):
    """Return where points before a camera are seen: the page of ROS's image_pipeline, by hand."""
    (fx, fy, cx, cy), (k1, k2, p1, p2, k3) = numbers, bent
    x, y = points[:, 0] / points[:, 2], points[:, 1] / points[:, 2]
    r2 = x**2 + y**2
    radial = 1 + k1 * r2 + k2 * r2**2 + k3 * r2**3
    u = x * radial + 2 * p1 * x * y + p2 * (r2 + 2 * x**2)
    v = y * radial + p1 * (r2 + 2 * y**2) + 2 * p2 * x * y
    return np.stack([fx * u + cx, fy * v + cy], axis=1)


def looking_at(place, aim):
    """Return the pose of a camera at a place whose line of sight meets an aim, image upright."""
    z = (aim - place) / np.linalg.norm(aim - place)
    x = np.cross(z, [0.0, 0.0, 1.0])
    x /= np.linalg.norm(x)
    out = np.eye(4)
    out[:3, :3] = np.stack([x, np.cross(z, x), z], axis=1)
    out[:3, 3] = place
    return out


def cell(folder, *, zeros, side=0.025, mirrored=False, names=None, told=1.0, count=40):
    """Write a table of what two fixed cameras saw of a board on the tool, and its files."""
    rng = np.random.default_rng(3)
    middle = np.array([0.2, 0.35, 0.4, 0.3, 0.9, 0.2])
    q = middle + rng.uniform(-0.45, 0.45, (count, 6))
    tool = np.eye(4)
    tool[:3, :3] = Rotation.from_rotvec([0.1, 2.9, 0.3]).as_matrix()
    tool[:3, 3] = [0.06, -0.05, 0.03]
    board = flange(q, zeros) @ tool
    aim = board[:, :3, 3].mean(axis=0)
    normal = board[:, :3, 2].mean(axis=0) / np.linalg.norm(board[:, :3, 2].mean(axis=0))
    across = np.cross(normal, [0.0, 0.0, 1.0])
    points = corners(side) * ([-1.0, 1.0, 1.0] if mirrored else [1.0, 1.0, 1.0])
    lines = [','.join(('image', 'camera', 'point', 'u [px]', 'v [px]', *NAMES))]
    for name, (numbers, bent, (aside, up)) in LENSES.items():
        place = aim - 1.4 * normal + aside * across + [0.0, 0.0, up]
        eye = np.linalg.inv(looking_at(place, aim))
        for k, pose in enumerate(eye @ board):
            there = points @ pose[:3, :3].T + pose[:3, 3]
            where = pixels(there, numbers, bent)
            for at, (u, v) in enumerate(where + rng.normal(0.0, 0.15, where.shape)):
                if 0.0 < u < 2000.0 and 0.0 < v < 1500.0:
                    own = (names or {}).get(name, name)
                    angles = (f'{value:.7f}' for value in q[k])
                    lines.append(','.join((str(k), own, str(at), f'{u:.3f}', f'{v:.3f}', *angles)))
        fx, fy, cx, cy = numbers
        matrix = [fx * told, 0.0, cx, 0.0, fy * told, cy, 0.0, 0.0, 1.0]
        info = {'camera_name': name, 'distortion_model': 'plumb_bob'}
        info['camera_matrix'] = {'rows': 3, 'cols': 3, 'data': matrix}
        info['distortion_coefficients'] = {'rows': 1, 'cols': 5, 'data': list(bent)}
        (folder / f'{name}.yaml').write_text(yaml.safe_dump(info))
    (folder / 'board.yaml').write_text(yaml.safe_dump(BOARD))
    (folder / 'pixels.csv').write_text('\n'.join(lines) + '\n')
    return robot_file(folder)


def described(folder):
    """Return the options that say what is in the pixels."""
    return [
        *(f'--camera={name}={folder / name}.yaml' for name in LENSES),
        f'--target=board={folder / "board.yaml"}',
    ]


def test_pixels_of_two_cameras_name_the_joint_whose_zero_is_off(tmp_path):
    robot, bag = cell(tmp_path, zeros=np.array([0.0, 0.0, 1e-3, 0.0, 0.0, 0.0])), tmp_path / 'bag'
    words = ('import', tmp_path / 'pixels.csv', '--robot', robot, *described(tmp_path))
    said = weld_twin(*words, '--out', bag).out
    assert done('bag', bag).endswith('\nusable for a diagnosis\n')
    words = ('--robot', robot, '--align', 'base,tool', *OTHERS)
    found = found_in(tmp_path / 'out', bag, *words)
    assert '40 of 40 images tell a pose; points are found within 0.1' in said
    named = [(e['effect'], e['joint']) for e in found['verdict']['effects']]
    assert named == [('joint_offset', 'axis_3')]
    assert found['verdict']['effects'][0]['parameters']['offset'] == pytest.approx(1e-3, abs=1e-4)
    assert (tmp_path / 'out' / 'report.html').is_file()


def test_mistakes_with_cameras_are_named_from_a_table_of_pixels_alone(tmp_path):
    zeros = np.array([0.0, 0.0, 1e-3, 0.0, 0.0, 0.0])
    for kind, mistake in (
        ('target_scale', {'side': 0.98 * 0.025}),
        ('target_mirrored', {'mirrored': True}),
        ('intrinsics', {'told': 1.08}),
        ('cameras_swapped', {'names': {'left': 'right', 'right': 'left'}}),
    ):
        folder = tmp_path / kind
        folder.mkdir()
        robot = cell(folder, zeros=zeros, count=16, **mistake)
        words = (folder / 'pixels.csv', '--robot', robot, *described(folder))
        found = found_in(folder / 'out', *words, '--align', 'base,tool', *OTHERS)
        assert found['verdict']['status'] == 'unsound'
        assert [entry['kind'] for entry in found['unsound']] == [kind]


# Two arms that hold one bar ------------------------------------------------------------

OFF = 1.2e-3
MIDDLE = np.array([0.1, 0.2, 0.5, 0.3, 0.6, 0.1, 0.1, 0.15, 0.4, -0.2, 0.8, 0.3])
FOOT = np.eye(4)
FOOT[:3, :3], FOOT[:3, 3] = np.diag([-1.0, -1.0, 1.0]), [1.3, 0.1, 0.0]


def between(q, zeros):
    """Return the right hand as the left one has it, (M, 4, 4)."""
    left, right = flange(q[:, :6], zeros), flange(q[:, 6:], np.zeros(6))
    return np.linalg.inv(FOOT @ left) @ right


def grips(rng, zeros, count):
    """Return joints of both arms (M, 12) at which the real hands hold the bar."""
    back = np.linalg.inv(between(MIDDLE[None], zeros))
    left = MIDDLE[:6] + rng.uniform(-0.5, 0.5, (2 * count, 6))

    def off(right):
        away = back @ between(np.hstack([left, right]), zeros)
        turn = Rotation.from_matrix(away[:, :3, :3]).as_rotvec()
        return np.hstack([away[:, :3, 3], 0.3 * turn])

    right = np.tile(MIDDLE[6:], (2 * count, 1))
    for _ in range(15):
        slope = np.stack([(off(right + e) - off(right)) / 1e-6 for e in 1e-6 * np.eye(6)], axis=-1)
        step = np.einsum('nij,nj->ni', np.linalg.pinv(slope), -off(right))
        right += step * np.minimum(1.0, 0.3 / np.abs(step).max(axis=1, keepdims=True).clip(1e-9))
    held = np.abs(off(right)).max(axis=1) < 1e-9
    assert held.sum() >= count
    return np.hstack([left, right])[held][:count]


def test_a_bar_clamped_in_both_hands_shows_the_joint_whose_zero_is_off(tmp_path):
    rng, zeros = np.random.default_rng(6), np.zeros(6)
    zeros[2] = OFF
    q = grips(rng, zeros, 40) + rng.normal(0.0, 1.5e-5, (40, 12))
    names = [f'{side}{k}' for side in 'lr' for k in range(1, 7)]
    lines = [','.join(names), *(','.join(f'{value:.7f}' for value in row) for row in q)]
    (tmp_path / 'grips.csv').write_text('\n'.join(lines) + '\n')
    foot = {'xyz': FOOT[:3, 3].tolist(), 'quat_xyzw': [0.0, 0.0, 1.0, 0.0]}
    pair = {'name': 'pair', 'joints': joints_called(names[6:])}
    pair['workpiece'] = {'base': foot, 'joints': joints_called(names[:6])}
    (tmp_path / 'pair.yaml').write_text(yaml.safe_dump(pair))
    robot, bag = ('--robot', tmp_path / 'pair.yaml'), tmp_path / 'bag'
    said = weld_twin('import', tmp_path / 'grips.csv', '--clamped', *robot, '--out', bag).out
    assert '40 postures with one bar clamped at both ends' in said
    found = found_in(tmp_path / 'out', bag, *robot, '--align', 'tool', *OTHERS)['verdict']
    assert found['status'] in ('identified', 'ambiguous')
    (one,) = [e for e in found['effects'] if (e['effect'], e['joint']) == ('joint_offset', 'l3')]
    assert one['parameters']['offset'] == pytest.approx(OFF, abs=5e-5)


PLACES = {
    'low a': [0.45, 0.1, 0.2],
    'low b': [0.45, 0.15, 0.2],
    'high a': [-0.1, 0.5, 0.4],
    'high b': [-0.05, 0.5, 0.4],
}
EACH = 12


@pytest.fixture(scope='module')
def touches(tmp_path_factory):
    """Return a directory with a URDF, and touches of an arm whose elbow stands 2 mrad off."""
    folder, rng = tmp_path_factory.mktemp('cell'), np.random.default_rng(5)
    tool = np.eye(4)
    tool[:3, 3] = [0.02, 0.03, 0.12]
    robot = wt.load('ur5').with_frames(tool=tool)
    write_urdf(folder / 'cell.urdf', robot)
    real = replace(robot, theta=robot.theta + 0.002 * (np.arange(6) == 2))
    rows = [','.join((*robot.joint_names, 'contact'))]
    for label, place in PLACES.items():
        found, good = reaching(real, np.tile(place, (80, 1)), rng.uniform(-2.0, 2.0, (80, 6)))
        for q in found[good][:EACH]:
            rows.append(','.join((*(f'{v:.7f}' for v in q + rng.normal(0.0, 3e-5, 6)), label)))
    (folder / 'touches.csv').write_text('\n'.join(rows) + '\n')
    (folder / 'artefact.yaml').write_text(
        'contacts: {low a: point, low b: point, high a: point, high b: point}\n'
        'distances:\n  - {between: [low a, low b], value: 0.05, sigma: 0.0001}\n'
        '  - {between: [high a, high b], value: 0.05, sigma: 0.0001}\n'
    )
    return folder


def test_touches_become_a_corrected_urdf(touches):
    urdf = ('--robot', str(touches / 'cell.urdf'))
    artefact = ('--contacts', str(touches / 'artefact.yaml'))
    bag, out = str(touches / 'bag'), touches / 'out'
    told = weld_twin('import', str(touches / 'touches.csv'), *artefact, *urdf, '--out', bag).out
    rows = [row.split(',') for row in (touches / 'touches.csv').read_text().splitlines()[1:]]
    q = np.array([row[:6] for row in rows if row[6] == 'low a'], dtype=float)
    points = forward(load_robot(touches / 'cell.urdf'), q)[:, :3, 3]
    off = 1e3 * np.linalg.norm(points - points.mean(axis=0), axis=1).mean()
    assert f'low a: nominal twin {off:.3f} mm off on average' in told
    said = weld_twin('diagnose', bag, *urdf, '--out', str(out)).out
    assert 'mm from what it touched on average' in ' '.join(said.split())

    found = json.loads((out / 'diagnosis.json').read_text())
    named = [(item['effect'], item['joint']) for item in found['verdict']['effects']]
    assert named == [('joint_offset', 'elbow_joint')]
    contacts = found['contacts']
    assert contacts['spread_before_m'] > 5 * contacts['held_out_spread_m']
    assert contacts['held_out_spread_m'] < 1e-4
    assert [item['between'] for item in contacts['distances']] == [
        ['low a', 'low b'],
        ['high a', 'high b'],
    ]
    assert 'where the base stands' in contacts['not_seen']
    assert 'joint offset of shoulder_pan_joint' in '; '.join(contacts['not_seen'])
    corrected = load_robot(out / 'robot.urdf')
    assert corrected.theta[2] - load_robot(touches / 'cell.urdf').theta[2] == pytest.approx(
        0.002, abs=1e-4
    )
    assert 'id="contacts"' in (out / 'report.html').read_text()
    again = weld_twin('export', out / 'diagnosis.json', *urdf, '--format', 'urdf')
    names = re.compile(r'<(?:link|joint) name="([^"]+)"')
    assert set(names.findall(again.out)) == set(names.findall((touches / 'cell.urdf').read_text()))
