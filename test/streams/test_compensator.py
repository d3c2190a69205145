# Copyright 2026 weld_twin contributors
# SPDX-License-Identifier: Apache-2.0
"""
The compensator as a process between a planner and a controller, over DDS.

The arm it works for has a zero of its elbow that is off; where its tool really goes is worked out
with that zero written into the robot file by hand.
"""

import json
import os
import signal
import time
from pathlib import Path

import numpy as np
import pytest
from defusedxml.ElementTree import parse

pytest.importorskip('rclpy', reason='needs ROS 2')

from lifecycle_msgs.msg import Transition
from lifecycle_msgs.srv import ChangeState
from rclpy.action import ActionClient

from weld_twin_core import JointMotion, Robot, forward, load
from weld_twin_core.motion.inverse.newton import polish
from weld_twin_core.twin.directions import Directions, Discrepancy
from weld_twin_core.twin.domain import Domain
from weld_twin_core.twin.posterior import Posterior, as_dict
from weld_twin_msgs_py.messages import from_messages
from weld_twin_msgs_py.messages.topics import (
    AUDIT,
    CORRECTION,
    DEVIATION,
    POSE_IN,
    POSE_OUT,
    TOOL_WRENCH,
)
from weld_twin_nodes.harness import Cell
from weld_twin_nodes.live import compensator

pytestmark = pytest.mark.cells

POLICY = Path(__file__).parents[2] / 'src/weld_twin_nodes/security/weld_twin.policy.xml'
ROBOT = load('ur5')
NAMES = list(ROBOT.joint_names)
HOME = np.array([0.1, -1.2, 1.5, -1.8, -1.5, 0.3])
OFF = 6e-4
"""How far the elbow really stands from its reading [rad]."""


def real_arm():
    data = ROBOT.to_mapping()
    data['joints'][2]['theta_offset'] += OFF
    return Robot.from_mapping(data)


def write_model(path, off=OFF, *more):
    ranges = tuple(((q - 0.4, q + 0.4),) for q in HOME)
    domain = Domain(NAMES, ranges, (0.02,) * 6, (True,) * 6, load=(60.0, 60.0))
    rest = Discrepancy(2e-5, 1e-6, np.zeros(6), np.zeros(6), 1.0)
    known = Posterior(Directions((), 1, ()), np.zeros(0), np.zeros((0, 0)), rest, domain)
    found = [{'effect': 'joint_offset', 'joint': NAMES[2], 'offset': off}, *more]
    frames = {'tool': ROBOT.T_flange_tool.tolist(), 'bases': [ROBOT.T_world_base.tolist()]}
    content = {'schema': 'weld_twin/diagnosis/1', 'model': {**frames, 'known': [], 'found': found}}
    content |= {'shrink': {'rms_after_m': 3e-5}, 'posterior': as_dict(known)}
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
        self.model, self.active = model, False
        self.controller = cell.add(Controller, NAMES, HOME, 4.0)
        self.process = cell.start('compensator', robot='ur5', model=str(model), **parameters)
        self.added = []
        self.hear(AUDIT, 'audit', lambda line: self.audit.append(json.loads(line.data)))
        self.hear(CORRECTION, 'correction', self.added.append)
        self._change = cell.node.create_client(ChangeState, '/compensator/change_state')
        self.client = ActionClient(cell.node, self.kind, '/compensator/follow_joint_trajectory')
        cell.wait(self._change.service_is_ready, 'the transitions')
        cell.wait(self.client.server_is_ready, 'the action')
        cell.meet()

    def hear(self, topic, name, take):
        """Let a function take what the compensator sends on a topic."""
        quality, name = topic.requested.to_rclpy(), f'/compensator/{name}'
        self.cell.node.create_subscription(topic.message_class(), name, take, quality)

    def go(self, *steps):
        for step in steps:
            number = getattr(Transition, f'TRANSITION_{step.upper()}')
            asked = self._change.call_async(ChangeState.Request(transition=Transition(id=number)))
            self.cell.wait(asked.done, step)
            assert asked.result().success, step
            self.active = step == 'activate'

    def to(self, q):
        """Put the arm somewhere, and wait until the compensator has heard of it."""
        self.controller.q = np.array(q)
        seen(self.cell, 0.3)
        self.cell.meet()  # it takes what came before a question before it answers

    def refused(self, goal, reason):
        """Send a goal that must not reach the controller."""
        count = len(self.controller.goals)
        handle, line = self.send(goal)
        assert not handle.accepted
        assert reason in line['why'], line
        assert len(self.controller.goals) == count
        return line

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


