# Copyright 2026 weld_twin contributors
# SPDX-License-Identifier: Apache-2.0
"""Compensated commands and poses, and constant errors written into the robot, against closed forms."""

import numpy as np
import pytest

from weld_twin_core.arm.catalog import load
from weld_twin_core.arm.chain import forward
from weld_twin_core.arm.robot import Robot
from weld_twin_core.arm.rotation import rotation_matrix
from weld_twin_core.effects import effect_from_mapping
from weld_twin_core.errors import DataError
from weld_twin_core.motion.inverse.newton import polish
from weld_twin_core.motion.paths import default_seam
from weld_twin_core.motion.planned_motion import plan
from weld_twin_core.recording import JointMotion, Recording, Signal
from weld_twin_core.twin.compensation import compensate, corrected, joint_offsets
from weld_twin_core.twin.pose_correction import PoseCorrection, moved
from weld_twin_core.twin.program_model import ProgramModel
from weld_twin_core.twin.twin import Twin


@pytest.fixture(scope='module', params=['ur5', 'franka_panda'])
def robot(request):
    return load(request.param)


def seam(robot, profile='smooth'):
    return Recording('seam', plan(robot, default_seam(robot), profile, fit=True).motion)


def effects(*entries):
    return tuple(effect_from_mapping(entry) for entry in entries)


def geometric(robot):
    j = robot.joint_names
    return effects(
        {'effect': 'joint_offset', 'joint': j[1], 'offset': 2e-3},
        {'effect': 'link_length', 'joint': j[2], 'da': 1e-3},
        {'effect': 'link_offset', 'joint': j[3], 'dd': -1e-3},
        {'effect': 'link_twist', 'joint': j[0], 'dalpha': 2e-3},
        {'effect': 'axis_parallelism', 'joint': j[1], 'dbeta': -1e-3},
        {'effect': 'base_pose', 'xyz': [1e-3, -2e-3, 3e-3], 'rotvec': [1e-3, 2e-3, -1e-3]},
        {'effect': 'tool_pose', 'xyz': [1e-3, 0, 2e-3], 'rotvec': [0, 3e-3, 1e-3]},
    )


def in_numbers(robot):
    """Return the robot with `geometric` written into its file by hand."""
    data = robot.to_mapping()
    rows = data['joints']
    rows[1]['theta_offset'] += 2e-3
    rows[2]['a'] += 1e-3
    rows[3]['d'] -= 1e-3
    rows[0]['alpha'] += 2e-3
    rows[1]['beta'] = rows[1].get('beta', 0.0) - 1e-3
    out = Robot.from_mapping(data)
    base, tool = np.array(robot.T_world_base), np.array(robot.T_flange_tool)
    base[:3, :3] = rotation_matrix([1e-3, 2e-3, -1e-3]) @ base[:3, :3]
    base[:3, 3] += [1e-3, -2e-3, 3e-3]
    tool[:3, 3] += [1e-3, 0, 2e-3]
    tool[:3, :3] = tool[:3, :3] @ rotation_matrix([0, 3e-3, 1e-3])
    return out.with_frames(base=base, tool=tool)


def test_geometric_errors_are_closed(robot):
    recording = seam(robot)
    result = compensate(robot, geometric(robot), recording)
    got = Twin(in_numbers(robot)).poses(Recording('real', result.motion))
    wanted = Twin(robot).poses(recording)
    assert np.abs(got.position - wanted.position).max() < 1e-9
    assert np.abs(got.rotation - wanted.rotation).max() < 1e-9
    assert result.rms[0] > 1e-3


@pytest.mark.parametrize(
    ('name', 'still', 'most'),
    [
        ('ur5', [0.3, -1.2, 1.5, -1.0, 0.0, 0.4], 0.3),
        ('kuka_kr6_r900', [0.3, -1.2, 1.5, 0.4, 0.0, 0.2], 0.01),
    ],
)
def test_beside_a_singular_wrist_the_tool_is_where_it_should_be_and_no_joint_jumps(
    name, still, most
):
    """Three joints place the tool; only a part of its turn is out of reach."""
    arm = load(name)
    bent = np.array([3e-3, 1e-3, 5e-4, 1e-4, 1e-5, 0.0])
    q = np.array(still) + np.outer(bent, np.eye(6)[4])
    recording = Recording('wrist', JointMotion(np.arange(6.0), q, static=True))
    j = arm.joint_names
    acting = effects(
        {'effect': 'link_twist', 'joint': j[2], 'dalpha': 5e-4},
        {'effect': 'joint_offset', 'joint': j[1], 'offset': -5e-4},
        {'effect': 'joint_offset', 'joint': j[3], 'offset': 8e-4},
        {'effect': 'tool_pose', 'xyz': [3e-4, 2e-4, 0.0], 'rotvec': [5e-4, -4e-4, 3e-4]},
    )
    found = compensate(arm, acting, recording)
    (way, turn), (left, askew) = (
        (np.linalg.norm(part, axis=1) for part in np.split(each, 2, axis=1))
        for each in (found.before, found.after)
    )
    assert np.all(left < 0.03 * way) and np.all(askew < turn)
    assert np.abs(found.motion.q - q).max() < most


