# Copyright 2026 weld_twin contributors
# SPDX-License-Identifier: Apache-2.0
"""Cells: a robot on a track beside a positioner, and errors that only such cells have."""

import numpy as np
import pytest
import yaml
from scipy.spatial.transform import Rotation

from weld_twin_core import forward, gravity_torque
from weld_twin_core.arm.robot import Robot
from weld_twin_core.effects import effect_from_mapping, effects_from_list
from weld_twin_core.errors import ModelError
from weld_twin_core.recording import JointMotion, Recording
from weld_twin_core.twin.compensation import corrected
from weld_twin_core.twin.twin import Twin

G = 9.80665
CELL = """
name: cell
base: {xyz: [0.0, -0.5, 0.3]}
tool: {xyz: [0.02, 0.0, 0.3]}
joints:
- {name: track, type: prismatic, alpha: -1.5707963267948966, lower: -2.0, upper: 2.0}
- {name: shoulder, a: 0.2, d: 0.4, alpha: 1.5707963267948966}
- {name: elbow, a: 0.7}
- {name: wrist, a: 0.1, d: 0.2, alpha: 1.2}
links:
- {mass: 300.0, com: [0.0, 0.1, 0.0]}
- {mass: 50.0, com: [0.1, 0.0, 0.1]}
- {mass: 30.0, com: [-0.3, 0.0, 0.0]}
- {mass: 8.0, com: [0.0, 0.0, 0.05]}
payload: {mass: 5.0, com: [0.0, 0.0, 0.1]}
workpiece:
  base: {xyz: [1.5, 0.2, 0.6], quat_xyzw: [0.0, 0.7071067811865476, 0.0, 0.7071067811865476]}
  tool: {xyz: [0.05, 0.0, 0.1], quat_xyzw: [0.0, 0.0, 0.6, 0.8]}
  joints:
  - {name: tilt, a: 0.1, d: 0.15, alpha: -1.5707963267948966, lower: -2.0, upper: 2.0}
  - {name: turn, d: 0.12, theta_offset: 0.4}
  links:
  - {mass: 100.0, com: [0.02, 0.0, 0.01]}
  - {mass: 40.0, com: [0.03, -0.02, 0.0]}
  payload: {mass: 20.0, com: [0.0, 0.0, 0.05]}
"""
"""Gravity is not told, so it pulls along -z of the base, which stands upright: along the track."""


@pytest.fixture
def cell():
    return Robot.from_mapping(yaml.safe_load(CELL))


def still(q):
    return Recording('still', JointMotion(np.arange(float(len(q))), q, static=True))


def postures(cell, count=30):
    return np.random.default_rng(3).uniform(-1.2, 1.2, (count, cell.n))


def step(axis, turn=0.0, slide=0.0):
    out = np.eye(4)
    out[:3, :3] = Rotation.from_rotvec(turn * np.eye(3)['xyz'.index(axis)]).as_matrix()
    out['xyz'.index(axis), 3] = slide
    return out


def stood(frame):
    out = np.eye(4)
    out[:3, :3] = Rotation.from_quat(frame.get('quat_xyzw', [0, 0, 0, 1])).as_matrix()
    out[:3, 3] = frame['xyz']
    return out


def branch(chain, values, after=None):
    """Return where the tool of a chain stands in the world, row by row as the file has them."""
    pose = stood(chain['base'])
    for row in chain['joints']:
        slides, value = row.get('type') == 'prismatic', values[row['name']]
        pose = pose @ step('z', row.get('theta_offset', 0.0) + (0.0 if slides else value))
        pose = pose @ step('z', slide=row.get('d', 0.0) + (value if slides else 0.0))
        if after and row['name'] == after[0]:
            pose = pose @ after[1](value)
        pose = pose @ step('x', slide=row.get('a', 0.0)) @ step('x', row.get('alpha', 0.0))
    return pose @ stood(chain['tool'])


def seen(cell, q, after=None, foot=None):
    """Return the tool in the frame of the workpiece, with what an error does behind a joint."""
    data = yaml.safe_load(CELL)
    out = []
    for row in q:
        values = dict(zip(cell.joint_names, row, strict=True))
        table = branch(data['workpiece'], values, after)
        table = table if foot is None else foot @ table
        out.append(np.linalg.inv(table) @ branch(data, values, after))
    return np.array(out)


