# Copyright 2026 weld_twin contributors
# SPDX-License-Identifier: Apache-2.0
"""Frames of the cell: where the base is, in which frame measurements come, and what is refused."""

import numpy as np
import pytest

from weld_twin_core import ModelError, forward, load
from weld_twin_core.arm.rotation import quaternion_from_matrix, rotation_matrix, transform
from weld_twin_msgs_py.messages import from_messages
from weld_twin_msgs_py.messages.topics import MEASURED_POINT, MEASURED_POSE, TWIN_BASE, TWIN_POSE
from weld_twin_nodes.harness.cell import HealthListener
from weld_twin_nodes.live.deviation_analyzer import DeviationAnalyzer
from weld_twin_nodes.live.forward_kinematics_twin import ForwardKinematicsTwin
from weld_twin_nodes.live.robot_settings import frame_from

S = 1_000_000_000
ROBOT = load('ur5')
Q = np.array([0.1, -1.2, 1.5, -1.8, -1.5, 0.3])
TURN = np.array([0.1, -0.2, 0.9])
PLACE = np.array([1.5, -0.4, 0.8])
T = transform(rotation_matrix(TURN), PLACE)
OFF = np.array([1e-3, 2e-3, -3e-3])


def test_a_frame_is_six_or_seven_numbers():
    np.testing.assert_allclose(frame_from([*PLACE, *TURN]), T, atol=1e-15)
    quaternion = quaternion_from_matrix(rotation_matrix(TURN))
    np.testing.assert_allclose(frame_from([*PLACE, *quaternion]), T, atol=1e-15)


@pytest.mark.parametrize(
    ('values', 'sentence'),
    [
        ([1.0, 2.0], 'takes 6 numbers, x y z and a rotation vector, or 7'),
        ([0.0] * 5 + [float('nan')], 'takes 6 numbers'),
        ([0.0] * 7, 'T_measuring_base 0 has length 0, a rotation needs 1'),
    ],
)
def test_what_is_no_frame_is_refused_in_a_sentence(values, sentence):
    with pytest.raises(ModelError, match=sentence):
        frame_from(values)


def told(health, node, key):
    return health.values.get(node, {}).get(key, '')


def test_poses_are_in_the_measuring_frame_and_deviations_in_the_axes_of_the_base(cell):
    """The analyzer is not told where the base is: it hears it from the twin."""
    cell.add(
        ForwardKinematicsTwin,
        reliable_inputs=True,
        measuring_frame='tracker',
        T_measuring_base=[*PLACE, *TURN],
    )
    cell.add(DeviationAnalyzer, reliable_inputs=True, base_frame='left_base')
    poses, deviations = cell.collect(TWIN_POSE.name), cell.collect('/deviation')
    bases = cell.collect(TWIN_BASE.name)
    states, measured = cell.publisher(), cell.publisher(MEASURED_POSE)
    cell.wait(lambda: len(bases) > 0, 'the base')
    np.testing.assert_allclose(from_messages.pose(bases.last)[0], PLACE, atol=1e-15)
    expected = T @ forward(ROBOT, Q)
    count = [0]

    def step():
        count[0] += 1
        stamp = count[0] * S
        states.publish(cell.messages.joint_state(stamp, ROBOT.joint_names, Q))
        measured.publish(
            cell.messages.pose(
                stamp, expected[:3, 3] + T[:3, :3] @ OFF, expected[:3, :3], 'tracker'
            )
        )
        return len(deviations) > 2

    cell.wait(step, 'deviations')
    assert poses.last.header.frame_id == 'tracker'
    np.testing.assert_allclose(from_messages.pose(poses.last)[0], expected[:3, 3], atol=1e-12)
    assert deviations.last.header.frame_id == 'left_base'
    np.testing.assert_allclose(from_messages.vector3(deviations.last), OFF, atol=1e-12)


def feed_pairs(cell, poses, points):
    """Publish twin poses and points that are OFF from them, all in the tracker's axes."""
    for k in range(1, 5):
        poses.publish(cell.messages.pose(k * S, PLACE, T[:3, :3], 'tracker'))
        points.publish(cell.messages.point(k * S, PLACE + T[:3, :3] @ OFF, 'tracker'))


def test_no_deviation_is_told_in_the_wrong_axes_before_the_base_is_known(cell):
    node = cell.add(DeviationAnalyzer, reliable_inputs=True)
    bases = cell.publisher(TWIN_BASE)
    deviations = cell.collect('/deviation')
    feed_pairs(cell, cell.publisher(TWIN_POSE), cell.publisher(MEASURED_POINT))
    cell.wait(lambda: node.waiting_for_base == 4, 'pairs that wait')
    assert len(deviations) == 0
    bases.publish(cell.messages.pose(0, PLACE, T[:3, :3], 'tracker'))
    cell.wait(lambda: len(deviations) == 4, 'all that waited')
    for message in deviations.messages:
        np.testing.assert_allclose(from_messages.vector3(message), OFF, atol=1e-12)


def test_where_nobody_tells_the_base_it_is_where_the_robot_has_it(cell):
    cell.add(DeviationAnalyzer, reliable_inputs=True)
    health, deviations = HealthListener(cell.node), cell.collect('/deviation')
    feed_pairs(cell, cell.publisher(TWIN_POSE), cell.publisher(MEASURED_POINT))
    cell.wait(lambda: len(deviations) == 4, 'deviations')
    axes = ROBOT.T_world_base[:3, :3].T
    np.testing.assert_allclose(
        from_messages.vector3(deviations.last), axes @ T[:3, :3] @ OFF, atol=1e-12
    )
    said = '/twin/base_pose: nothing heard; the base is taken to be where the robot has it'
    cell.wait(lambda: said in health.values.get('/deviation_analyzer', {}).values(), said)


def test_the_first_frame_is_taken_and_named_and_another_one_refused(cell):
    cell.add(DeviationAnalyzer, reliable_inputs=True)
    health, points = HealthListener(cell.node), cell.publisher(MEASURED_POINT)
    points.publish(cell.messages.point(S, OFF, 'tracker'))
    said = "measurements are given in 'tracker'; it is taken for the measuring frame"
    cell.wait(lambda: said == told(health, '/deviation_analyzer', 'remark_0'), 'the frame')
    key = '/deviation_analyzer: /measured/tool_point'
    points.publish(cell.messages.point(2 * S, OFF, 'tracker_2'))
    cell.wait(
        lambda: "'tracker_2', those before it in 'tracker'" in told(health, key, 'last_reason'),
        'it',
    )
    assert told(health, key, 'refused') == '1'


def test_measurements_in_another_frame_than_the_one_set_are_refused(cell):
    cell.add(DeviationAnalyzer, reliable_inputs=True, measuring_frame='world')
    health, points = HealthListener(cell.node), cell.publisher(MEASURED_POINT)
    key = '/deviation_analyzer: /measured/tool_point'
    said = "given in 'tracker', but measuring_frame is 'world', and the way from 'tracker' to"
    sent = [0]

    def refused():
        """Go on publishing: a stream that fell silent is told as that."""
        sent[0] += 1
        points.publish(cell.messages.point(sent[0] * S, OFF, 'tracker'))
        return any(
            level == 'error' and 'refused: ' in text and said in text
            for level, text in health.told.get(key, ())
        )

    cell.wait(refused, 'the refusal')
    assert said in told(health, key, 'last_reason')