@pytest.fixture(scope='module')
def shared(tmp_path_factory, packages):
    """One compensator that applies what it corrects, for all tests of goals."""
    folder = tmp_path_factory.mktemp('goals')
    write_model(folder / 'diagnosis.json')
    with Cell(folder / 'cell') as cell:
        audit = str(folder / 'audit.jsonl')
        yield Planner(cell, folder / 'diagnosis.json', apply=True, audit=audit)


@pytest.fixture
def inactive(shared):
    if shared.active:
        shared.go('deactivate', 'cleanup')
    return shared


@pytest.fixture
def planner(shared):
    """The compensator with the right model, and a controller that runs nothing."""
    write_model(shared.model)
    shared.go(*(() if shared.active else ('configure', 'activate')))
    assert shared.cell.trigger('/compensator/reload').success
    shared.controller.accepts = True
    shared.to(HOME)
    return shared


def points(goal):
    return np.array([point.positions for point in goal.trajectory.points])


def seen(cell, seconds):
    end = time.monotonic() + seconds
    cell.wait(lambda: time.monotonic() > end, 'a while')


ACTION_TOPICS = ('feedback', 'status')
ACTION_SERVICES = ('cancel_goal', 'get_result', 'send_goal')
"""What `ros2 security create_permission` makes of the name of an action (sros2, permissions.xsl)."""


def test_the_policy_allows_both_actions_all_that_they_open_and_no_other(shared):
    profile = parse(POLICY).find(".//profile[@node='compensator']")
    graph = shared.cell.node
    for permission, topics, services in (
        (
            'execute',
            'get_publisher_names_and_types_by_node',
            'get_service_names_and_types_by_node',
        ),
        ('call', 'get_subscriber_names_and_types_by_node', 'get_client_names_and_types_by_node'),
    ):
        item = profile.find(f"actions[@{permission}='ALLOW']/action")
        name = item.text.replace('~', '/compensator').lstrip('/')
        allowed = {f'/{name}/_action/{part}' for part in (*ACTION_TOPICS, *ACTION_SERVICES)}
        opened = {
            each
            for query in (topics, services)
            for each, _ in getattr(graph, query)('compensator', '/')
            if '/_action/' in each
        }
        assert opened == allowed, permission


def test_inactive_it_refuses_goals_and_an_order_to_stop_passes(inactive):
    line = inactive.refused(inactive.goal(sway()), 'not active')
    assert line['verdict'] == 'refused'
    stop = inactive.kind.Goal()
    stop.trajectory.joint_names = NAMES
    handle, line = inactive.send(stop)
    assert handle.accepted
    assert line['verdict'] == 'passed'


def test_the_real_arm_goes_where_a_goal_meant_and_all_else_passes_through(planner):
    """Joints come in another order, with a track beside them that is left."""
    motion, feedback, order = sway(), [], [3, 0, 5, 1, 4, 2]
    names = ['track', *(NAMES[k] for k in order)]
    q = np.column_stack([motion.t, motion.q[:, order]])
    rates = np.column_stack([np.ones(motion.t.size), motion.velocity[:, order]])
    planner.added.clear()
    asked = planner.goal(JointMotion(motion.t, q, rates), names=names)
    handle, line = planner.send(asked, feedback.append)
    assert handle.accepted, line
    assert (line['verdict'], line['applied']) == ('corrected', True)
    sent = planner.controller.goals[-1]
    assert list(sent.trajectory.joint_names) == names
    np.testing.assert_array_equal(points(sent)[:, 0], motion.t)
    got = points(sent)[:, [1 + order.index(k) for k in range(6)]]
    np.testing.assert_allclose(forward(real_arm(), got), forward(ROBOT, motion.q), atol=1e-9)
    assert line['largest_m'] == pytest.approx(line['expected_before_m'], rel=0.5)
    assert line['bound_m'] > line['expected_after_m']
    done = planner.result(handle)
    assert (done.status, done.result.error_string) == (4, '')
    assert len(feedback) > 10
    assert json.loads((planner.model.parent / 'audit.jsonl').read_text().splitlines()[-1]) == line
    planner.cell.wait(lambda: len(planner.added) == motion.t.size, 'a correction of every point')


