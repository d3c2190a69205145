# Copyright 2026 weld_twin contributors
# SPDX-License-Identifier: Apache-2.0
"""The splits are what they say, and nothing is judged on what it was fitted on."""

from __future__ import annotations

import numpy as np
import pytest

from weld_twin_core.recording import JointMotion, Measurements, Recording
from weld_twin_lab.real_arms.goals import measures
from weld_twin_lab.real_arms.poor import paired
from weld_twin_lab.real_arms.splits import LEAST, among, halves, kept_back, splits


@pytest.fixture(scope='module')
def table():
    """Return 900 stations in a narrow cone of joint space, as the real tables have them."""
    rng = np.random.default_rng(5)
    q = rng.uniform(-1.0, 1.0, (900, 6)) * np.array([0.7, 0.6, 0.6, 1.0, 0.3, 0.3])
    position = 0.3 * q[:, :3] + 0.05 * rng.standard_normal((900, 3))
    t = np.arange(900.0)
    return Recording('t', JointMotion(t, q, None, True), Measurements(t, position))


@pytest.fixture(scope='module')
def found(table):
    return {split.kind: split for split in splits('ur5', table)}


def stamps(recording):
    return set(recording.measured.t)


def test_there_are_twenty_of_an_arm(found):
    assert len(found) == 20


def test_nothing_is_judged_on_what_it_was_fitted_on(found):
    for split in found.values():
        fitted = stamps(split.train)
        assert len(fitted) >= LEAST
        assert not fitted & stamps(split.inside)
        if split.outside is not None:
            assert not (fitted | stamps(split.inside)) & stamps(split.outside)


def test_a_table_has_its_own_rows_alone(found):
    for split in found.values():
        assert split.train.joints.q.shape[0] == split.train.measured.t.size


@pytest.mark.parametrize(('count', 'back'), [(15, 0), (17, 2), (100, 25)])
def test_a_quarter_is_kept_back_evenly_and_from_within_unless_too_few_are_left(count, back):
    fitted, kept = kept_back(np.arange(count))
    assert (fitted.size, kept.size) == (count - back, back)
    assert sorted([*fitted, *kept]) == list(range(count))
    apart = np.diff([0, *kept, count - 1])
    assert back == 0 or np.ptp(apart) <= 1


def test_counts_and_regions_are_as_named(found, table):
    assert [found[f'n{n}'].train.measured.t.size for n in (15, 240)] == [15, 240]
    assert np.ptp(found['still_2'].train.joints.q[:, 1]) <= np.radians(2.0) + 1e-12
    assert np.ptp(found['wrist_2deg'].train.joints.q[:, 4:], axis=0).max() <= np.radians(4.0)
    fitted = found['octant_0'].train.measured.position
    assert (fitted <= np.median(table.measured.position, axis=0)).all()
    assert stamps(found['odd'].train) == stamps(found['even'].inside)


def test_halves_share_nothing(found):
    odd, even = halves(found['n240'].train)
    assert not stamps(odd) & stamps(even) and len(stamps(odd)) == len(stamps(even)) == 120


def test_few_stations_are_all_fitted_on():
    fitted, back = kept_back(np.arange(LEAST))
    assert fitted.size == LEAST and back.size == 0
    fitted, back = kept_back(np.arange(18))
    assert fitted.size == LEAST and back.size == 3


def test_the_interval_of_a_ratio_holds_it_and_knows_pairs():
    rng = np.random.default_rng(0)
    other = rng.uniform(0.1, 1.0, 400)
    ratio = paired(1.1 * other, other)
    assert np.allclose([ratio['ratio'], ratio['low'], ratio['high']], 1.1)
    apart = paired(rng.permutation(other), other)
    assert apart['low'] < 1.0 < apart['high'] and apart['high'] - apart['low'] > 0.05


def entry(kind, over_best, over_frames, **more):
    inside = {
        'stations': 50,
        'mean_m': {},
        'rms_m': {'frames': 1.0, 'product': 0.5},
        'over_best': {'ratio': over_best, 'low': over_best - 0.01, 'high': over_best + 0.01},
        'over_frames': {'ratio': over_frames},
        'unflagged_over_frames': {'ratio': over_frames},
        'flagged': 0.0,
    }
    claimed = {'ratio': 0.5, 'ci95': [0.4, 0.6]}
    return {
        'name': f'ur5_{kind}',
        'robot': 'ur5',
        'kind': kind,
        'stations': 200,
        'status': 'identified',
        'families': ['link_twist'],
        'beyond': [],
        'claimed': claimed,
        'traceback': None,
        'inside': inside,
        'outside': None,
    } | more


def test_goals_are_reached_by_what_is_good_and_missed_by_what_is_not():
    good = measures([entry('n120', 0.8, 0.3), entry('odd', 0.8, 0.3), entry('even', 0.8, 0.3)])
    assert all(m.reached is not False for m in good)
    worse = [
        entry('n120', 1.2, 1.1, beyond=[['payload', None, 'mass', -10.0, -1.0]]),
        entry('odd', 0.8, 0.3, families=[]),
        entry('even', 0.8, 0.3, claimed={'ratio': 0.9, 'ci95': [0.8, 1.0]}),
        entry('n15', 0.8, 0.3, traceback='ValueError: zero-size', inside=None),
    ]
    missed = [m.what for m in measures(worse) if m.reached is False]
    for words in ('best of the three', 'not flagged', 'interval', 'odd and even', 'plausible'):
        assert any(words in what for what in missed), words
    assert any('nothing named' in what for what in missed)
    assert any('tracebacks' in what for what in missed)


def test_what_was_measured_plane_by_plane_is_elsewhere_afterwards():
    plane = np.stack(np.meshgrid(0.0, np.arange(6) * 0.1, np.arange(6) * 0.1), axis=-1)
    first = plane.reshape(-1, 3)
    later = np.concatenate([first + [0.05, 0.02, 0.0], first + [0.3, 0.0, 0.0]])
    np.testing.assert_array_equal(among(first, later), np.arange(72) < 36)


def test_a_first_fifth_with_nothing_of_the_rest_among_it_is_judged_outside_alone(table):
    far = table.measured.position + np.where(np.arange(900) < 180, 0.0, 5.0)[:, None]
    moved = table.with_measured(Measurements(table.measured.t, far))
    (split,) = [s for s in splits('ur5', moved) if s.kind == 'first_fifth']
    assert split.inside is None
    assert split.outside.measured.t.size == 720