def test_a_gear_error_is_compensated_in_position_and_speed():
    robot = load('ur5')
    gear = {'effect': 'gear_ratio', 'joint': 'shoulder_pan_joint', 'scale': 1e-3}
    recording = seam(robot)
    result = compensate(robot, effects(gear), recording)
    assert np.abs(result.motion.q[:, 0] - recording.joints.q[:, 0] / 1.001).max() < 1e-9
    speed = recording.joints.qd[:, 0] / 1.001
    assert np.abs(result.motion.qd[5:-5, 0] - speed[5:-5]).max() < 1e-5


def test_springs_under_gravity_and_process_force_are_closed():
    robot = load('ur5')
    soft = [
        {'effect': 'joint_compliance', 'joint': j, 'compliance': 3e-5}
        for j in robot.joint_names[:3]
    ]
    motion = seam(robot).joints
    force = Signal(motion.t[[0, -1]], np.array([[0, 0, 80.0, 0, 0, 0], [40.0, 0, 0, 0, 0, 0]]))
    result = compensate(robot, effects(*soft), Recording('seam', motion, wrench=force))
    assert result.rms[0] > 1e-4 and np.abs(result.after).max() < 1e-9


@pytest.mark.parametrize(
    ('entry', 'gain'),
    [
        ({'effect': 'servo_lag', 'time_constant': 0.02}, 200.0),
        ({'effect': 'backlash', 'width': 1e-3}, 20.0),
    ],
)
def test_effects_with_memory_shrink_by_iteration(entry, gain):
    robot = load('ur5')
    acting = effects({**entry, 'joint': 'shoulder_pan_joint'})
    before, after = compensate(robot, acting, seam(robot, 'aggressive')).rms
    assert before > 1e-4 and after < before / gain


def test_a_resonance_never_makes_it_worse():
    robot = load('ur5')
    shaky = effects(
        {
            'effect': 'vibration',
            'joint': 'shoulder_pan_joint',
            'frequency': 8.0,
            'damping': 0.05,
            'gain': 0.3,
        }
    )
    before, after = compensate(robot, shaky, seam(robot, 'aggressive')).rms
    assert after <= before


def test_errors_of_the_instrument_are_left_alone():
    robot = load('ur5')
    own = effects(
        {'effect': 'time_delay', 'delay': 0.02},
        {'effect': 'measurement_scale', 'scale': 1e-3},
        {'effect': 'drift', 'xyz_rate': [1e-5, 0, 0]},
    )
    recording = seam(robot)
    result = compensate(robot, own, recording)
    assert np.array_equal(result.motion.q, recording.joints.q)
    assert result.left_out == own


def test_stations_are_compensated_one_by_one():
    robot = load('ur5')
    q = np.random.default_rng(0).uniform(-0.4, 0.4, (20, 6)) + [0, -1.2, 1.4, -1.0, -1.5, 0]
    q[7, 4] = 1e-4  # the wrist is stretched here: no small step closes it
    stations = Recording('stations', JointMotion(np.arange(20.0), q, static=True))
    result = compensate(robot, geometric(robot), stations)
    rest = np.arange(20) != 7
    assert result.motion.static and np.abs(result.after[rest]).max() < 1e-9
    assert np.linalg.norm(result.after[7]) <= np.linalg.norm(result.before[7])


def test_constant_errors_go_into_the_numbers_of_the_robot(robot):
    ripple = effects(
        {
            'effect': 'transmission_ripple',
            'joint': robot.joint_names[0],
            'amplitude': 1e-4,
            'order': 2.0,
        }
    )
    got, left = corrected(robot, geometric(robot) + ripple)
    wanted = in_numbers(robot)
    for key in ('a', 'alpha', 'd', 'theta', 'beta', 'T_world_base', 'T_flange_tool'):
        assert np.allclose(getattr(got, key), getattr(wanted, key), atol=1e-12), key
    assert left == ripple
    assert joint_offsets(robot, geometric(robot))[1] == 2e-3


