# Copyright 2026 weld_twin contributors
# SPDX-License-Identifier: Apache-2.0
"""The live node on streams with and without a gap."""

import time
from dataclasses import replace

import numpy as np
import pytest

from weld_twin_core.arm.catalog import load
from weld_twin_core.arm.robot import Robot
from weld_twin_core.effects import REGISTRY, effect_from_mapping
from weld_twin_core.recording import JointMotion, Measurements, Recording
from weld_twin_core.twin.twin import Twin
from weld_twin_msgs_py.assembly import Role
from weld_twin_msgs_py.files.yaml_file import yaml_text
from weld_twin_msgs_py.messages import from_messages
from weld_twin_msgs_py.messages.to_messages import bag_messages
from weld_twin_msgs_py.messages.topics import (
    IMAGE_POINTS,
    JOINT_STATES,
    MEASURED_POINT,
    TopicNames,
)
from weld_twin_nodes.harness import Cell
from weld_twin_nodes.live.diagnosis_worker import Finding, Job, Worker, find
from weld_twin_nodes.live.live_diagnosis import LONGEST, LiveDiagnosis, Window
from weld_twin_nodes.offline.given_twin import given_cameras

START = 1_700_000_000_000_000_000
ONE_JOINT = Robot.from_mapping({'name': 'one', 'joints': [{'name': 'a', 'a': 0.5}]})
OFFSET = {'effect': 'joint_offset', 'joint': 'elbow_joint', 'offset': 2e-3}


def wandering(seconds=12.0, rate=50.0):
    """Return a motion in which every joint moves its own way."""
    t = np.arange(0.0, seconds, 1.0 / rate)
    phase = np.arange(6)
    q = 0.5 * np.sin(0.9 * np.outer(t, 1.0 + 0.31 * phase) + phase) + [0, -1.2, 1.4, -1, -1.5, 0]
    return JointMotion(t, q)


def points(effects, motion, sigma=2e-5):
    robot = load('ur5')
    twin = Twin(robot, tuple(effect_from_mapping(e) for e in effects))
    exact = twin.poses(Recording('live', motion)).position
    return exact + np.random.default_rng(3).normal(scale=sigma, size=exact.shape)


def filled(duration=60.0, effects=(OFFSET,), seconds=12.0):
    make, motion = bag_messages(), wandering(seconds)
    window = Window(load('ur5'), duration)
    for t, q, p in zip(motion.t, motion.q, points(effects, motion), strict=True):
        stamp = START + round(t * 1e9)
        window.take(Role.JOINTS, make.joint_state(stamp, load('ur5').joint_names, q))
        window.take(Role.POINT, make.point(stamp, p))
    return window


@pytest.fixture(scope='module')
def recording():
    return filled(seconds=6.0).recording(least=3.0)


def test_the_window_holds_its_duration_and_without_stamps_a_number():
    recording = filled(duration=4.0).recording(least=3.0)
    assert recording.joints.t[-1] - recording.joints.t[0] == pytest.approx(4.0, abs=0.03)
    assert recording.measured.t.size == recording.joints.t.size == pytest.approx(201, abs=1)
    assert recording.epoch_ns + round(recording.joints.t[-1] * 1e9) == START + 11_980_000_000
    window, make = Window(ONE_JOINT, 1e6), bag_messages()
    for k in range(1, LONGEST + 100):
        window.take(Role.JOINTS, make.joint_state(k, ('a',), np.zeros(1)))
    assert len(window._streams[Role.JOINTS]) == LONGEST


def test_a_resting_arm_gives_nothing_to_diagnose():
    window, make, names = Window(ONE_JOINT, 60.0), bag_messages(), ('a',)
    for k in range(1000):
        window.take(Role.JOINTS, make.joint_state(START + k * 10_000_000, names, np.ones(1)))
        window.take(Role.POINT, make.point(START + k * 10_000_000, np.zeros(3)))
    assert window.recording(least=1.0) is None


def test_a_bag_played_again_starts_a_new_window():
    window = filled()
    make, motion = bag_messages(), wandering()
    for t, q in zip(motion.t, motion.q, strict=True):
        stamp = START - 3_600_000_000_000 + round(t * 1e9)
        try:
            window.take(Role.JOINTS, make.joint_state(stamp, load('ur5').joint_names, q))
        except Exception as error:  # the first few are refused, as a late sample would be
            assert 'not after the last one' in str(error)
    assert window.last is None


