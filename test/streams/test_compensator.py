# Copyright 2026 weld_twin contributors
# SPDX-License-Identifier: Apache-2.0
"""
The compensator as a process between a planner and a controller, over DDS.

The arm it works for has a zero of its elbow that is off; where its tool really goes is worked out
with that zero written into the robot file by hand.
"""

from __future__ import annotations

import json
import time

import numpy as np
import pytest

pytest.importorskip('rclpy', reason='needs ROS 2')

from lifecycle_msgs.msg import Transition
from lifecycle_msgs.srv import ChangeState
from rclpy.action import ActionClient
from std_msgs.msg import String

from weld_twin_core.arm.catalog import load
from weld_twin_core.arm.chain import forward
from weld_twin_core.arm.robot import Robot
from weld_twin_core.errors import TwinError
from weld_twin_core.recording import JointMotion
from weld_twin_core.twin.domain import Domain
from weld_twin_core.twin.posterior import Directions, Discrepancy, Posterior, as_dict
from weld_twin_lab.campaigns.building.message_packages import messages_importable
from weld_twin_msgs_py.messages import from_messages
from weld_twin_msgs_py.messages.topics import AUDIT, CORRECTION, DEVIATION, POSE_IN, POSE_OUT
from weld_twin_nodes.harness import Cell

pytestmark = pytest.mark.cells

ROBOT = load('ur5')
NAMES = list(ROBOT.joint_names)
HOME = np.array([0.1, -1.2, 1.5, -1.8, -1.5, 0.3])
OFF = 6e-4
"""How far the elbow really stands from its reading [rad]."""


def real_arm():
    data = ROBOT.to_mapping()
    data['joints'][2]['theta_offset'] += OFF
    return Robot.from_mapping(data)


def write_model(path, off=OFF):
    domain = Domain(NAMES, tuple(((q - 0.4, q + 0.4),) for q in HOME), (0.02,) * 6, (True,) * 6)
    rest = Discrepancy(2e-5, 1e-6, np.zeros(6), np.zeros(6), 1.0)
    known = Posterior(Directions((), 1, ()), np.zeros(0), np.zeros((0, 0)), rest, domain)
    content = {
        'schema': 'weld_twin/diagnosis/1',
        'shrink': {'rms_after_m': 3e-5},
        'model': {
            'tool': ROBOT.T_flange_tool.tolist(),
            'bases': [ROBOT.T_world_base.tolist()],
            'known': [],
            'found': [{'effect': 'joint_offset', 'joint': NAMES[2], 'offset': off}],
        },
        'posterior': as_dict(known),
    }
    path.write_text(json.dumps(content))


def sway(span=1.0, count=26, size=0.2, begin=HOME):
    t = np.linspace(0.0, span, count)
    way = np.sin(0.5 * np.pi * t / span)[:, None] ** 2
    rate = (0.5 * np.pi / span * np.sin(np.pi * t / span))[:, None]
    return JointMotion(t, begin + size * way * np.ones(6), size * rate * np.ones(6))


class Planner:
    """A planner, a controller and a compensator, and what was heard of it."""

    def __init__(self, cell, model, **parameters):
        from control_msgs.action import FollowJointTrajectory

        from weld_twin_nodes.harness.controller import Controller

        self.cell, self.kind, self.audit = cell, FollowJointTrajectory, []
        self.controller = cell.add(Controller, NAMES, HOME, 4.0)
        self.process = cell.start('compensator', robot='ur5', model=str(model), **parameters)
        cell.node.create_subscription(
            String,
            '/compensator/audit',
            lambda line: self.audit.append(json.loads(line.data)),
            AUDIT.requested.to_rclpy(),
        )
        self.added = []
        cell.node.create_subscription(
            CORRECTION.message_class(),
            '/compensator/correction',
            self.added.append,
            CORRECTION.requested.to_rclpy(),
        )
        self._change = cell.node.create_client(ChangeState, '/compensator/change_state')
        self.client = ActionClient(cell.node, self.kind, '/compensator/follow_joint_trajectory')
        cell.wait(self._change.service_is_ready, 'the transitions')
        cell.wait(self.client.server_is_ready, 'the action')
        cell.meet()

    def go(self, *steps):
        for step in steps:
            number = getattr(Transition, f'TRANSITION_{step.upper()}')
            asked = self._change.call_async(ChangeState.Request(transition=Transition(id=number)))
            self.cell.wait(asked.done, step)
            assert asked.result().success, step

    def goal(self, motion, stamp=0, names=NAMES):
        out = self.kind.Goal()
        out.trajectory = self.cell.messages.joint_trajectory(stamp, names, motion)
        return out

    def send(self, goal, feedback=None):
        """Send a goal; return its handle, and the audit line of it."""
        before = len(self.audit)
        asked = self.client.send_goal_async(goal, feedback)
        self.cell.wait(asked.done, 'the answer to a goal')
        self.cell.wait(lambda: len(self.audit) > before, 'the audit')
        return asked.result(), self.audit[-1]

    def result(self, handle):
        asked = handle.get_result_async()
        self.cell.wait(asked.done, 'the result')
        return asked.result()


