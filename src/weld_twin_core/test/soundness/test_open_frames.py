# Copyright 2026 weld_twin contributors
# SPDX-License-Identifier: Apache-2.0
"""What a seam cannot show of the frames stays as it was given; what it shows is fitted."""

import numpy as np
import pytest

import weld_twin_core as wt
from weld_twin_core.arm.chain import forward
from weld_twin_core.twin.posterior import postures_within_limits

NOISE = 2e-5


def recorded(robot, real, path='spline'):
    """A seam along which the tool hardly turns, measured on an arm that is ``real``."""
    plan = wt.plan(robot, wt.default_seam(robot, path), 'aggressive', rate_hz=50.0)
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
    found = wt.diagnose(recorded(robot, robot), robot, align='base,tool', experiment=False)
    assert found.posterior.left_open
    fitted = found.model.twin(0).robot
    q = postures_within_limits(robot, 100)
    off = forward(fitted, q)[:, :3, 3] - forward(robot, q)[:, :3, 3]
    # A fit alone is off by several millimetres here.
    assert np.linalg.norm(off, axis=1).max() < 5e-4


def test_a_moved_base_is_fitted_all_the_same(robot):
    base = np.array(robot.T_world_base)
    base[:3, 3] += [0.004, -0.006, 0.005]
    recording = recorded(robot, robot.with_frames(base=base))
    found = wt.diagnose(recording, robot, align='base,tool', experiment=False)
    fitted = found.model.twin(0)
    t = recording.measured.t
    left = fitted.poses(recording, t).position - recording.measured.position
    assert np.sqrt((left**2).mean()) < 1.5 * NOISE