def test_the_offset_of_a_slide_goes_into_its_travel():
    data = load('ur5').to_mapping()
    data['joints'][0] |= {'type': 'prismatic'}
    robot = Robot.from_mapping(data)
    error = effects({'effect': 'joint_offset', 'joint': robot.joint_names[0], 'offset': 1e-3})
    got, _ = corrected(robot, error)
    assert got.d[0] == pytest.approx(robot.d[0] + 1e-3) and np.array_equal(got.theta, robot.theta)


def test_a_payload_is_joined_with_the_one_declared():
    data = load('ur5').to_mapping() | {'payload': {'mass': 2.0, 'com': [0.0, 0.0, 0.1]}}
    robot = Robot.from_mapping(data)
    more = effects({'effect': 'payload', 'mass': 1.0, 'com': [0.3, 0.0, 0.1]})
    got, left = corrected(robot, more)
    assert got.payload_mass == 3.0 and left == ()
    assert got.payload_com == pytest.approx([0.1, 0.0, 0.1])


UR5 = load('ur5')
CAUSES = (
    {'effect': 'joint_offset', 'joint': 'elbow_joint', 'offset': 6e-4},
    {'effect': 'link_twist', 'joint': 'shoulder_pan_joint', 'dalpha': 5e-4},
    {'effect': 'backlash', 'joint': 'elbow_joint', 'width': 5e-4},
)


def real_arm():
    data = UR5.to_mapping()
    data['joints'][2]['theta_offset'] += 6e-4
    data['joints'][0]['alpha'] += 5e-4
    return Robot.from_mapping(data)


def correction():
    model = ProgramModel(UR5, tuple(effect_from_mapping(cause) for cause in CAUSES))
    return PoseCorrection(model, UR5.T_flange_tool)


def test_a_pose_is_taken_to_where_the_real_tool_is_where_it_was_meant():
    q = np.array([0.1, -1.2, 1.5, -1.8, -1.5, 0.3])
    (meant,) = forward(UR5, q[None])
    looked = correction().first(meant, q + 0.05)
    (joints,), left = polish(UR5, q[None], moved(meant, looked.added)[None])
    assert np.abs(left).max() < 1e-12
    np.testing.assert_allclose(forward(real_arm(), joints[None])[0], meant, atol=1e-9)
    assert np.linalg.norm(looked.added[:3]) > 1e-4


def test_a_stream_adds_what_compensate_does_for_an_arm_that_sags_and_ripples():
    entries = (
        {'effect': 'joint_compliance', 'joint': 'shoulder_lift_joint', 'compliance': 8e-6},
        {'effect': 'transmission_ripple', 'joint': 'elbow_joint', 'amplitude': 4e-4, 'order': 3.0},
        {'effect': 'link_length', 'joint': 'elbow_joint', 'da': 3e-4},
    )
    model = ProgramModel(UR5, tuple(effect_from_mapping(entry) for entry in entries))
    whole = plan(UR5, default_seam(UR5, 'weave'), rate_hz=250.0).motion
    motion = JointMotion(whole.t[:600], whole.q[:600])
    meant = forward(UR5, motion.q)
    expected = forward(UR5, compensate(UR5, model.effects, Recording('weave', motion)).motion.q)
    found, waited = PoseCorrection(model, UR5.T_flange_tool), 0
    found.adopt(found.first(meant[0], motion.q[0]))
    for pose, wanted in zip(meant, expected, strict=True):
        added, far = found.added(pose)
        waited += far > 2.0
        np.testing.assert_allclose(moved(pose, added), wanted, rtol=0.0, atol=2e-9)
        if far > 0.7:
            found.adopt(found.exact(pose))
            looked = moved(pose, found.looked.added)
            np.testing.assert_allclose(looked, wanted, rtol=0.0, atol=1e-9)
    assert waited == 0
    assert np.abs(expected - meant)[:, :3, 3].max() > 1e-4


def test_play_is_told_as_left_and_a_pose_out_of_reach_is_said():
    found = correction()
    assert found.left_out == ['backlash']
    q = np.array([0.1, -1.2, 1.5, -1.8, -1.5, 0.3])
    far = forward(UR5, q[None])[0]
    far[0, 3] += 3.0
    with pytest.raises(DataError, match='cannot be reached'):
        found.first(far, q)
