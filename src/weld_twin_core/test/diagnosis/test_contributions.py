# Copyright 2026 weld_twin contributors
# SPDX-License-Identifier: Apache-2.0
"""What each cause takes of the gap: sample by sample, and as a share with its interval."""

import numpy as np
import pytest
from small_arm import small_arm

import weld_twin_core as wt

NOISE = 2e-5
LAG = wt.effects.ServoLag('joint_a1', time_constant=0.004)
ZERO = wt.effects.JointOffset('joint_a2', offset=3e-4)
PLAY = wt.effects.Backlash('joint_a3', width=6e-4)


@pytest.fixture(scope='module')
def cell():
    robot = wt.load('kuka_kr6_r900')
    plan = wt.plan(robot, wt.default_seam(robot, 'weave'), 'aggressive', rate_hz=50.0, fit=True)
    seam = wt.Recording('seam', plan.motion)
    noise = np.random.default_rng(3).normal(scale=NOISE, size=(plan.motion.t.size, 3))
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
    assert rms(told - truth) < NOISE / 2


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
