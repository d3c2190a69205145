# Copyright 2026 weld_twin contributors
# SPDX-License-Identifier: Apache-2.0
"""The standard interfaces of a cell, over DDS."""

from threading import Timer

import numpy as np
import pytest
from scipy.interpolate import CubicHermiteSpline

from weld_twin_core import JointMotion, forward, load
from weld_twin_msgs_py.messages import from_messages
from weld_twin_msgs_py.messages.topics import (
    JOINT_STATES,
    JOINT_TRAJECTORY,
    MEASURED_POSE,
    PATH,
    ROBOT_DESCRIPTION,
    TWIN_POSE,
)
from weld_twin_msgs_py.robots import write_urdf
from weld_twin_nodes.harness import Cell
from weld_twin_nodes.harness.cell import HealthListener
from weld_twin_nodes.live.compensator import WITHDRAWN, Compensator
from weld_twin_nodes.live.deviation_analyzer import DeviationAnalyzer
from weld_twin_nodes.live.deviation_markers import DeviationMarkers
from weld_twin_nodes.live.forward_kinematics_twin import ForwardKinematicsTwin
from weld_twin_nodes.live.telling_node import HEALTH_EVERY
from weld_twin_nodes.live.trajectory_generator import TrajectoryGenerator

pytestmark = pytest.mark.cells

S = 1_000_000_000
Q = np.array([0.1, -1.2, 1.5, -1.8, -1.5, 0.3])


@pytest.fixture(scope='module')
def shared(tmp_path_factory):
    with Cell(tmp_path_factory.mktemp('cell')) as cell:
        yield cell


@pytest.fixture
def run(shared):
    """Put a node into the shared cell for one test."""
    nodes = []

    def add(make, **parameters):
        nodes.append(shared.add(make, reliable_inputs=True, **parameters))
        return nodes[-1]

    yield add
    for node in nodes:
        shared.remove(node)


def until_heard(cell, publisher, message_of, tap, what):
    """Publish again and again until something comes back: discovery takes its time."""
    count = [0]

    def told():
        count[0] += 1
        publisher.publish(message_of(count[0]))
        return len(tap) > 0

    cell.wait(told, what)


def test_another_robot_told_while_nodes_run_is_told_and_nothing_is_corrected(
    shared, run, tmp_path
):
    texts = {}
    for name in ('ur5', 'ur10'):
        write_urdf(tmp_path / f'{name}.urdf', load(name))
        texts[name] = ROBOT_DESCRIPTION.message_class()(
            data=(tmp_path / f'{name}.urdf').read_text()
        )
    row, topic = ROBOT_DESCRIPTION, '/elsewhere'
    latched = shared.node.create_publisher(row.message_class(), topic, row.offered.to_rclpy())
    Timer(
        1.5 * HEALTH_EVERY, latched.publish, [texts['ur5']]
    ).start()  # a node waits for its robot
    node = run(ForwardKinematicsTwin, robot=topic)
    model = tmp_path / 'model.yaml'
    model.write_text('[{effect: joint_offset, joint: elbow_joint, offset: 1e-3}]')
    corrects = run(Compensator, robot=topic, model=str(model), managed=False)
    health, before = HealthListener(shared.node), node.robot
    latched.publish(texts['ur10'])
    said, own = f'another robot is told on {topic} now', '/forward_kinematics_twin'
    shared.wait(lambda: any(said in text for _, text in health.told[own]), said)
    assert node.robot is before
    withdrawn = corrects.health.lasting
    shared.wait(lambda: said in withdrawn.get(WITHDRAWN, ''), 'nothing to be corrected')
    latched.publish(texts['ur5'])
    shared.wait(lambda: WITHDRAWN not in withdrawn, 'the model to be used again')
    shared.wait(lambda: health.told[own][-1:] == [('ok', 'running')], 'the first robot again')