def test_a_single_point_and_one_at_time_zero_are_corrected(planner):
    goal = planner.goal(sway())
    goal.trajectory.points = goal.trajectory.points[-1:]
    goal.trajectory.points[0].velocities = [0.0] * 6
    for sec in (1, 0):
        goal.trajectory.points[0].time_from_start.sec = sec
        handle, line = planner.send(goal)
        assert handle.accepted, line
        got = points(planner.controller.goals[-1])
        np.testing.assert_allclose(
            forward(real_arm(), got), forward(ROBOT, sway().q[-1:]), atol=1e-9
        )
        planner.result(handle)


def test_what_is_refused_says_why_and_does_not_reach_the_controller(planner):
    from control_msgs.msg import JointTolerance

    motion = sway()
    tight, same_time = planner.goal(motion), planner.goal(motion)
    tight.path_tolerance = [JointTolerance(name=NAMES[2], position=OFF / 2)]
    for point in same_time.trajectory.points:
        point.time_from_start.sec = point.time_from_start.nanosec = 0
    twice = planner.goal(motion)
    twice.trajectory.header.frame_id = 'corrected by weld_twin; base'
    past = planner.cell.node.get_clock().now().nanoseconds - 5_000_000_000
    fewer = JointMotion(motion.t, motion.q[:, :5])
    for asked, reason in (
        (tight, 'which tolerates'),
        (planner.goal(motion, stamp=past), 'should have begun'),
        (planner.goal(fewer, names=NAMES[:5]), "no joint 'wrist_3"),
        (same_time, 'must increase'),
        (twice, 'was corrected already'),
        (planner.goal(sway(begin=HOME + 0.5)), 'outside what was recorded'),
        (planner.goal(sway(span=0.05)), 'the goal itself breaks'),
    ):
        planner.refused(asked, reason)
    planner.controller.accepts = False
    handle, line = planner.send(planner.goal(motion))
    assert (handle.accepted, line['verdict']) == (False, 'rejected by the controller')


def test_a_goal_is_cancelled_and_another_takes_its_place(planner):
    handle, _ = planner.send(planner.goal(sway(40.0)))  # it runs still, however late the cancel
    asked = handle.cancel_goal_async()
    planner.cell.wait(asked.done, 'the cancel')
    assert len(asked.result().goals_canceling) == 1
    assert planner.result(handle).status == 5
    planner.to(HOME)
    first, _ = planner.send(planner.goal(sway(40.0)))
    second, _ = planner.send(planner.goal(sway(1.0)))
    ended = planner.result(first)
    assert (ended.status, ended.result.error_string) == (6, 'preempted')
    assert planner.result(second).status == 4


def test_two_goals_at_once_reach_the_controller_in_their_order(planner):
    planner.controller.answers = 0.2
    count = len(planner.controller.goals)
    asked = [
        planner.client.send_goal_async(planner.goal(sway(span, count=size)))
        for span, size in ((2.0, 400), (1.0, 3))
    ]
    for each in asked:
        planner.cell.wait(each.done, 'the answer')
    planner.controller.answers = 0.0
    sizes = [len(goal.trajectory.points) for goal in planner.controller.goals[count:]]
    assert sizes == [400, 3]
    planner.result(asked[1].result())


def test_an_order_to_stop_waits_for_no_goal_and_none_from_before_is_sent_after_it(planner):
    stop, count = planner.kind.Goal(), len(planner.controller.goals)
    stop.trajectory.joint_names = NAMES
    long = planner.client.send_goal_async(planner.goal(sway(10.0, count=4000)))
    asked = planner.client.send_goal_async(stop)
    planner.cell.wait(lambda: asked.done() and long.done(), 'the answers')
    assert (asked.result().accepted, long.result().accepted) == (True, False)
    assert [len(goal.trajectory.points) for goal in planner.controller.goals[count:]] == [0]
    planner.cell.wait(lambda: 'order to stop came' in planner.audit[-1]['why'], 'the reason')
    assert planner.audit[-2]['verdict'] == 'passed'  # the stop, though it was sent later