def swinging():
    """Return six seconds of a joint whose zero is off, and where a tracker sees its tool."""
    t = np.arange(0.0, 6.0, 0.02)
    motion = JointMotion(t, np.sin(t)[:, None])
    twin = Twin(ONE_JOINT, (effect_from_mapping({**OFFSET, 'joint': 'a'}),))
    exact = twin.poses(Recording('live', motion)).position
    return motion, exact + np.random.default_rng(3).normal(scale=2e-5, size=exact.shape)


def answer(worker):
    while worker.busy:
        time.sleep(0.05)
    return worker.take()


def test_a_job_runs_elsewhere_while_the_caller_goes_on():
    motion, seen = swinging()
    recording = Recording('live', motion, Measurements(motion.t, seen), epoch_ns=START)
    worker = Worker()
    worker.start(Job(recording, ONE_JOINT))
    assert worker.busy and worker.take() is None  # the caller is back before the answer
    finding = answer(worker)
    assert isinstance(finding, Finding)
    assert finding.stamp == START + 5_980_000_000
    assert finding.status != 'none'
    assert finding.values['gap_rms_m'] > 1e-4
    assert worker.take() is None


def test_a_job_that_cannot_be_done_answers_with_a_sentence_or_what_it_said_at_its_end(recording):
    said = []
    worker = Worker(said.append)
    worker.start(Job(recording.with_measured(None), load('ur5')))
    assert 'holds no measured poses' in answer(worker)
    worker.start(Job('no recording', load('ur5')))
    assert answer(worker) == 'the diagnosis ended with code 1'
    (told,) = (line for line in said if line.startswith('the diagnosis says: Traceback'))
    assert "'str' object has no attribute" in told


FOCAL = 900.0
CORNERS = np.array([[c, r, 0.0] for r in range(3) for c in range(4)]) * 0.05
EYE = 'camera_matrix: [900, 0, 640, 0, 900, 480, 0, 0, 1]\ndistortion_coefficients: []\n'
BOARD = 'board: chessboard\nsquares: [5, 4]\nsquare: 0.05\n'


