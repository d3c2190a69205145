# Copyright 2026 weld_twin contributors
# SPDX-License-Identifier: Apache-2.0
"""Friction and hysteresis of the plant: sizes as stated, shapes of their own."""

import numpy as np
import pytest

from weld_twin_lab.plant.flaws import Causes, Here, frame, known, on_joints

JOINTS = ('j0', 'j1')


def here(t, q, richness, entry):
    """Return what a flaw of an arm of two joints sees."""
    assert entry['effect'] in known()
    return Here(Causes((entry,), JOINTS), None, t, q, richness, np.random.default_rng(0))


def moved(q, rate=1000.0, richness=1.0, **entry):
    """Return the displacement of joint j1 along positions sampled at a rate."""
    q = np.stack([np.zeros(len(q)), q], axis=1)
    out = on_joints(here(np.arange(len(q)) / rate, q, richness, {'joint': 'j1', **entry}))
    assert not out[:, 0].any()
    return out[:, 1]


def there_and_back(speed, pause=0.0):
    """Return positions at 1 kHz: a second up, a pause, a second down."""
    up = speed * np.linspace(0.0, 1.0, 1000)
    return np.concatenate([up, np.full(int(1000 * pause), speed), up[::-1]])


@pytest.mark.parametrize('richness', [0.0, 1.0])
def test_friction_trails_by_its_wind_up_both_ways_and_more_in_one(richness):
    entry = {'effect': 'friction', 'windup': 1e-3, 'asymmetry': 0.2}
    found = moved(there_and_back(0.3), richness=richness, **entry)
    assert found[900] == pytest.approx(-1.2e-3, rel=0.01)
    assert found[-50] == pytest.approx(0.8e-3, rel=0.01)


def test_friction_breaks_away_higher_and_lets_go_in_a_pause():
    slow = moved(there_and_back(0.008), effect='friction', windup=1e-3)
    assert slow[900] < -1.05e-3
    paused = moved(there_and_back(0.3, pause=0.5), effect='friction', windup=1e-3)
    assert abs(paused[1490]) < 0.02e-3


def test_hysteresis_closes_after_twice_its_travel_and_small_loops_close_on_themselves():
    entry = {'effect': 'hysteresis', 'amplitude': 1e-3, 'travel': 0.05}
    wide = moved(there_and_back(0.5), **entry)
    assert wide[[999, -1]] == pytest.approx([-1e-3, 1e-3], rel=1e-6)
    small = 0.3 + 0.01 * np.sin(np.arange(4000) * np.pi / 200.0)
    loops = moved(np.concatenate([np.linspace(0.0, 0.3, 500), small]), **entry)[500:]
    assert loops[3200:3600] == pytest.approx(loops[3600:4000], abs=1e-9)
    assert np.ptp(loops[3200:]) < 0.7e-3


def test_a_full_reversal_is_half_undone_after_seven_tenths_of_its_travel():
    """As in the textbook, where half is left after travel times the logarithm of two."""
    q = there_and_back(0.5)
    found = moved(q, effect='hysteresis', amplitude=1e-3, travel=0.05)
    half = np.flatnonzero(found[1000:] > 0.0)[0]
    assert (q[999] - q[1000 + half]) / 0.05 == pytest.approx(np.log(2.0), rel=0.25)


def test_a_tip_wears_at_its_rate_first_and_slower_later():
    tip = {'effect': 'wear', 'rate': 1e-5, 'slower': 50.0}
    back = frame('tool', here(np.array([0.0, 1.0, 1e4]), None, 1.0, tip)).position
    np.testing.assert_allclose(back[:, 2], [0.0, -1e-5, -5e-4], rtol=0.011)
    assert not back[:, :2].any()
