# Copyright 2026 weld_twin contributors
# SPDX-License-Identifier: Apache-2.0
"""Lost motion: friction against the drive's loop, the loop of a strain-wave gear, play ahead."""

from dataclasses import replace
from itertools import pairwise

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st
from scipy.integrate import solve_ivp

from weld_twin_core import (
    JointMotion,
    ModelError,
    Recording,
    Robot,
    Twin,
    catalog,
    effect_from_mapping,
    effects_from_list,
)
from weld_twin_core.effects import Friction, GearRatioByDirection, Hysteresis


def under(arm, effect, recording):
    """Return how far the effect's joint is from its command."""
    i = arm.index(effect.joint)
    return Twin(arm, (effect,)).joints(recording)[..., i] - recording.joints.q[..., i]


def swung(q, rate=100.0):
    """Return a recording in which joint j2 goes through positions."""
    joints = np.zeros((len(q), 6))
    joints[:, 2] = q
    return Recording('swing', JointMotion(np.arange(len(q)) / rate, joints))


def test_hysteresis_solves_its_differential_equation(arm):
    turns = [0.0, 0.3, 0.1, 0.15, -0.2]
    path = np.concatenate([np.linspace(a, b, 40, endpoint=False) for a, b in pairwise(turns)])
    z, expected = 0.0, [0.0]

    def law(_, z, way):
        return way * (1.0 - way * z) / 0.05

    for step in np.diff(path):
        more = {'args': (np.sign(step),), 'rtol': 1e-10, 'atol': 1e-13}
        z = solve_ivp(law, (0.0, abs(step)), [z], **more).y[0, -1]
        expected.append(-1e-3 * z)
    found = under(arm, Hysteresis('j2', amplitude=1e-3, travel=0.05), swung(path))
    np.testing.assert_allclose(found, expected, atol=1e-11)


@settings(max_examples=30, deadline=None)
@given(st.lists(st.floats(-0.5, 0.5), min_size=3, max_size=40), st.floats(1e-3, 1.0))
def test_a_loop_stays_within_its_amplitude_and_does_not_care_how_finely_it_is_sampled(q, travel):
    arm = Robot.from_mapping({'joints': [{'name': f'j{k}'} for k in range(6)]})
    effect = Hysteresis('j2', 1.0, travel)
    coarse = under(arm, effect, swung(q))
    assert np.abs(coarse).max() <= 1.0 + 1e-12
    fine = np.interp(np.arange(0, len(q) - 0.75, 0.25), np.arange(len(q)), q)
    np.testing.assert_allclose(under(arm, effect, swung(fine))[::4], coarse, atol=1e-9)


def test_friction_solves_its_differential_equation(arm):
    path = np.r_[np.linspace(0.0, 0.05, 20), np.full(10, 0.05), np.linspace(0.05, -0.02, 20)]
    both, expected = np.zeros(2), [0.0]

    def law(_, both, rate):
        return (np.array([np.sign(rate), 1.0]) - both) * abs(rate) / 0.02 - both / 0.08

    for step in np.diff(path):
        more = {'args': (step / 0.01,), 'rtol': 1e-10, 'atol': 1e-13}
        both = solve_ivp(law, (0.0, 0.01), both, **more).y[:, -1]
        expected.append(-1e-3 * (both[0] - 0.3 * both[1]))
    effect = Friction('j2', windup=1e-3, asymmetry=-0.3, travel=0.02, release=0.08)
    np.testing.assert_allclose(under(arm, effect, swung(path)), expected, atol=1e-11)


def test_a_loop_with_integral_action_takes_the_wind_up_back(arm):
    path = np.r_[np.linspace(0.0, 0.5, 200), np.linspace(0.5, 0.2, 200)]
    recording = swung(path)
    held = Friction('j2', 1e-3, travel=2e-2, release=1e3)
    bent, step = under(arm, held, recording), np.diff(recording.joints.t, prepend=0.0)
    left, expected = 0.0, []
    for change, dt in zip(np.diff(bent, prepend=0.0), step, strict=True):
        left = (left + change) * np.exp(-3.0 * dt)
        expected.append(left)
    recovers = Friction('j2', 1e-3, travel=2e-2, release=1e3, recovery=3.0)
    found = under(arm, recovers, recording)
    np.testing.assert_allclose(found, expected, atol=1e-12)
    # it has trailed by the wind-up after the start, and by twice as much after the reversal
    assert found[:200].min() < -0.5e-3 and found[200:].max() > 0.5e-3
    assert abs(found[199]) < 0.2e-3


def test_a_loop_that_recovers_is_found(arm):
    recording = swung(np.r_[np.linspace(0.0, 0.5, 200), np.linspace(0.5, 0.2, 200)])
    true = Friction('j2', 1e-3, travel=3e-4, release=1e3, recovery=2.0)
    pull = under(arm, true, recording)
    view = Twin(arm).joint_view(recording)
    seeds = list(Friction.seeds(view, 'j2'))
    alike = [
        abs(np.corrcoef(under(arm, replace(s, windup=1.0), recording), pull)[0, 1]) for s in seeds
    ]
    best = seeds[int(np.argmax(alike))]
    assert best.recovery == 2.0 and max(alike) > 0.99
    slow = best.fit.with_coordinates(np.array([1e-3, 3e-4, 0.0]))
    assert slow.fit.coordinates().tolist() == [1e-3, 3e-4, 0.5]


