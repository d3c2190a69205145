# Copyright 2026 weld_twin contributors
# SPDX-License-Identifier: Apache-2.0
"""Errors that one motion shows alike, and another tells apart."""

import numpy as np
import pytest

import weld_twin_core as wt

STILL = 'wrist_2_joint'
REST = 1.2
"""Angle [rad] at which the joint rests."""


@pytest.fixture(scope='module')
def robot():
    return wt.load('ur5')


def motion(robot, effects, reach, seed=3):
    """Return ten seconds in which one joint moves as far about its rest as ``reach`` [rad]."""
    t = np.linspace(0.0, 10.0, 301)
    rng = np.random.default_rng(seed)
    waves = np.sin(np.outer(t, [0.9, 0.7, 1.1, 1.3, 0.8, 1.7]) + rng.uniform(0.0, 6.0, 6))
    q = [0.3, -1.2, 1.4, -1.0, REST, 0.4] + waves * [0.8, 0.4, 0.5, 0.6, reach, 0.9]
    commanded = wt.Recording('cell', wt.JointMotion(t, q))
    poses = wt.Twin(robot, effects).poses(commanded, t)
    noise = 3e-5 * rng.standard_normal(poses.position.shape)
    return commanded.with_measured(wt.Measurements(t, poses.position + noise))


def told(diagnosis):
    return [{(s.effect, s.joint) for s in group} for group in diagnosis.indistinguishable]


@pytest.fixture(scope='module')
def scaled(robot):
    """A gear with a wrong ratio, in a joint that rests far from its zero."""
    return [wt.effects.GearRatio(STILL, 1e-3)]


def test_a_joint_at_rest_shows_its_gear_ratio_as_a_zero(robot, scaled):
    found = wt.diagnose(motion(robot, scaled, 0.0), robot, experiment=False)
    (group,) = told(found)
    assert {('joint_offset', STILL), ('gear_ratio', STILL)} <= group
    assert found.status == 'ambiguous'


def test_where_a_held_out_motion_moves_the_joint_the_one_that_carries_over_is_named(robot, scaled):
    train, moved = motion(robot, scaled, 0.0), motion(robot, scaled, 0.9, seed=4)
    found = wt.diagnose(train, robot, holdout=[moved], experiment=False)
    assert (found.status, told(found)) == ('identified', [{('gear_ratio', STILL)}])
    (effect,) = found.model.found
    assert effect.scale == pytest.approx(1e-3, rel=0.05)
    assert found.shrink.rms_after_m < 6e-5


def test_a_wrong_zero_stays_a_wrong_zero_there(robot):
    zero = [wt.effects.JointOffset(STILL, 1.2e-3)]
    train, moved = motion(robot, zero, 0.0), motion(robot, zero, 0.9, seed=4)
    group = told(wt.diagnose(train, robot, holdout=[moved], experiment=False))[0]
    assert ('joint_offset', STILL) in group
    assert ('gear_ratio', STILL) not in group
