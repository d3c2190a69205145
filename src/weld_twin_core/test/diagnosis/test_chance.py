# Copyright 2026 weld_twin contributors
# SPDX-License-Identifier: Apache-2.0
"""What is found is more than chance makes: in few stations, and on parts left out in turn."""

import numpy as np
import pytest

import weld_twin_core as wt
from weld_twin_core.diagnosis.unseen.chance import (
    Candidates,
    chance_gain,
    chance_ratio,
    may_be_chance,
    noise,
)
from weld_twin_core.diagnosis.unseen.folds import gain, growth, jackknife
from weld_twin_core.effects.hooks import highest_order

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
    # And no program is moved by what the noise allows.
    assert found.posterior.centred(())[0] == ()


def test_a_sound_arm_with_four_stray_readings_is_sound_and_they_are_named():
    robot, recording = stations(7, count=60)
    points, strays = np.array(recording.measured.position), [3, 17, 40, 58]
    points[strays] += 60.0 * NOISE * np.array([[1, 1, -1], [-1, 1, 1], [1, -1, 1], [1, 1, 1]])
    seen = wt.Measurements(recording.joints.t, points)
    told = wt.diagnose(recording.with_measured(seen), robot, align='base,tool', experiment=False)
    assert told.status == 'none'
    named = 'station 4, station 18, station 41, station 59' in told.reasons[0]
    assert named or not told.traces.trusted[0][strays].any()


def test_many_small_errors_do_better_than_one_by_more_than_chance_or_not_at_all():
    robot, recording = stations(48, [wt.effects.JointOffset('wrist_1_joint', 9e-4)], 10)
    found = wt.diagnose(recording, robot, align='base,tool', experiment=False)
    assert not found.families
    assert [effect.effect.site for effect in found.effects] == ['wrist_1_joint']
    assert found.gap.noise_floor_m > 0.5 * NOISE


def test_a_gear_that_stiffens_under_its_load_is_no_play():
    """Its compliance falls to a half at a fifth of the largest load, as of no library effect."""
    joint, robot = 'shoulder_lift_joint', wt.load('ur5')
    load, halved = np.linspace(-65.0, 65.0, 41), 13.0
    gear = wt.effects.JointCurve(
        joint, 3e-5 * load / (1.0 + np.abs(load) / halved), load, over='load'
    )
    _, recording = stations(9, [gear], 60)
    found = wt.diagnose(recording, robot, align='base,tool', experiment=False)
    assert 'stiffening' in {site.effect for site, _ in found.causes[0].name}
    assert not any(e.effect.name == 'loaded_play' for e in found.effects)


def test_a_fine_wave_is_told_though_stations_are_too_few_for_all_slower_ones_together():
    joint = 'wrist_1_joint'
    wave = wt.effects.TransmissionRipple(joint, amplitude=1.5e-3, order=80.0, phase=0.7)
    robot, recording = stations(11, [wave], 55)
    assert highest_order(recording.joints.q[:, 3]) < 75.0
    found = wt.diagnose(recording, robot, align='base,tool', experiment=False)
    assert [(e.effect.name, e.effect.site) for e in found.effects] == [
        ('transmission_ripple', joint)
    ]
    assert found.shrink.rms_after_m < 2.0 * NOISE * 3**0.5


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
    rng = np.random.default_rng(4)
    columns, labels, precision = rng.normal(size=(12, 45)), np.arange(45) // 6, np.full(12, 0.5)
    got = chance_ratio(columns, precision, [labels], known=True)
    left = np.zeros((45, len(noise(45))))
    for part in range(8):
        out = labels == part
        rows = np.vstack([columns[:, ~out].T, np.diag(np.sqrt(precision))])
        right = np.concatenate([noise(45)[:, ~out].T, np.zeros((12, left.shape[1]))])
        x = np.linalg.lstsq(rows, right, rcond=None)[0]
        left[out] = noise(45)[:, out].T - columns[:, out].T @ x
    assert got == pytest.approx(np.sqrt((left**2).mean(axis=0)).max()) and 1.2 < got < 2.5
    assert chance_ratio(columns, precision, [labels], known=False) > got


def test_a_gain_counts_parts_and_not_samples():
    # Two parts of four samples; the error falls from 4 to 1 in one and from 4 to 3 in the other.
    before, labels = np.full(8, 4.0), np.repeat([0, 1], 4)
    after = np.where(labels == 0, 1.0, 3.0)
    told = gain(before, after, labels)
    assert (told.share, told.rms_m) == (0.5, pytest.approx(np.sqrt(2.0)))
    # Falls of 3 and 1: mean 2, standard error sqrt(2) / sqrt(2).
    assert told.steady == pytest.approx(2.0)
    assert gain(np.repeat(before, 9), np.repeat(after, 9), np.repeat(labels, 9)) == told


def test_parts_are_compared_with_themselves_and_one_left_out_gives_a_variance():
    before, after = np.array([2.0, 2.0, 8.0]), np.array([1.0, 4.0])
    told = gain(before, after, np.array([0, 0, 1]), np.array([0, 1]))
    assert told.steady == pytest.approx(np.mean([1.0, 4.0]) / (1.5 * np.sqrt(2.0) / np.sqrt(2.0)))
    values = np.array([1.0, 4.0, -2.0, 3.0, 0.5])
    tries = np.array([np.delete(values, k).mean() for k in range(values.size)])
    assert jackknife(tries) == pytest.approx(values.var(ddof=1) / values.size)
    before = np.array([1.0, 1.0, 4.0, 4.2, 1.0, 3.0, 9.0])
    after = np.array([4.0, 4.0, 1.0, 1.1, 3.0, 0.5, 16.0])
    parts = np.array([0, 0, 1, 1, 2, 2, 3])
    expected = [1.0, np.sqrt(2.1 / 8.2) - 1.0, 0.0, 1.0 / 3.0]
    np.testing.assert_allclose(growth(before, after, parts), expected)
