# Copyright 2026 weld_twin contributors
# SPDX-License-Identifier: Apache-2.0
"""Signs that a formula holds: nothing is left at its joint, and it wants the same everywhere."""

import numpy as np
import pytest

import weld_twin_core as wt
from weld_twin_core.diagnosis.trust.signs_of_found import worst_of
from weld_twin_core.diagnosis.unseen.own_joint import since_turned


@pytest.fixture(scope='module')
def play():
    """Return a robot, and a recording of it with play in its elbow."""
    robot = wt.load('ur5')
    plan = wt.plan(robot, wt.default_seam(robot, 'spline'), 'aggressive', rate_hz=50.0)
    commanded = wt.Recording('seam', plan.motion)
    real = wt.Twin(robot, [wt.effects.Backlash('elbow_joint', width=5e-4)]).poses(commanded)
    noise = np.random.default_rng(7).normal(scale=2e-5, size=real.position.shape)
    return robot, commanded.with_measured(wt.Measurements(plan.motion.t, real.position + noise))


def test_what_stands_in_for_another_cause_shows(play):
    robot, recording = play
    right = wt.diagnose(recording, robot).signs
    other = wt.diagnose(recording, robot, exclude=('backlash',)).signs
    assert right.answer['own_left'] < 0.02 < other.answer['own_left']
    assert right.answer['own_wander'] < other.answer['own_wander']
    assert right.causes[0]['own_back'] == 1.0
    assert right.causes[0]['own_formula'] > 0.0


def test_the_way_since_a_joint_turned_round_starts_anew_at_each_turn():
    q = np.concatenate([np.linspace(0.0, 1.0, 11), np.linspace(0.9, 0.5, 5)])
    speed = np.concatenate([np.ones(11), -np.ones(5)])
    since = since_turned(q, speed)
    assert since[:11] == pytest.approx(q[:11])
    assert since[11:] == pytest.approx([0.0, 0.1, 0.2, 0.3, 0.4])


def test_noise_at_rest_turns_nothing_round():
    q = np.array([0.0, 0.1, 0.1 + 1e-6, 0.1 - 1e-6, 0.2])
    speed = np.array([1.0, 1.0, 1e-4, -1e-4, 1.0])
    assert since_turned(q, speed) == pytest.approx(q)


def test_the_whole_answer_has_the_worst_of_its_effects():
    each = [{'own_back': 1.0, 'own_left': 0.1}, {'own_back': 0.8, 'own_left': 0.0}, {}]
    assert worst_of(each) == {'own_back': 0.8, 'own_left': 0.1}
