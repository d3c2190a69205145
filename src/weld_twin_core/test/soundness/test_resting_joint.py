# Copyright 2026 weld_twin contributors
# SPDX-License-Identifier: Apache-2.0
"""Frames that are open, and joints that rest in one of two recordings."""

import numpy as np
import pytest
from small_arm import small_arm

import weld_twin_core as wt
from weld_twin_core.arm.chain import forward
from weld_twin_core.twin.posterior import postures_within_limits


@pytest.fixture
def arm():
    return small_arm()


def recorded(arm, name, rests):
    t = np.arange(150) / 25.0
    q = np.array([0.3, -1.3, 1.5]) + 0.3 * np.sin(t[:, None] * np.array([1.0, 1.3, 0.7]))
    if rests:
        q[:, 0] = 0.0
    motion = wt.JointMotion(t, q)
    off = wt.effects.JointOffset('elbow_joint', offset=5e-4)
    real = wt.Twin(arm, [off]).poses(wt.Recording(name, motion))
    noise = np.random.default_rng(0).normal(0.0, 3e-5, real.position.shape)
    return wt.Recording(name, motion, wt.Measurements(t, real.position + noise))


def test_a_joint_that_rests_in_one_of_two_recordings_is_examined_like_the_others(arm):
    found = wt.diagnose(
        [recorded(arm, 'free', False), recorded(arm, 'seam', True)], arm, experiment=False
    )
    assert found.status != 'unsound'


def test_stations_and_a_path_are_diagnosed_together(arm):
    path = recorded(arm, 'path', False)
    q = path.joints.q[::5]
    at_rest = wt.JointMotion(10.0 * np.arange(len(q)), q, static=True)
    off = wt.effects.JointOffset('elbow_joint', offset=5e-4)
    real = wt.Twin(arm, [off]).poses(wt.Recording('stations', at_rest))
    noise = np.random.default_rng(1).normal(0.0, 3e-5, real.position.shape)
    stations = wt.Recording('stations', at_rest, wt.Measurements(at_rest.t, real.position + noise))
    found = wt.diagnose([path, stations], arm, experiment=False)
    assert [(e.effect.name, e.effect.site) for e in found.effects] == [
        ('joint_offset', 'elbow_joint')
    ]


def test_ripple_is_found_in_a_path_beside_stations_that_came_first(arm):
    path = recorded(arm, 'path', False).joints
    rng = np.random.default_rng(4)
    at_rest = wt.JointMotion(
        15.0 * np.arange(15), path.q[0] + rng.uniform(-1.0, 1.0, (15, 3)), static=True
    )
    ripple = wt.effects.TransmissionRipple('shoulder_lift_joint', amplitude=8e-4, order=50.0)
    made = []
    for name, motion in (('stations', at_rest), ('path', path)):
        real = wt.Twin(arm, [ripple]).poses(wt.Recording(name, motion))
        seen = real.position + rng.normal(0.0, 3e-5, real.position.shape)
        made.append(wt.Recording(name, motion, wt.Measurements(motion.t, seen)))
    found = wt.diagnose(made, arm, experiment=False)
    assert [(e.effect.name, e.effect.site) for e in found.effects] == [
        ('transmission_ripple', 'shoulder_lift_joint')
    ]
    assert found.effects[0].effect.order == 50.0


NOISE = 2e-5


def seen_from(robot, real, path='spline'):
    """A seam along which the tool hardly turns, measured on an arm that is ``real``."""
    plan = wt.plan(robot, wt.default_seam(robot, path), 'aggressive', rate_hz=25.0)
    commanded = wt.Recording('seam', plan.motion)
    play = wt.effects.Backlash('elbow_joint', width=5e-4)
    poses = wt.Twin(real, [play]).poses(commanded)
    noise = np.random.default_rng(3).normal(scale=NOISE, size=poses.position.shape)
    return commanded.with_measured(
        wt.Measurements(plan.motion.t, poses.position + noise, poses.rotation)
    )


@pytest.fixture(scope='module')
def robot():
    return wt.load('ur5')


def test_frames_that_were_right_stay_right_all_over_the_workspace(robot):
    found = wt.diagnose(seen_from(robot, robot), robot, align='base,tool', experiment=False)
    assert found.posterior.left_open
    fitted = found.model.twin(0).robot
    q = postures_within_limits(robot, 100)
    off = forward(fitted, q)[:, :3, 3] - forward(robot, q)[:, :3, 3]
    # A fit alone is off by several millimetres here.
    assert np.linalg.norm(off, axis=1).max() < 5e-4


def test_a_moved_base_is_fitted_all_the_same(robot):
    base = np.array(robot.T_world_base)
    base[:3, 3] += [0.004, -0.006, 0.005]
    recording = seen_from(robot, robot.with_frames(base=base))
    found = wt.diagnose(recording, robot, align='base,tool', experiment=False)
    fitted = found.model.twin(0)
    t = recording.measured.t
    left = fitted.poses(recording, t).position - recording.measured.position
    assert np.sqrt((left**2).mean()) < 1.5 * NOISE