@pytest.fixture
def messages():
    try:
        with messages_importable():
            yield
    except TwinError as error:
        pytest.skip(str(error))


@pytest.fixture
def cell(tmp_path, messages):
    with Cell(tmp_path / 'cell') as cell:
        yield cell


def points(goal):
    return np.array([point.positions for point in goal.trajectory.points])


def seen(cell, seconds):
    end = time.monotonic() + seconds
    cell.wait(lambda: time.monotonic() > end, 'a while')


def test_goals_are_corrected_refused_and_passed_through(cell, tmp_path):
    model, audit = tmp_path / 'diagnosis.json', tmp_path / 'audit.jsonl'
    write_model(model)
    planner = Planner(cell, model, apply=True, audit=str(audit))
    controller, motion = planner.controller, sway()

    # Inactive: refused; an order to stop passes all the same.
    handle, line = planner.send(planner.goal(motion))
    assert (handle.accepted, line['verdict']) == (False, 'refused')
    assert 'not active' in line['why']
    stop = planner.kind.Goal()
    stop.trajectory.joint_names = NAMES
    handle, line = planner.send(stop)
    assert handle.accepted
    assert line['verdict'] == 'passed'
    controller.goals.clear()

    # Corrected: the real arm goes where the goal meant; feedback and result come through.
    planner.go('configure', 'activate')
    feedback = []
    handle, line = planner.send(planner.goal(motion), feedback.append)
    assert handle.accepted
    assert (line['verdict'], line['applied']) == ('corrected', True)
    got = points(controller.goals[-1])
    np.testing.assert_allclose(forward(real_arm(), got), forward(ROBOT, motion.q), atol=1e-9)
    assert line['largest_m'] == pytest.approx(line['expected_before_m'], rel=0.5)
    assert line['bound_m'] > line['expected_after_m']
    done = planner.result(handle)
    assert (done.status, done.result.error_string) == (4, '')
    assert len(feedback) > 10
    assert json.loads(audit.read_text().splitlines()[-1]) == line
    cell.wait(lambda: len(planner.added) == motion.t.size, 'a correction of every point')

    # Other order, a track beside the arm, a tolerance, an effort: the track's points are its own.
    order = [3, 0, 5, 1, 4, 2]
    back = JointMotion(motion.t, motion.q[::-1], -motion.velocity[::-1])
    names = ['track', *(NAMES[k] for k in order)]
    wide = JointMotion(
        back.t,
        np.column_stack([back.t, back.q[:, order]]),
        np.column_stack([np.ones(back.t.size), back.velocity[:, order]]),
    )
    handle, line = planner.send(planner.goal(wide, names=names))
    assert handle.accepted, line
    sent = controller.goals[-1]
    assert list(sent.trajectory.joint_names) == names
    np.testing.assert_array_equal(points(sent)[:, 0], back.t)
    arm = points(sent)[:, [1 + order.index(k) for k in range(6)]]
    np.testing.assert_allclose(forward(real_arm(), arm), forward(ROBOT, back.q), atol=1e-9)
    planner.result(handle)

    # Refused, each with its reason, and nothing reaches the controller.
    count = len(controller.goals)
    tight = planner.goal(motion)
    from control_msgs.msg import JointTolerance

    tight.path_tolerance = [JointTolerance(name=NAMES[2], position=OFF / 2)]
    now = cell.node.get_clock().now().nanoseconds
    same_time = planner.goal(motion)
    for point in same_time.trajectory.points:
        point.time_from_start.sec = point.time_from_start.nanosec = 0
    for asked, reason in (
        (tight, 'which tolerates'),
        (planner.goal(motion, stamp=now - 5_000_000_000), 'should have begun'),
        (
            planner.goal(JointMotion(motion.t, motion.q[:, :5]), names=NAMES[:5]),
            "no joint 'wrist_3",
        ),
        (same_time, 'must increase'),
        (planner.goal(sway(begin=HOME + 0.5)), 'outside what was recorded'),
        (planner.goal(sway(span=0.05)), 'the goal itself breaks'),
    ):
        handle, line = planner.send(asked)
        assert not handle.accepted
        assert reason in line['why'], line
    assert len(controller.goals) == count

    # What the controller rejects is rejected.
    controller.accepts = False
    handle, line = planner.send(planner.goal(motion))
    assert (handle.accepted, line['verdict']) == (False, 'rejected by the controller')
    controller.accepts = True

    # Cancelled on the way; one that takes the place of another.
    handle, _ = planner.send(planner.goal(sway(4.0)))
    asked = handle.cancel_goal_async()
    cell.wait(asked.done, 'the cancel')
    assert len(asked.result().goals_canceling) == 1
    assert planner.result(handle).status == 5
    first, _ = planner.send(planner.goal(sway(4.0)))
    second, _ = planner.send(planner.goal(sway(1.0)))
    ended = planner.result(first)
    assert (ended.status, ended.result.error_string) == (6, 'preempted')
    assert planner.result(second).status == 4

    # The model is exchanged while a goal runs: that one ends as begun and says so.
    handle, before = planner.send(planner.goal(sway(4.0)))
    write_model(model, 0.5 * OFF)
    refused, line = planner.send(planner.goal(motion))
    assert not refused.accepted
    assert 'was exchanged' in line['why']
    assert 'exchanged' in planner.result(handle).result.error_string
    assert cell.trigger('/compensator/reload').success
    handle, line = planner.send(planner.goal(motion))
    assert handle.accepted
    assert line['model'] != before['model']
    assert line['largest_m'] == pytest.approx(0.5 * before['largest_m'], rel=0.3)
    planner.result(handle)

    # Deviations that the model does not leave withdraw it; so does a controller that dies.
    deviation = cell.publisher(DEVIATION)
    for k in range(20):
        deviation.publish(cell.messages.vector3(k, np.array([3e-4, 0.0, 0.0])))
    cell.wait(lambda: 'does not hold' in planner.process.log, 'the notice')
    handle, line = planner.send(planner.goal(motion))
    assert 'does not hold any more' in line['why']
    assert cell.trigger('/compensator/reload').success
    handle, _ = planner.send(planner.goal(sway(40.0)))
    assert handle.accepted
    cell.remove(controller)
    died = planner.result(handle)
    assert died.status == 6
    assert 'is gone' in died.result.error_string
    handle, line = planner.send(planner.goal(motion))
    assert 'no controller offers' in line['why']