def test_the_joints_of_the_workpiece_come_first_and_the_pose_is_that_of_two_chains(cell):
    assert cell.joint_names == ('turn', 'tilt', 'track', 'shoulder', 'elbow', 'wrist')
    q = postures(cell)
    np.testing.assert_allclose(forward(cell, q), seen(cell, q), atol=1e-13)


def test_what_hangs_on_the_tool_loads_no_joint_of_the_positioner(cell):
    q = postures(cell)
    light = yaml.safe_load(CELL)
    light['payload']['mass'] = 0.0
    light['links'][2]['mass'] = 0.0
    before, after = gravity_torque(cell, q), gravity_torque(Robot.from_mapping(light), q)
    np.testing.assert_array_equal(before[:, :2], after[:, :2])
    assert np.abs(before[:, 2:] - after[:, 2:]).max() > 1.0
    extra = effect_from_mapping({'effect': 'payload', 'mass': 9.0, 'com': [0.1, 0.0, 0.2]})
    spring = effect_from_mapping(
        {'effect': 'joint_compliance', 'joint': 'tilt', 'compliance': 1e-4}
    )
    alone, both = (Twin(cell, e).poses(still(q)) for e in ([spring], [spring, extra]))
    np.testing.assert_allclose(alone.position, both.position, atol=1e-15)


@pytest.mark.parametrize('links', [True, False])
def test_a_workpiece_on_its_side_loads_the_tilt_by_its_weight_and_lever(links):
    # At zero the tilt axis is level, along x of the world; weights stand off it along its row.
    whole = yaml.safe_load(CELL)
    data = whole['workpiece']
    own = data['links'] if links else [{'mass': 0.0, 'com': [0.0, 0.0, 0.0]}] * 2
    if not links:
        del data['links'], whole['links']
    cell = Robot.from_mapping(whole)
    q = np.zeros((1, cell.n))
    torque = gravity_torque(cell, q)[0, 1]
    work, lever = 0.0, 1e-6
    for sign in (1.0, -1.0):
        pose, energy = stood(data['base']), 0.0
        for k, row in enumerate(data['joints']):
            angle = row.get('theta_offset', 0.0) + (sign * lever if k == 0 else 0.0)
            pose = pose @ step('z', angle) @ step('z', slide=row['d'])
            pose = pose @ step('x', slide=row.get('a', 0.0)) @ step('x', row.get('alpha', 0.0))
            energy += G * own[k]['mass'] * (pose @ [*own[k]['com'], 1.0])[2]
        load = pose @ stood(data['tool']) @ step('z', slide=0.05)
        energy += G * 20.0 * load[2, 3]
        work -= sign * energy / (2.0 * lever)
    assert torque == pytest.approx(work, rel=1e-6)
    assert abs(torque) > 10.0


def test_a_root_that_is_off_moves_the_positioner_along_the_axes_of_the_base(cell):
    q, xyz, rotvec = postures(cell), [1e-3, -2e-3, 3e-3], [2e-3, 1e-3, -3e-3]
    error = effect_from_mapping({'effect': 'root_pose', 'xyz': xyz, 'rotvec': rotvec})
    data = yaml.safe_load(CELL)
    base, foot = stood(data['base']), stood(data['workpiece']['base'])
    there = np.linalg.inv(base) @ foot
    turned = np.array(there)
    turned[:3, :3] = Rotation.from_rotvec(rotvec).as_matrix() @ there[:3, :3]
    turned[:3, 3] += xyz
    expected = seen(cell, q, foot=base @ turned @ np.linalg.inv(foot))
    poses = Twin(cell, [error]).poses(still(q))
    np.testing.assert_allclose(poses.position, expected[:, :3, 3], atol=1e-13)
    np.testing.assert_allclose(poses.rotation, expected[:, :3, :3], atol=1e-13)
    robot, left = corrected(cell, [error])
    again = Robot.from_mapping(robot.to_mapping())
    assert not left
    np.testing.assert_allclose(forward(again, q), expected, atol=1e-13)


GUIDES = {
    'bend': ({'effect': 'guide_bend', 'curvature': [1e-3, -5e-4]},
             lambda s: step('x', slide=5e-4 * s**2) @ step('y', slide=-2.5e-4 * s**2)),
    'roll': ({'effect': 'guide_tilt', 'rate': [2e-4, 0.0, 0.0]}, lambda s: step('x', 2e-4 * s)),
    'pitch': ({'effect': 'guide_tilt', 'rate': [0.0, -3e-4, 0.0]}, lambda s: step('y', -3e-4 * s)),
    'yaw': ({'effect': 'guide_tilt', 'rate': [0.0, 0.0, 3e-4]}, lambda s: step('z', 3e-4 * s)),
}  # fmt: skip


