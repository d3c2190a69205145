# Copyright 2026 weld_twin contributors
# SPDX-License-Identifier: Apache-2.0
"""Signs that a formula holds: it wants the same everywhere, and its name comes back."""

import numpy as np
import pytest

import weld_twin_core as wt
from weld_twin_core.diagnosis.trust.signs_of_found import worst_of


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
    assert right.answer['own_wander'] < other.answer['own_wander']
    assert right.causes[0]['own_back'] == 1.0


def test_the_whole_answer_has_the_worst_of_its_effects():
    each = [{'own_back': 1.0, 'own_wander': 0.1}, {'own_back': 0.8, 'own_wander': 0.0}, {}]
    assert worst_of(each) == {'own_back': 0.8, 'own_wander': 0.1}