def trajectory(robot):
    t = np.array([0.0, 0.4, 1.0])
    q = Q + np.outer([0.0, 0.1, 0.3], np.arange(1.0, 7.0)) * 0.2
    qd = np.outer([0.0, 0.2, 0.0], np.ones(6))
    return JointMotion(t, q, qd)


def generator_of(run, source):
    return run(
        TrajectoryGenerator,
        source=source,
        rate=100.0,
        start_stamp_ns=S,
        playback=0.0,
        wait_for_subscribers=1,
    )


def test_a_joint_trajectory_is_run_by_cubics_through_its_points(shared, run, robot):
    node, motion = generator_of(run, 'joint_trajectory'), trajectory(robot)
    states = shared.collect(JOINT_STATES.name)
    names = robot.joint_names[::-1]
    turned = JointMotion(motion.t, motion.q[:, ::-1], motion.qd[:, ::-1])
    until_heard(
        shared,
        shared.publisher(JOINT_TRAJECTORY),
        lambda _: shared.messages.joint_trajectory(S, names, turned),
        states,
        'a joint state',
    )
    shared.wait(lambda: len(states) >= 101, 'the whole motion')
    t = (states.stamps[:101] - S) * 1e-9
    np.testing.assert_allclose(t, np.arange(101) * 0.01, atol=1e-9)
    expected = CubicHermiteSpline(motion.t, motion.q, motion.qd)(t)
    got = [from_messages.joint_positions(m, robot.joint_names) for m in states.messages[:101]]
    np.testing.assert_allclose(got, expected, rtol=0.0, atol=1e-9)
    assert node.done


def test_a_path_is_planned_and_run_and_the_plan_is_told_to_latecomers(shared, run, robot):
    generator_of(run, 'path')
    start = forward(robot, Q)
    points = start[:3, 3] + np.outer(np.linspace(0.0, 1.0, 5), [0.0, 0.08, 0.0])
    frames = np.tile(start, (5, 1, 1))
    frames[:, :3, 3] = points
    states = shared.collect(JOINT_STATES.name)
    until_heard(
        shared,
        shared.publisher(PATH),
        lambda _: shared.messages.path(S, frames),
        states,
        'a joint state',
    )
    planned = shared.collect('/planned/path')
    trajectories = shared.collect('/planned/joint_trajectory')
    shared.wait(lambda: len(planned) > 0 and len(trajectories) > 0, 'the plan')
    way = from_messages.path_points(planned.last)
    np.testing.assert_allclose(way[[0, -1]], points[[0, -1]], atol=1e-6)
    np.testing.assert_allclose(way[:, [0, 2]], points[:1, [0, 2]].repeat(len(way), 0), atol=1e-6)
    told = from_messages.joint_trajectory(trajectories.last, robot.joint_names)
    np.testing.assert_allclose(forward(robot, told.q)[:, :3, 3], way, atol=1e-9)


def test_markers_show_the_deviation_where_it_is(shared, run):
    run(DeviationAnalyzer)
    run(DeviationMarkers, every=0.05, magnification=100.0)
    twin, measured = shared.publisher(TWIN_POSE), shared.publisher(MEASURED_POSE)
    pictures, make = shared.collect('/deviation/markers'), shared.messages

    def told():
        told.count += 1
        place, off = np.array([0.01 * told.count, 0.2, 0.3]), np.array([0.0, 1e-3, 0.0])
        twin.publish(make.pose(told.count * S, place, np.eye(3)))
        measured.publish(make.pose(told.count * S, place + off, np.eye(3)))
        return len(pictures) > 0

    told.count = 0
    shared.wait(told, 'a picture')
    seam, strokes = pictures.last.markers
    assert (seam.ns, strokes.ns) == ('seam', 'deviation')
    begin, end = strokes.points[0], strokes.points[1]
    np.testing.assert_allclose([begin.y, end.y], [0.2, 0.3], atol=1e-9)