def test_a_model_exchanged_meanwhile_counts_from_the_next_goal_on(planner):
    handle, before = planner.send(planner.goal(sway(4.0)))
    write_model(planner.model, 0.5 * OFF)
    planner.refused(planner.goal(sway()), 'was exchanged')
    assert 'exchanged' in planner.result(handle).result.error_string
    assert planner.cell.trigger('/compensator/reload').success
    planner.to(HOME)
    handle, line = planner.send(planner.goal(sway(4.0)))
    assert handle.accepted
    assert line['model'] != before['model']
    assert line['largest_m'] == pytest.approx(0.5 * before['largest_m'], rel=0.1)
    planner.result(handle)


def test_another_model_named_while_it_is_inactive_counts_when_it_is_active_again(planner):
    other = planner.model.with_name('other.json')
    write_model(other, 2.0 * OFF)
    handle, before = planner.send(planner.goal(sway()))
    planner.result(handle)
    planner.go('deactivate')
    for file in (other, planner.model):
        assert planner.cell.set_parameter('compensator', 'model', str(file)).successful
        planner.go('activate')
        planner.to(HOME)
        handle, line = planner.send(planner.goal(sway()))
        planner.result(handle)
        planner.go('deactivate')
        share = 2.0 if file == other else 1.0
        assert line['largest_m'] == pytest.approx(share * before['largest_m'], rel=1e-3)
    planner.go('activate')


def test_a_goal_that_is_worked_out_meanwhile_is_not_sent_by_what_was_known_before(planner):
    """Whichever comes first: no goal goes out by a model that does not count any more."""
    long, count = planner.goal(sway(10.0, count=6000)), len(planner.controller.goals)
    asked = planner.client.send_goal_async(long)
    planner.go('deactivate')
    planner.cell.wait(asked.done, 'the answer')
    assert not asked.result().accepted
    planner.cell.wait(lambda: 'not active' in planner.audit[-1]['why'], 'the reason')
    planner.go('activate')
    told = len(planner.audit)
    asked = planner.client.send_goal_async(long)
    write_model(planner.model, 0.5 * OFF)
    before = planner.audit[-1]['model']
    planner.cell.wait(lambda: planner.cell.trigger('/compensator/reload').success, 'the model')
    planner.cell.wait(lambda: asked.done() and len(planner.audit) > told, 'the answer')
    assert not asked.result().accepted or planner.audit[-1]['model'] != before
    if asked.result().accepted:
        planner.cell.wait(asked.result().cancel_goal_async().done, 'the cancel')
    else:
        assert len(planner.controller.goals) == count


def test_two_of_one_name_are_told_and_a_disk_that_does_not_answer_keeps_none(tmp_path, packages):
    model, audit = tmp_path / 'diagnosis.json', tmp_path / 'audit'
    write_model(model)
    os.mkfifo(audit)  # nobody reads it, so that whoever opens it waits for ever
    with Cell(tmp_path / 'cell') as cell:
        planner = Planner(cell, model, apply=True, audit=str(audit), use_sim_time=True)
        other = cell.start('compensator', robot='ur5', model=str(model), managed=False)
        for process in (planner.process, other):
            cell.wait(lambda: 'another node of the name /compensator' in process.log, 'the other')  # noqa: B023
        assert other.stop() == 0
        planner.go('configure', 'activate')
        planner.to(HOME)
        handle, _ = planner.send(planner.goal(sway()))
        assert handle.accepted
        assert 'nothing has come on /clock' in planner.process.log
        planner.process.signal(signal.SIGTERM)
        assert planner.process.end(60.0) == 0
        assert f"'{audit}' has not taken all lines" in planner.process.log


def test_what_goes_to_another_compensator_is_not_corrected(tmp_path, packages):
    model = tmp_path / 'diagnosis.json'
    write_model(model)
    with Cell(tmp_path / 'cell') as cell:
        named = ['-r', '__node:=second', '-r', '~/pose_in:=/compensator/pose_out']
        cell.add(compensator.Compensator, cli_args=['--ros-args', *named], model=str(model))
        planner = Planner(cell, model, apply=True, controller='second')
        planner.go('configure', 'activate')
        cell.wait(lambda: '/second, which takes what is sent' in planner.process.log, 'the other')
        planner.refused(planner.goal(sway()), 'it would correct twice')
        cell.node.create_publisher(
            POSE_OUT.message_class(), '/compensator/pose_out', POSE_OUT.offered.to_rclpy()
        )
        own = cell.node.get_fully_qualified_name()
        beside = f'{own} publishes /compensator/pose_out, too'
        cell.wait(lambda: beside in planner.process.log, 'the sender beside')


