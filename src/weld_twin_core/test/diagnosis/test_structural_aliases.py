# Copyright 2026 weld_twin contributors
# SPDX-License-Identifier: Apache-2.0
"""Constant errors that are one error on every motion are told as a set."""

import numpy as np
import pytest
from small_arm import small_arm

import weld_twin_core as wt
from weld_twin_core.diagnosis.algebra.motions import same_error
from weld_twin_core.effects import effect_from_mapping

NOISE = 2e-5


def error(name, joint=None):
    return effect_from_mapping({'effect': name} | ({'joint': joint} if joint else {}))


@pytest.mark.parametrize(
    ('one', 'other', 'same'),
    [
        # The first joint turns about the base's z and its d lies along it.
        (('joint_offset', 'shoulder_pan_joint'), ('base_pose',), True),
        (('link_offset', 'shoulder_pan_joint'), ('base_pose',), True),
        # Axes 2, 3 and 4 of a UR are parallel: it does not matter where along them it is longer.
        (('link_offset', 'shoulder_lift_joint'), ('link_offset', 'wrist_1_joint'), True),
        # With a twist of 90 deg Hayati's turn about y is a turn about the next axis' z.
        (('axis_parallelism', 'wrist_1_joint'), ('joint_offset', 'wrist_1_joint'), True),
        (('link_length', 'wrist_3_joint'), ('tool_pose',), True),
        (('link_twist', 'shoulder_pan_joint'), ('base_pose',), False),
        (('joint_offset', 'elbow_joint'), ('joint_offset', 'shoulder_lift_joint'), False),
        (('link_length', 'elbow_joint'), ('link_length', 'shoulder_lift_joint'), False),
    ],
)
def test_which_errors_are_one_follows_from_the_arm(one, other, same):
    robot = wt.load('ur5')
    assert same_error(robot, error(*one), error(*other)) is same


def stations(effects, count=80, seed=5):
    rng = np.random.default_rng(seed)
    robot = wt.load('ur5')
    q = rng.uniform([-2, -2, 0.4, -2.5, -2.2, -3], [2, -0.6, 2.2, -0.5, -0.8, 3], (count, 6))
    commanded = wt.Recording('stations', wt.JointMotion(np.arange(float(count)), q, static=True))
    real = wt.Twin(robot, effects).poses(commanded)
    noise = rng.normal(scale=NOISE, size=real.position.shape)
    return commanded.with_measured(wt.Measurements(commanded.joints.t, real.position + noise))


def test_an_excluded_twin_of_what_was_found_is_told_beside_it():
    recording = stations([wt.effects.LinkOffset('shoulder_pan_joint', dd=8e-4)])
    found = wt.diagnose(recording, wt.load('ur5'), exclude=('link_offset',), experiment=False)
    (group,) = found.indistinguishable
    told = {(site.effect, site.joint) for site in group}
    assert ('link_offset', 'shoulder_pan_joint') in told


def test_an_excluded_error_that_is_no_twin_is_not_told():
    recording = stations([wt.effects.JointOffset('elbow_joint', offset=6e-4)])
    found = wt.diagnose(recording, wt.load('ur5'), exclude=('link_length',), experiment=False)
    assert found.status == 'identified'
    assert [(s.effect, s.joint) for s in found.indistinguishable[0]] == [
        ('joint_offset', 'elbow_joint')
    ]


def swinging(robot, effects, noise=NOISE, home=(0.0, -1.2, 1.4, -1.0, -1.5, 0.0), moved=1.0):
    t = np.arange(0.0, 12.0, 0.02)
    way = 0.4 * moved * np.sin(np.outer(t, 0.9 + 0.31 * np.arange(robot.n)))
    q = np.array(home[: robot.n]) + way
    commanded = wt.Recording('swing', wt.JointMotion(t, q))
    real = wt.Twin(robot, effects).poses(commanded)
    drawn = np.random.default_rng(3).normal(scale=noise, size=real.position.shape)
    return commanded.with_measured(wt.Measurements(t, real.position + drawn))


def test_play_that_was_taken_out_is_told_beside_friction_where_noise_hides_their_curves():
    recording = swinging(small_arm(), [wt.effects.Backlash('elbow_joint', width=4e-4)], 8e-5)
    found = wt.diagnose(recording, small_arm(), exclude=('backlash',), experiment=False)
    assert found.status == 'ambiguous'
    (group,) = found.indistinguishable
    assert {('friction', 'elbow_joint'), ('backlash', 'elbow_joint')} <= {
        (site.effect, site.joint) for site in group
    }


def test_a_wobble_of_a_bearing_at_rest_is_told_beside_the_twist_that_it_is_there():
    robot, moved = wt.load('ur5'), np.array([1.0, 1.0, 1.0, 0.0, 1.0, 1.0])
    twisted = [wt.effects.LinkTwist('elbow_joint', dalpha=1e-3)]
    found = wt.diagnose(swinging(robot, twisted, moved=moved), robot, experiment=False)
    (group,) = found.indistinguishable
    assert {('link_twist', 'elbow_joint'), ('bearing_tilt', 'wrist_1_joint')} == {
        (site.effect, site.joint) for site in group
    }


@pytest.mark.parametrize(('offset', 'told'), [(3e-4, True), (-3e-4, False)])
def test_play_that_a_load_holds_on_one_flank_is_told_beside_an_offset_to_that_side(offset, told):
    # About an upper arm that leans forward the load never changes sign, and pulls it down.
    robot, joint = small_arm(), 'shoulder_lift_joint'
    zero = [wt.effects.JointOffset(joint, offset=offset)]
    recording = swinging(robot, zero, home=(0.0, -0.8, 0.9))
    found = wt.diagnose(recording, robot, experiment=False)
    named = {(s.effect, s.joint) for group in found.indistinguishable for s in group}
    assert ('joint_offset', joint) in named
    assert (('loaded_play', joint) in named) is told
