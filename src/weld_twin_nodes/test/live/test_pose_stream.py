# Copyright 2026 weld_twin contributors
# SPDX-License-Identifier: Apache-2.0
"""When a stream of poses is corrected, and that what is added changes at a standstill alone."""

import time

import numpy as np
import pytest

from weld_twin_core import effect_from_mapping, forward, load
from weld_twin_core.twin.goal_correction import GoalLimits
from weld_twin_core.twin.pose_correction import PoseCorrection, between
from weld_twin_core.twin.program_model import ProgramModel
from weld_twin_nodes.streams.looks_beside import LooksBeside
from weld_twin_nodes.streams.pose_stream import PoseStream

UR5 = load('ur5')
HOME = np.array([0.1, -1.2, 1.5, -1.8, -1.5, 0.3])
START = forward(UR5, HOME[None])[0]
STEP = 0.004
LIMITS = GoalLimits(rate=5e-3)


def correction(offset=6e-4):
    entry = {'effect': 'joint_offset', 'joint': 'elbow_joint', 'offset': offset}
    model = ProgramModel(UR5, (effect_from_mapping(entry),))
    return PoseCorrection(model, UR5.T_flange_tool)


def stream(**options):
    return PoseStream(correction(), LIMITS, **options)


class Run:
    """Poses given to a stream on a beat, and what was added to each."""

    def __init__(self, stream):
        self.stream, self.now, self.pose, self.added = stream, 10.0, START.copy(), []

    def go(self, count, speed=0.0, withdrawn='', arm=HOME):
        """Go on at a speed [m/s] along x; return the last answer."""
        for _ in range(count):
            self.now += STEP
            self.pose = self.pose.copy()
            self.pose[0, 3] += speed * STEP
            given = self.stream.take(self.pose, self.now, arm, withdrawn)
            self.stream.settle()
            sent = None if given.pose is None else between(self.pose, given.pose)
            self.added.append(sent)
        return given

    def changes(self, last):
        """Return how fast what was added changed over the last poses [m/s]."""
        rows = np.array(self.added[-last:])[:, :3]
        return np.linalg.norm(np.diff(rows, axis=0), axis=1) / STEP


def test_it_is_faded_in_before_the_first_pose_is_followed_and_then_stays():
    run = Run(stream())
    run.go(60)
    assert np.abs(run.added[0]).max() < 1e-12
    full = run.added[-1]
    assert np.linalg.norm(full[:3]) > 1e-4
    assert run.changes(60).max() < 1.01 * LIMITS.rate
    run.go(100, speed=0.05)
    # What is added follows the model, which changes by some thousandths of the way.
    assert run.changes(100).max() < 2e-4


def test_a_withdrawal_waits_for_the_standstill():
    run = Run(stream(passing=True))
    run.go(60)
    run.go(50, speed=0.05)
    before = run.added[-1]
    run.go(50, speed=0.05, withdrawn='the model was exchanged')
    assert run.changes(50).max() < 2e-4
    assert np.linalg.norm(run.added[-1] - before) < 1e-5
    given = run.go(120, withdrawn='the model was exchanged')
    assert given.why == 'the model was exchanged'
    assert np.abs(run.added[-1]).max() == 0.0
    assert run.changes(120).max() < 1.01 * LIMITS.rate
    run.go(50, speed=0.05)  # it is used again, but not while the stream moves
    assert np.abs(run.added[-1]).max() == 0.0
    run.go(120)
    assert np.linalg.norm(run.added[-1][:3]) > 1e-4


def test_another_correction_counts_from_the_standstill_on_and_is_faded_over_to():
    run, half = Run(stream()), Run(PoseStream(correction(3e-4), LIMITS))
    for each in (run, half):
        each.go(60)
    run.stream.renew(correction(3e-4))
    for each in (run, half):
        each.go(100, speed=0.05)
    assert run.changes(100).max() < 2e-4
    assert np.linalg.norm(run.added[-1] - half.added[-1]) > 1e-4
    for each in (run, half):
        each.go(120)
    assert run.changes(120).max() < 1.01 * LIMITS.rate
    np.testing.assert_allclose(run.added[-1], half.added[-1], atol=1e-9)


def test_stopped_nothing_is_sent_and_what_comes_from_elsewhere_is_no_beginning():
    run = Run(stream())
    run.go(60)
    given = run.go(60, withdrawn='the tracker is lost')
    assert (given.pose, given.why) == (None, 'the tracker is lost')
    run.pose[0, 3] += 0.1
    given = run.go(60)
    assert given.pose is None
    assert 'from where the arm stands' in given.why
    run.pose[0, 3] -= 0.1
    assert run.go(60).pose is not None


@pytest.mark.parametrize(('passing', 'sent'), [(False, None), (True, 0.0)])
def test_where_the_arm_stands_must_be_known(passing, sent):
    run = Run(stream(passing=passing))
    given = run.go(3, arm=None)
    assert 'no joint states' in given.why
    assert (given.pose is None) == (sent is None)
    if sent is not None:
        assert np.abs(run.added[-1]).max() == sent


def test_the_shadow_tells_and_sends_nothing():
    given = Run(stream(shadow=True)).go(3)
    assert given.pose is None
    assert np.linalg.norm(given.added[:3]) > 1e-4


def test_a_leap_that_no_joint_can_follow_is_not_passed_on():
    run = Run(stream())
    run.go(60)
    leap = np.zeros((4, 4))
    leap[1, 3] = 0.1
    run.pose = run.pose + leap  # in one step of a stream that stands where the arm stands
    given = run.go(1)
    assert given.pose is None
    assert 'limit of velocity' in given.why
    run.pose = run.pose - leap
    assert run.go(60).pose is not None


def test_looks_made_in_a_process_beside_are_the_same_and_no_pose_waits_for_one():
    beside, here = LooksBeside(), Run(stream())
    try:
        run = Run(stream(beside=beside))
        until(lambda: beside.answer() is None and beside.up)
        run.stream.correction.first = run.stream.correction.exact = None  # it looks at none itself
        run.go(1)
        assert np.abs(run.added[0]).max() < 1e-12  # held where the arm stands
        until(lambda: run.go(1) and run.stream.corrected)
        for _ in range(18):
            run.go(2, speed=0.05)
            until(lambda: run.stream.settle() is None and beside.free)
        here.go(len(run.added) - 36)
        here.go(36, speed=0.05)
        assert all(sent is not None for sent in run.added)
        np.testing.assert_allclose(run.added[-1], here.added[-1], atol=2e-9)
        assert np.linalg.norm(run.added[-1][:3]) > 1e-4
    finally:
        beside.close()
    del run.stream.correction.first, run.stream.correction.exact
    assert run.go(50, speed=0.05).pose is not None  # where the process is gone, it goes on alone


def until(so):
    end = time.monotonic() + 60.0
    while not so():
        assert time.monotonic() < end
        time.sleep(0.005)


def test_poses_that_break_a_limit_of_a_joint_end_the_correction():
    run = Run(stream(passing=True))
    run.go(60)
    run.go(2)
    given = run.go(60, speed=3.0)
    assert 'limit of' in given.why
    # What was added stays, so that it does not jump while the stream moves.
    assert np.linalg.norm(run.added[-1][:3]) > 1e-4