def images(motion, poses):
    """Return stamps [s] and rows of target, point, u, v: a pinhole that looks at a board."""
    rng, out = np.random.default_rng(5), []
    eye = np.linalg.inv(poses[len(poses) // 2])
    for t, pose in list(zip(motion.t, poses, strict=True))[::20]:
        # The camera stands 1.2 m before the board as it is halfway, and sees it square then.
        there = CORNERS @ (eye @ pose)[:3, :3].T + (eye @ pose)[:3, 3] + [0.0, 0.0, 1.2]
        where = FOCAL * there[:, :2] / there[:, 2:] + [640.0, 480.0]
        if (there[:, 2] > 0.3).all():
            where = where + rng.normal(0.0, 0.05, where.shape)
            count = np.arange(len(CORNERS))
            out.append((t, np.column_stack([0 * count, count, where])))
    assert len(out) >= 20
    return out


def seen_by_a_camera(folder):
    """Return a window in which a camera sees a board on an arm whose elbow is off, and its files."""
    (folder / 'eye.yaml').write_text(EYE)
    (folder / 'board.yaml').write_text(BOARD)
    motion = wandering()
    motion = JointMotion(motion.t, 0.5 * motion.q + 0.5 * motion.q[300])
    twin = Twin(load('ur5'), (effect_from_mapping({**OFFSET, 'offset': 6e-3}),))
    found = twin.poses(Recording('live', motion))
    poses = np.tile(np.eye(4), (motion.t.size, 1, 1))
    poses[:, :3, :3], poses[:, :3, 3] = found.rotation, found.position
    return motion, images(motion, poses)


def test_what_a_camera_sees_is_diagnosed_in_the_other_process(tmp_path):
    motion, seen = seen_by_a_camera(tmp_path)
    make, window = bag_messages(), Window(load('ur5'), 60.0)
    for t, rows in seen[:1]:
        window.take_image(make.image_points(START + round(t * 1e9), 'eye', rows))
    assert window.recording(least=3.0) is None
    for t, q in zip(motion.t, motion.q, strict=True):
        stamp = START + round(t * 1e9)
        window.take(Role.JOINTS, make.joint_state(stamp, load('ur5').joint_names, q))
    for t, rows in seen[1:]:
        window.take_image(make.image_points(START + round(t * 1e9), 'eye', rows))
    cameras, targets = given_cameras([f'eye={tmp_path}/eye.yaml'], [f'b={tmp_path}/board.yaml'])
    job = Job(
        window.recording(least=3.0),
        load('ur5'),
        align=frozenset({'base', 'tool'}),
        exclude=tuple(set(REGISTRY) - {'joint_offset', 'link_length', 'backlash'}),
        images=window.images,
        names=TopicNames(cameras=cameras, targets=targets),
    )
    finding = find(job)
    assert finding.stamp == START + round(seen[-1][0] * 1e9)
    assert finding.status not in ('none', 'unsound')
    assert any('elbow_joint' in key for key in finding.values)


def test_the_node_hears_what_cameras_see(tmp_path):
    motion, seen = seen_by_a_camera(tmp_path)
    with Cell(tmp_path / 'cell') as cell:
        options = {'cameras': f'eye={tmp_path}/eye.yaml', 'targets': f'b={tmp_path}/board.yaml'}
        node = cell.add(LiveDiagnosis, robot='ur5', every=600.0, **options)
        states, where = cell.publisher(JOINT_STATES), cell.publisher(IMAGE_POINTS)
        names = load('ur5').joint_names
        states.publish(cell.messages.joint_state(START, names, motion.q[0]))
        for t, rows in seen[:5]:
            stamp = START + round(t * 1e9)
            where.publish(cell.messages.image_points(stamp, 'eye', rows))
        cell.wait(lambda: len(node._window.images) == 5, 'five images')


def test_a_job_under_way_can_be_ended(recording):
    worker = Worker()
    worker.start(Job(recording, load('ur5')))
    worker.stop()
    assert not worker.busy


def test_the_node_is_quiet_until_it_has_evidence_and_then_tells_its_end_too(tmp_path):
    nothing = Finding(START, 'none', 'No gap.', {'gap_rms_m': 1e-5})
    gap = Finding(START + 1, 'identified', 'A gap.', {'gap_rms_m': 1e-3})
    with Cell(tmp_path / 'cell') as cell:
        node = cell.add(LiveDiagnosis)
        said = cell.collect('/diagnosis')
        cell.wait(lambda: node._verdict.get_subscription_count() > 0, 'a listener')
        for finding in (nothing, None, gap, nothing):
            node._tell(finding)
        cell.wait(lambda: len(said) == 2, 'two verdicts')
        assert [m.status[0].level for m in said.messages] == [b'\x01', b'\x00']
        assert [m.status[0].message for m in said.messages] == ['A gap.', 'No gap.']


def test_unsound_data_are_an_error_on_both_topics_until_they_are_mended(recording, tmp_path):
    q = np.array(recording.joints.q)
    q[:, [3, 5]] = q[:, [5, 3]]
    swapped = replace(recording, joints=replace(recording.joints, q=q))
    unsound = find(Job(swapped, load('ur5')))
    assert unsound.status == 'unsound' and 'swapped' in unsound.values['unsound: joints_swapped']
    with Cell(tmp_path / 'cell') as cell:
        node = cell.add(LiveDiagnosis)
        said, health = cell.collect('/diagnosis'), cell.collect('/diagnostics')
        cell.wait(lambda: node._verdict.get_subscription_count() > 0, 'a listener')

        def own():
            return [s for m in health.messages for s in m.status if s.name == '/live_diagnosis']

        node._tell(unsound)
        cell.wait(lambda: len(said) == 1, 'a verdict')
        assert said.last.status[0].level == b'\x02' and 'swapped' in said.last.status[0].message
        cell.wait(lambda: any(s.level == b'\x02' and 'swapped' in s.message for s in own()), 'it')
        node._tell(Finding(START + 1, 'none', 'No gap.', {}))
        cell.wait(lambda: own()[-1].level != b'\x02', 'that it is over')


@pytest.mark.cells
def test_the_node_tells_a_gap_from_the_streams(tmp_path):
    motion, seen = swinging()
    (tmp_path / 'one.yaml').write_text(yaml_text(ONE_JOINT.to_mapping()))
    options = {'robot': str(tmp_path / 'one.yaml'), 'least': 5.5, 'every': 1.0}
    with Cell(tmp_path / 'cell') as cell:
        # One diagnosis, of nearly all that is sent.
        cell.start('live_diagnosis', reliable_inputs=True, **options)
        said = cell.collect('/diagnosis')
        states, where = cell.publisher(JOINT_STATES), cell.publisher(MEASURED_POINT)
        for t, q, position in zip(motion.t, motion.q, seen, strict=True):
            stamp = START + round(t * 1e9)
            states.publish(cell.messages.joint_state(stamp, ('a',), q))
            where.publish(cell.messages.point(stamp, position))
            time.sleep(0.002)
        cell.wait(lambda: len(said) > 0, 'a verdict', limit=90.0)
        status = said.last.status[0]
        assert status.level == b'\x01'
        assert float({pair.key: pair.value for pair in status.values}['gap_rms_m']) > 1e-4
        assert from_messages.stamp_ns(said.last) <= START + round(motion.t[-1] * 1e9)
