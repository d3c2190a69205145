# Copyright 2026 weld_twin contributors
# SPDX-License-Identifier: Apache-2.0
"""Which errors are one by structure, and shares of causes that overlap."""

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
    t = np.arange(0.0, 12.0, 0.04)
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


FINE = 2e-5
LAG = wt.effects.ServoLag('joint_a1', time_constant=0.004)
ZERO = wt.effects.JointOffset('joint_a2', offset=3e-4)
PLAY = wt.effects.Backlash('joint_a3', width=6e-4)


@pytest.fixture(scope='module')
def cell():
    robot = wt.load('kuka_kr6_r900')
    plan = wt.plan(robot, wt.default_seam(robot, 'weave'), 'aggressive', rate_hz=25.0, fit=True)
    seam = wt.Recording('seam', plan.motion)
    noise = np.random.default_rng(3).normal(scale=FINE, size=(plan.motion.t.size, 3))
    real = wt.Twin(robot, [LAG, ZERO, PLAY]).poses(seam).position + noise
    measured = seam.with_measured(wt.Measurements(plan.motion.t, real))
    return robot, seam, noise, wt.diagnose(measured, robot, experiment=False)


def rms(deviation):
    return float(np.sqrt((deviation**2).sum(axis=-1).mean()))


def part_of(found, name):
    (k,) = [k for k, c in enumerate(found.causes) if c.name[0][0].effect == name]
    return found.contributions.parts[0][k]


@pytest.mark.parametrize('mended', [(LAG,), (ZERO,), (LAG, PLAY), (LAG, ZERO, PLAY)])
def test_thinking_causes_away_leaves_what_an_arm_without_them_has(cell, mended):
    robot, seam, noise, found = cell
    rest = [effect for effect in (LAG, ZERO, PLAY) if effect not in mended]
    truth = wt.Twin(robot, rest).poses(seam).position + noise - wt.Twin(robot).poses(seam).position
    gap = found.contributions.left[0] + found.contributions.parts[0].sum(axis=0)
    told = gap - sum(part_of(found, effect.name) for effect in mended)
    assert rms(told) == pytest.approx(rms(truth), rel=0.03)
    assert rms(told - truth) < FINE / 2


def test_what_is_left_and_all_parts_are_the_figures_of_the_diagnosis(cell):
    found = cell[-1]
    left, parts = found.contributions.left[0], found.contributions.parts[0]
    assert rms(left) == pytest.approx(found.shrink.rms_after_m, rel=1e-9)
    assert rms(left + parts.sum(axis=0)) == pytest.approx(found.shrink.rms_before_m, rel=1e-9)


"""Standard deviation of every coordinate [m]; so coarse that shares are open by a per cent."""
SHOULDER, ELBOW = 'shoulder_lift_joint', 'elbow_joint'


def swings():
    """Return an arm whose joints swing at frequencies of their own for 20 s."""
    rng = np.random.default_rng(3)
    t = np.arange(0.0, 20.0, 0.04)
    sizes, rates = rng.uniform(0.3, 0.9, 3), rng.uniform(0.05, 0.3, 3)
    q = np.array([0.3, -1.2, 1.4]) + sizes * np.sin(2 * np.pi * t[:, None] * rates)
    return small_arm(), wt.JointMotion(t, q)


def solved(effects, seed=5):
    """Return the diagnosis of swings with some effects, and the noise that it holds."""
    robot, motion = swings()
    real = wt.Twin(robot, effects).poses(wt.Recording('swings', motion))
    noise = np.random.default_rng(seed).normal(scale=1e-4, size=real.position.shape)
    measured = wt.Measurements(motion.t, real.position + noise)
    return wt.diagnose(
        wt.Recording('swings', motion, measured=measured), robot, experiment=False
    ), noise


def true_shares(effects, noise):
    """Return what each effect takes of the squared gap, from how far it moves the tool itself."""
    robot, motion = swings()
    ideal = wt.Twin(robot).poses(wt.Recording('swings', motion)).position

    def moved(some):
        return wt.Twin(robot, some).poses(wt.Recording('swings', motion)).position - ideal

    whole = moved(effects)
    along = np.array([max((moved([effect]) * whole).sum(), 0.0) for effect in effects])
    return along / along.sum() * (whole**2).sum() / ((whole**2).sum() + (noise**2).sum())


def intervals(answer):
    return {cause.name[0][0].effect: cause.share_ci90 for cause in answer.causes}


@pytest.fixture(scope='module')
def overlapping():
    effects = [
        wt.effects.JointOffset(SHOULDER, offset=8e-4),
        wt.effects.Backlash(ELBOW, width=1.2e-3),
    ]
    return effects, *solved(effects)


def test_the_intervals_of_causes_that_overlap_hold_their_true_shares(overlapping):
    effects, answer, noise = overlapping
    told = intervals(answer)
    for effect, true in zip(effects, true_shares(effects, noise), strict=True):
        low, high = told[effect.name]
        assert low <= true <= high
        assert 0.001 < high - low < 0.1


def test_a_cause_that_works_against_the_others_has_a_share_of_none():
    effects = [
        wt.effects.JointOffset(SHOULDER, offset=1e-3),
        wt.effects.GearRatio(ELBOW, scale=-4e-4),
    ]
    answer, noise = solved(effects)
    true = dict(zip((e.name for e in effects), true_shares(effects, noise), strict=True))
    assert min(true.values()) == 0.0
    for name, (low, high) in intervals(answer).items():
        assert low <= true[name] <= high