def test_poses_are_corrected_and_in_the_shadow_nothing_is_sent(cell, tmp_path):
    model = tmp_path / 'diagnosis.json'
    write_model(model)
    planner = Planner(cell, model, apply=False, executor='single_threaded')
    handle, _ = planner.send(planner.goal(sway()))
    assert not handle.accepted  # not active
    planner.go('configure', 'activate')
    handle, line = planner.send(planner.goal(sway(0.5)))
    assert handle.accepted
    assert (line['verdict'], line['applied']) == ('corrected', False)
    sent = points(planner.controller.goals[-1])
    np.testing.assert_array_equal(sent, sway(0.5).q)
    planner.result(handle)
    cell.wait(lambda: len(planner.added) == 26, 'the corrections')

    out = []
    kind = POSE_OUT.message_class()
    cell.node.create_subscription(
        kind, '/compensator/pose_out', out.append, POSE_OUT.requested.to_rclpy()
    )
    given = cell.node.create_publisher(kind, '/compensator/pose_in', POSE_IN.offered.to_rclpy())
    cell.wait(lambda: given.get_subscription_count() == 1, 'the compensator')
    cell.meet()
    here = planner.controller.q
    stamps = iter(range(1, 10_000))

    def feed(q, until, what):
        T = forward(ROBOT, np.asarray(q))
        ended = time.monotonic() + 30.0
        while not until() and time.monotonic() < ended:
            stamp = 1_000_000_000 + 8_000_000 * next(stamps)
            given.publish(cell.messages.pose(stamp, T[:3, 3], T[:3, :3], 'base'))
            seen(cell, 0.008)
        assert until(), what + planner.process.log

    planner.added.clear()
    feed(here, lambda: len(planner.added) > 5, 'the shadow')
    assert not out
    planner.go('deactivate')
    for name, value in (('apply', True), ('on_refusal', 'pass'), ('max_rate_m_s', 2e-3)):
        assert cell.set_parameter('compensator', name, value).successful
    planner.go('activate')
    assert not cell.set_parameter('compensator', 'apply', False).successful

    # Faded in where the stream stands, then the real tool is where the pose meant.
    feed(here, lambda: len(out) > 60, 'corrected poses')
    position, rotation = from_messages.pose(out[-1])
    from weld_twin_core.motion.inverse.newton import polish

    T = np.eye(4)
    T[:3, :3], T[:3, 3] = rotation, position
    q, _ = polish(ROBOT, here[None], T[None])
    np.testing.assert_allclose(forward(real_arm(), q[0]), forward(ROBOT, here), atol=1e-9)
    way = np.array([from_messages.pose(message)[0] for message in out])
    step = np.linalg.norm(np.diff(way, axis=0), axis=1).max()
    assert step < 0.6 * np.linalg.norm(way[-1] - way[0])

    # Where nothing was recorded a pose passes as it came, once the stream stands still there.
    far = here + [0.0, 0.0, 0.3, 0.0, 0.0, 0.0]
    T = forward(ROBOT, far)
    feed(
        far,
        lambda: np.allclose(from_messages.pose(out[-1])[0], T[:3, 3], atol=1e-12),
        'a pose that is passed through',
    )
    assert 'outside what was recorded' in planner.process.log