NO_CONTROLLERS = {'/': 'names no controller', '/compensator': 'names no controller'}
NO_CONTROLLERS['arm controller'] = 'is no name'


@pytest.mark.parametrize(('controller', 'sentence'), NO_CONTROLLERS.items())
def test_goals_go_to_a_controller_that_is_named(controller, sentence, packages, capsys):
    words = ['--ros-args', '-p', f'controller:={controller}']
    assert compensator.main(words) == 2
    assert sentence in capsys.readouterr().err


@pytest.fixture
def deviation(planner):
    publisher = planner.cell.publisher(DEVIATION)
    yield publisher
    planner.cell.node.destroy_publisher(publisher)


def deviate(planner, deviation, size, stamps):
    """Publish deviations of a size at some stamps, and wait until they have come."""
    for stamp in stamps:
        deviation.publish(planner.cell.messages.vector3(stamp, np.array([size, 0.0, 0.0])))
    planner.cell.meet()


def test_deviations_that_the_model_does_not_leave_withdraw_it(planner, deviation):
    planner.to(HOME + 1.0)  # where nothing was recorded, nothing was promised
    deviate(planner, deviation, 3e-4, range(20))
    planner.to(HOME)
    assert 'does not hold' not in planner.process.log
    deviate(planner, deviation, 3e-4, range(20))
    planner.cell.wait(lambda: 'does not hold' in planner.process.log, 'the notice')
    planner.refused(planner.goal(sway()), 'does not hold any more')


def test_at_rest_nothing_is_promised_of_a_joint_that_loses_motion_without_a_law(
    planner, deviation
):
    """A curve over direction says what is lost on the way, and at rest not on which side."""
    lost = {'effect': 'joint_curve', 'joint': NAMES[1], 'over': 'direction', 'knots': [-1.0, 1.0]}
    write_model(planner.model, OFF, {**lost, 'values': [-3e-4, 3e-4]})
    assert planner.cell.trigger('/compensator/reload').success
    seen(planner.cell, 0.5)  # in which the arm stands
    before = planner.process.log.count('does not hold')
    now = planner.cell.node.get_clock().now().nanoseconds
    deviate(planner, deviation, 3e-4, (now - k * 4_000_000 for k in range(40)))
    handle, line = planner.send(planner.goal(sway()))
    assert handle.accepted, line
    assert 'no bound is told' in ' '.join(line['notes'])
    planner.result(handle)
    track = planner.controller.track
    fast = [stamp for stamp, t in track if 0.3 < t < 0.7]
    assert len(fast) > 20
    deviate(planner, deviation, 3e-4, fast)
    told = lambda: planner.process.log.count('does not hold') > before  # noqa: E731
    planner.cell.wait(told, 'the notice')


def test_a_tracker_that_was_lost_must_bear_the_model_out_again(planner, deviation):
    deviate(planner, deviation, 1e-5, range(5))
    for _ in range(20):  # a busy machine takes long for these
        seen(planner.cell, 2.2)
        planner.refused(planner.goal(sway()), 'the tracker is lost')
        begun = time.monotonic()
        deviate(planner, deviation, 1e-5, range(19))
        _, early = planner.send(planner.goal(sway()))
        deviate(planner, deviation, 1e-5, range(1))
        handle, line = planner.send(planner.goal(sway()))
        if time.monotonic() - begun < 1.9:
            break  # else it was lost once more meanwhile
    assert '19 of the 20 measurements' in early['why']
    assert handle.accepted, line
    planner.result(handle)


def test_a_controller_that_dies_ends_its_goal(planner):
    handle, _ = planner.send(planner.goal(sway(40.0)))
    assert handle.accepted
    planner.cell.remove(planner.controller)
    died = planner.result(handle)
    assert died.status == 6
    assert 'is gone' in died.result.error_string
    planner.refused(planner.goal(sway()), 'no controller offers')


@pytest.fixture
def shadow(tmp_path, packages):
    write_model(tmp_path / 'diagnosis.json')
    with Cell(tmp_path / 'cell') as cell:
        model = tmp_path / 'diagnosis.json'
        planner = Planner(cell, model, apply=False, executor='single_threaded')
        planner.go('configure', 'activate')
        yield planner