def test_a_fit_leaves_even_friction_even():
    even, uneven = Friction('j2', 1e-3, travel=2e-4), Friction('j2', 1e-3, 0.1, 2e-4)
    assert even.fit.coordinates().tolist() == [1e-3, 2e-4]
    moved = even.fit.with_coordinates(np.array([2e-3, 3e-4]))
    assert moved.vector().tolist() == [2e-3, 0.0, 3e-4, 0.0]
    moved = uneven.fit.with_coordinates(np.array([2e-3, 0.2, 3e-4]))
    assert moved.vector().tolist() == [2e-3, 0.2, 3e-4, 0.0]
    assert uneven.errors(np.array([1e-5, 0.05, 1e-5])) == {
        'windup': 1e-5,
        'asymmetry': 0.05,
        'travel': 1e-5,
    }
    assert even.errors(np.array([1e-5, 2e-5])) == {'windup': 1e-5, 'travel': 2e-5}


def test_a_friction_that_pushes_is_refused(arm):
    for wrong in ({'windup': -1e-3}, {'windup': 1e-3, 'asymmetry': 0.9}):
        with pytest.raises(ModelError, match='outside'):
            effects_from_list([{'effect': 'friction', 'joint': 'j1', **wrong}], arm)


@pytest.mark.parametrize(
    ('entry', 'coefficients', 'expected'),
    [
        ({'effect': 'friction', 'asymmetry': 1e-9}, [2e-4, 5e-5], [2e-4, 0.25, 3e-4, 0.0]),
        ({'effect': 'friction', 'asymmetry': 1e-9}, [-2e-4, 5e-5], [0.0, 1e-9, 3e-4, 0.0]),
        ({'effect': 'friction'}, [2e-4], [2e-4, 0.0, 3e-4, 0.0]),
        ({'effect': 'hysteresis', 'travel': 0.2}, [3e-4], [3e-4, 0.2]),
        ({'effect': 'hysteresis', 'travel': 0.2}, [-3e-4], [0.0, 0.2]),
    ],
)
def test_features_stand_for_an_instance(arm, make_recording, entry, coefficients, expected):
    effect = effect_from_mapping({**entry, 'joint': 'j2'})
    found = effect.from_atoms(np.array(coefficients))
    np.testing.assert_allclose(found.vector(), expected)
    view = Twin(arm).joint_view(make_recording(arm))
    total = sum(c * atom['q', 2] for c, atom in zip(coefficients, effect.atoms(view), strict=True))
    if coefficients[0] > 0.0:
        np.testing.assert_allclose(found.displace(view)['q', 2], total, atol=1e-15)


def test_a_gear_whose_flanks_differ_turns_further_one_way(arm):
    path = np.r_[0.2, 0.5, 1.0, 0.9, 0.1, -0.8, -0.8, -0.7999, -0.2]
    way, expected = 0.0, []
    for before, now in zip(np.r_[path[0], path], path, strict=False):
        # From one flank to the other it takes 0.4 mrad.
        way = min(max(way + (now - before) / 2e-4, -1.0), 1.0)
        expected.append(0.5 * 4e-3 * way * now)
    found = under(arm, GearRatioByDirection('j2', 4e-3, 4e-4), swung(path))
    np.testing.assert_allclose(found, expected, atol=1e-15)


@pytest.mark.parametrize(
    ('path', 'shown'),
    [
        (np.sin(np.linspace(0.0, 9.0, 200)), True),
        (np.linspace(0.0, 2.0, 200), False),
        # To and fro about one place it is play.
        (1.5 + 0.05 * np.sin(np.linspace(0.0, 9.0, 200)), False),
        # Up on one side of zero and down on the other it is a ratio and play.
        (np.r_[np.linspace(0.0, 1.0, 99), np.linspace(1.0, 0.99, 99)], False),
    ],
)
def test_a_ratio_by_direction_is_looked_for_where_the_joint_went_both_ways(arm, path, shown):
    view = Twin(arm).joint_view(swung(path))
    assert bool(list(GearRatioByDirection.seeds(view, 'j2'))) is shown


ROBOT = catalog.load('ur5')
JOINT = 'elbow_joint'


def moved(form, angles):
    q = np.zeros((len(angles), 6))
    q[:, 2] = angles
    motion = Recording('r', JointMotion(np.arange(float(len(angles))), q, static=True))
    effect = effect_from_mapping(
        {'effect': 'backlash', 'joint': JOINT, 'width': 2e-4, 'form': form}
    )
    return Twin(ROBOT, (effect,)).joints(motion)[:, 2] - angles


def test_it_mirrors_play_while_the_gap_is_crossed():
    angles = np.cumsum(np.random.default_rng(1).normal(scale=1e-4, size=200))
    np.testing.assert_allclose(moved('coast', angles), -moved('play', angles), atol=1e-15)
