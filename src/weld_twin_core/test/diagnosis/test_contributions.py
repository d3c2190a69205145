# Copyright 2026 weld_twin contributors
# SPDX-License-Identifier: Apache-2.0
"""What would be left if causes were mended: held against an arm from which they are gone."""

import numpy as np
import pytest

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