class Poses:
    """A stream of poses to the compensator, and what comes of it."""

    def __init__(self, planner):
        self.planner, self.cell, self.out = planner, planner.cell, []
        planner.hear(POSE_OUT, 'pose_out', self.out.append)
        self._given = planner.cell.node.create_publisher(
            POSE_IN.message_class(), '/compensator/pose_in', POSE_IN.offered.to_rclpy()
        )
        self.cell.wait(lambda: self._given.get_subscription_count() == 1, 'the compensator')
        self.cell.meet()
        self._stamp = 1_000_000_000

    def feed(self, q, until, what):
        """Send one pose again and again until something is so."""
        T = forward(ROBOT, np.asarray(q))
        end = time.monotonic() + 60.0
        while not until() and time.monotonic() < end:
            self._stamp += 8_000_000
            self._given.publish(self.cell.messages.pose(self._stamp, T[:3, 3], T[:3, :3], 'base'))
            seen(self.cell, 0.008)
        assert until(), what + self.planner.process.log

    @property
    def way(self):
        return np.array([from_messages.pose(message)[0] for message in self.out])


def test_in_the_shadow_nothing_is_changed_and_poses_are_corrected_once_applied(shadow):
    handle, line = shadow.send(shadow.goal(sway(0.5)))
    assert handle.accepted
    assert (line['verdict'], line['applied']) == ('corrected', False)
    np.testing.assert_array_equal(points(shadow.controller.goals[-1]), sway(0.5).q)
    shadow.result(handle)
    shadow.cell.wait(lambda: len(shadow.added) == 26, 'the corrections')
    poses, here = Poses(shadow), shadow.controller.q
    shadow.added.clear()
    poses.feed(here, lambda: len(shadow.added) > 5, 'the shadow')
    assert not poses.out

    shadow.go('deactivate')
    for name, value in (('apply', True), ('on_refusal', 'pass'), ('max_rate_m_s', 2e-3)):
        assert shadow.cell.set_parameter('compensator', name, value).successful
    shadow.go('activate')
    assert not shadow.cell.set_parameter('compensator', 'apply', False).successful
    poses.feed(here, lambda: len(poses.out) > 60, 'corrected poses')
    position, rotation = from_messages.pose(poses.out[-1])
    T = np.eye(4)
    T[:3, :3], T[:3, 3] = rotation, position
    q, _ = polish(ROBOT, here[None], T[None])
    np.testing.assert_allclose(forward(real_arm(), q[0]), forward(ROBOT, here), atol=1e-9)
    # Faded in where the stream stands.
    step = np.linalg.norm(np.diff(poses.way, axis=0), axis=1).max()
    assert step < 0.6 * np.linalg.norm(poses.way[-1] - poses.way[0])
    a_load_that_comes_later_counts(shadow, poses)


def a_load_that_comes_later_counts(shadow, poses):
    """A spring of the shoulder under a load that is told while the stream stands."""
    compliance, pull, here = 6e-6, np.array([0.0, 0.0, -40.0]), shadow.controller.q
    spring = {'effect': 'joint_compliance', 'joint': NAMES[1], 'compliance': compliance}
    write_model(shadow.model, OFF, spring)
    assert shadow.cell.trigger('/compensator/reload').success
    count = len(poses.out)
    poses.feed(here, lambda: len(poses.out) > count + 100, 'poses of the new model')
    unloaded = poses.way[-1]
    load = shadow.cell.publisher(TOOL_WRENCH)
    load.publish(shadow.cell.messages.wrench(1, np.array([*pull, 0.0, 0.0, 0.0]), 'base'))
    count = len(poses.out)
    poses.feed(here, lambda: len(poses.out) > count + 150, 'poses under the load')
    beside = np.array([0.0, 1e-6, 0.0, 0.0, 0.0, 0.0])
    lever = (forward(ROBOT, here + beside) - forward(ROBOT, here - beside))[:3, 3] / 2e-6
    moved = poses.way[-1] - unloaded
    np.testing.assert_allclose(moved, -lever * compliance * (lever @ pull), atol=2e-6)
    assert np.linalg.norm(moved) > 3e-5

    # Where nothing was recorded a pose passes as it came, once the stream stands still there.
    far = here + [0.0, 0.0, 0.3, 0.0, 0.0, 0.0]
    wanted = forward(ROBOT, far)[:3, 3]
    poses.feed(far, lambda: np.allclose(poses.way[-1], wanted, atol=1e-12), 'a pose that passes')
    assert 'outside what was recorded' in shadow.process.log
