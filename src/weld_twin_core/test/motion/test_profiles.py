# Copyright 2026 weld_twin contributors
# SPDX-License-Identifier: Apache-2.0
"""Time laws: they integrate to themselves, keep their limits and reach the end."""

from itertools import pairwise

import numpy as np
import pytest
from scipy.integrate import cumulative_trapezoid, quad

from weld_twin_core.errors import PathError
from weld_twin_core.motion.profiles import (
    PROFILES,
    Aggressive,
    SCurve,
    Smooth,
    Trapezoid,
    named,
)

LENGTHS = (0.5, 0.01, 1e-4)


@pytest.mark.parametrize('length', LENGTHS)
@pytest.mark.parametrize('name', PROFILES)
def test_speed_integrates_to_the_way_and_acceleration_to_the_speed(name, length):
    law = named(name).law(length)
    breaks = law.x
    way = sum(quad(law.derivative(), a, b)[0] for a, b in pairwise(breaks))
    assert way == pytest.approx(length, rel=1e-9)
    assert law(breaks[-1]) == pytest.approx(length, rel=1e-12)
    # Dense, so the trapezoidal rule is exact to the jumps of the acceleration.
    timing = named(name).sample(length, breaks[-1] / 200_000)
    speed = timing.sd[0] + cumulative_trapezoid(timing.sdd, timing.t, initial=0.0)
    np.testing.assert_allclose(speed[:-2], timing.sd[:-2], atol=1e-3 * timing.sd.max())


@pytest.mark.parametrize('length', LENGTHS)
@pytest.mark.parametrize('name', PROFILES)
def test_samples_are_even_and_end_at_the_end(name, length):
    timing = named(name).sample(length, 0.004)
    np.testing.assert_allclose(np.diff(timing.t), 0.004)
    assert timing.s[0] == 0.0
    assert timing.s[-1] == pytest.approx(length, rel=1e-12)
    assert timing.s.min() >= -1e-12
    assert timing.s.max() <= length * (1 + 1e-12)


def test_a_trapezoid_takes_the_hand_time():
    # 0.1 s up, 0.4 m at 1 m/s, 0.1 s down.
    law = Trapezoid(1.0, 10.0).law(0.5)
    assert law.x[-1] == pytest.approx(0.6)
    assert law(0.1) == pytest.approx(0.05)


def test_a_short_trapezoid_never_cruises():
    # Triangle: peak sqrt(a L) = 0.1 m/s, 2 x 0.1 s.
    law = Trapezoid(1.0, 1.0).law(0.01)
    assert law.x[-1] == pytest.approx(0.2)
    assert law(0.1, 1) == pytest.approx(0.1)


@pytest.mark.parametrize('length', [1.0, 0.05, 0.002])
@pytest.mark.parametrize('speed, acceleration, jerk', [(0.1, 0.5, 5.0), (0.1, 5.0, 5.0)])
def test_an_s_curve_keeps_speed_acceleration_and_jerk(length, speed, acceleration, jerk):
    law = SCurve(speed, acceleration, jerk).law(length)
    t = np.linspace(0.0, law.x[-1], 5001)
    assert law(t, 1).max() <= speed * (1 + 1e-9)
    assert law(t, 1).min() >= -1e-9
    assert np.abs(law(t, 2)).max() <= acceleration * (1 + 1e-9)
    inside = t[~np.isclose(t[:, None], law.x, atol=1e-9).any(axis=1)]
    assert np.abs(law(inside, 3)).max() <= jerk * (1 + 1e-9)
    # Acceleration has no step, and the ends are at rest.
    before, after = law(law.x[1:-1] - 1e-9, 2), law(law.x[1:-1] + 1e-9, 2)
    np.testing.assert_allclose(before, after, atol=1e-6)
    np.testing.assert_allclose(law(law.x[[0, -1]], 1), 0.0, atol=1e-9)


def test_the_smooth_law_is_at_rest_at_both_ends_and_peaks_at_15_8_of_the_mean():
    law = Smooth(0.02).law(0.3)
    np.testing.assert_allclose([law(x, k) for x in law.x for k in (1, 2)], 0.0, atol=1e-15)
    assert law(law.x[-1] / 2, 1) == pytest.approx(0.02 * 15 / 8)


def test_the_aggressive_law_turns_where_told_at_its_acceleration():
    # Three advances of 0.1 m, of which the first two go 0.05 m too far and come back.
    timing = Aggressive(0.3, 3.0, reversals=4, back=0.5).sample(0.3, 1e-4)
    turns = np.flatnonzero(np.diff(np.sign(timing.sd[1:-1])) != 0) + 1
    turns = turns[np.append(np.diff(turns) > 1, True)]
    np.testing.assert_allclose(timing.s[turns], [0.15, 0.1, 0.25, 0.2], atol=1e-6)
    assert np.abs(timing.sd).max() <= 0.3 + 1e-12
    assert np.abs(timing.sdd).max() == pytest.approx(3.0)


@pytest.mark.parametrize(
    'make, sentence',
    [
        (lambda: Smooth(-1.0), 'smooth profile: speed must be a positive number, got -1.0'),
        (
            lambda: SCurve(jerk=float('inf')),
            'scurve profile: jerk must be a positive number, got inf',
        ),
        (lambda: Aggressive(back=1.5), 'aggressive profile: back must be at most 1, got 1.5'),
        (lambda: named('quick'), "no profile is called 'quick'; there are constant, trapezoid"),
    ],
)
def test_a_wrong_profile_is_refused(make, sentence):
    with pytest.raises(PathError, match=sentence):
        make()
