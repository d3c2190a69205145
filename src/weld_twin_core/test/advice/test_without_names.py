# Copyright 2026 weld_twin contributors
# SPDX-License-Identifier: Apache-2.0
"""Where no effect of the library fits, an experiment parts places and dependences."""

import numpy as np
import pytest
from small_arm import small_arm

import weld_twin_core as wt
from weld_twin_core.diagnosis.advice import Limits
from weld_twin_core.effects.curves import JointCurve

BENT = JointCurve('elbow_joint', (1e-3, -4e-4, 0.0, -4e-4, 1e-3), (-1, -0.5, 0, 0.5, 1), 'speed')
"""Nothing in the library depends on speed like this; at half of it four waves leave the noise alone."""


@pytest.fixture(scope='module')
def found():
    robot, rng = small_arm(), np.random.default_rng(8)
    middle = np.array([0.2, -1.3, 1.2])
    t = np.arange(0.0, 30.0, 0.04)
    rates = 2.0 * np.pi * np.array([0.13, 0.17, 0.19])
    start = (1.0 - np.exp(-(t**3)))[:, None]
    motion = wt.JointMotion(t, middle + 0.5 * start * np.sin(rates * t[:, None] + np.arange(3)))
    bare = wt.Recording('free', motion)
    real = wt.Twin(robot, [BENT]).poses(bare).position
    seen = wt.Measurements(t, real + rng.normal(0.0, 2e-5, real.shape))
    limits = Limits(minutes=5.0, set_up=False)
    return wt.diagnose(bare.with_measured(seen), robot, limits=limits)


def test_what_is_held_apart_are_places_and_what_they_depend_on(found):
    assert found.status == 'unknown'
    asked = found.next_experiment
    assert asked['between'] is not None and asked['motion'] is not None
    items = [item for side in asked['between'] for item in side]
    curves = [item for item in items if item['effect'] == 'joint_curve']
    assert curves and all(set(item) == {'effect', 'joint', 'at', 'on'} for item in items)
    assert any(item['at'] == 'elbow_joint' and item['on'] == 'speed' for item in curves)
    assert 'something at elbow_joint that depends on speed' in asked['reason']


def test_no_more_than_an_even_chance_is_promised_without_a_name(found):
    assert 0.0 <= found.next_experiment['promise'] <= 0.5