@pytest.mark.parametrize(('entry', 'moves'), GUIDES.values(), ids=GUIDES)
def test_a_guide_moves_its_carriage_and_all_it_carries(cell, entry, moves):
    q = postures(cell)
    poses = Twin(cell, [effect_from_mapping({**entry, 'joint': 'track'})]).poses(still(q))
    expected = seen(cell, q, after=('track', moves))
    # The lever turns by the lean itself: what is left is its square.
    np.testing.assert_allclose(poses.position, expected[:, :3, 3], atol=2e-7)
    np.testing.assert_allclose(poses.rotation, expected[:, :3, :3], atol=2e-7)
    moved = np.linalg.norm(poses.position - forward(cell, q)[:, :3, 3], axis=1)
    assert moved.max() > 1e-4


EVERY = [
    {'effect': 'root_pose', 'xyz': [1e-3, 2e-3, -1e-3], 'rotvec': [1e-2, -2e-2, 3e-2]},
    {'effect': 'guide_bend', 'joint': 'track', 'curvature': [1e-3, -5e-4]},
    {'effect': 'guide_tilt', 'joint': 'track', 'rate': [1e-3, 2e-3, -1e-3]},
    {'effect': 'joint_compliance', 'joint': 'tilt', 'compliance': 1e-5},
    {'effect': 'joint_compliance', 'joint': 'track', 'compliance': 1e-6},
    {'effect': 'backlash', 'joint': 'track', 'width': 1e-3},
    {'effect': 'pedestal_tilt', 'compliance': [1e-6, 2e-6]},
]


@pytest.mark.parametrize('entry', EVERY, ids=lambda entry: entry['effect'])
def test_derivatives_by_errors_of_a_cell_are_slopes_of_their_draws(cell, entry):
    recording = still(postures(cell, 12))
    twin = Twin(cell, effects_from_list([entry], cell))
    _, slopes = twin.linearise(recording)
    for k, component in enumerate(twin.components()):
        effect = twin.effects[0]
        places = [(p.name, i) for p, i in effect.components()]
        width = 1e-4 * component.parameter.typical
        drawn = np.tile(effect.vector(), (2, 1))
        drawn[:, places.index((component.parameter.name, component.index))] += [width, -width]
        poses = Twin(cell, (effect.with_vector(drawn),)).poses(recording)
        found = (poses.position[0] - poses.position[1]) / (2.0 * width)
        scale = max(1.0, np.abs(found).max())
        np.testing.assert_allclose(slopes[:, :3, k], found, atol=1e-6 * scale)


@pytest.mark.parametrize(
    ('entry', 'robot', 'sentence'),
    [
        (
            EVERY[0],
            'alone',
            "root_pose is of a positioner, and robot 'cell' has none; use base_pose",
        ),
        (
            {'effect': 'guide_bend', 'joint': 'tilt'},
            'cell',
            "guide_bend is of a joint that slides, and 'tilt' turns",
        ),
    ],
)
def test_errors_that_a_cell_cannot_have_are_refused(entry, robot, sentence):
    data = yaml.safe_load(CELL)
    if robot == 'alone':
        del data['workpiece']
    with pytest.raises(ModelError) as error:
        effects_from_list([entry], Robot.from_mapping(data))
    assert str(error.value) == f'effect 0: {sentence}'


@pytest.mark.parametrize(
    ('change', 'sentence'),
    [
        ({'convention': 'modified'}, 'give both the same convention'),
        ({'joints': [{'name': 'wrist'}], 'links': None}, 'uses a joint name twice'),
        ({'gravity': [0, 0, -9.8]}, "workpiece of robot 'cell' has the unknown key 'gravity'"),
        ({'joints': []}, "robot 'cell, workpiece' needs a list 'joints' in chain order"),
    ],
)
def test_a_workpiece_that_cannot_be_used_is_refused(change, sentence):
    data = yaml.safe_load(CELL)
    data['workpiece'] |= change
    with pytest.raises(ModelError) as error:
        Robot.from_mapping(data)
    assert sentence in str(error.value)
