# Copyright 2026 weld_twin contributors
# SPDX-License-Identifier: Apache-2.0
"""Few stations: what is found in them has to be more than what is found in noise."""

from __future__ import annotations

import numpy as np
import pytest

import weld_twin_core as wt
from weld_twin_core.diagnosis.unseen.chance import (
    Candidates,
    chance_gain,
    chance_ratio,
    left_out,
    may_be_chance,
    noise,
)

NOISE = 3e-5


def stations(seed, effects=(), count=15):
    """Return a UR5 at some postures, with effects or sound, and an instrument's noise."""
    robot, rng = wt.load('ur5'), np.random.default_rng(seed)
    q = rng.uniform(-1.2, 1.2, (count, 6)) + [0, -1.2, 1.2, 0, 0.5, 0]
    still = wt.Recording('cell', wt.JointMotion(np.arange(float(count)), q, static=True))
    points = wt.Twin(robot, effects).poses(still).position
    points = points + NOISE * rng.normal(size=points.shape)
    return robot, still.with_measured(wt.Measurements(still.joints.t, points))


@pytest.mark.parametrize('seed', [5, 22])
def test_a_sound_arm_at_fifteen_stations_has_nothing_but_noise(seed):
    robot, recording = stations(seed)
    found = wt.diagnose(recording, robot, align='base,tool', experiment=False)
    assert found.status == 'none' and not found.effects and not found.families


def test_a_zero_that_is_off_is_found_at_as_many():
    robot, recording = stations(5, [wt.effects.JointOffset('elbow_joint', 2e-3)])
    found = wt.diagnose(recording, robot, align='base,tool', experiment=False)
    assert found.status in ('identified', 'ambiguous')
    assert 'elbow_joint' in {effect.effect.site for effect in found.effects}


def test_parts_are_predicted_as_by_fits_without_them():
    rng = np.random.default_rng(1)
    columns, targets = rng.normal(size=(4, 30)), rng.normal(size=(3, 30))
    precision, labels = np.array([0.0, 0.5, 2.0, 0.0]), np.arange(30) // 6
    got = left_out(columns, precision, labels, targets)
    for part in range(5):
        out = labels == part
        rows = np.vstack([columns[:, ~out].T, np.diag(np.sqrt(precision))])
        for target, left in zip(targets, got, strict=True):
            right = np.concatenate([target[~out], np.zeros(4)])
            x = np.linalg.lstsq(rows, right, rcond=None)[0]
            np.testing.assert_allclose(left[out], target[out] - x @ columns[:, out], rtol=1e-6)


def groups(count, rows):
    return np.random.default_rng(2).normal(size=(count, 5, rows))


def test_the_best_of_many_reaches_more_of_noise_than_the_best_of_few():
    rows, ways = 45, [np.arange(45) // 6]
    fixed = np.ones((1, rows))
    few, many = (
        chance_gain(Candidates(fixed, np.zeros(1), groups(k, rows), (1.0, 10.0), ways), 0.0)
        for k in (2, 60)
    )
    assert 0.0 < few < many < 0.6
    # Nothing is drawn where noise cannot do what was found.
    assert may_be_chance(rows, many) and not may_be_chance(rows, 0.9)
    assert not may_be_chance(5000, 0.05)


def test_a_fit_of_few_rows_leaves_too_little_where_it_was_fitted():
    rows = 45
    columns = np.random.default_rng(4).normal(size=(12, rows))
    ways = [np.arange(rows) // 6]
    got = chance_ratio(columns, np.zeros(12), ways, known=True)
    by_hand = np.sqrt((left_out(columns, np.zeros(12), ways[0], noise(rows)) ** 2).mean(axis=1))
    assert got == pytest.approx(by_hand.max()) and 1.2 < got < 2.5
    assert chance_ratio(columns, np.zeros(12), ways, known=False) > got
