# Copyright 2026 weld_twin contributors
# SPDX-License-Identifier: Apache-2.0
"""A change that single measurements hide is noticed in their mean, and noise of any kind is none."""

import numpy as np
import pytest

from weld_twin_core.twin.goal_correction import Start
from weld_twin_nodes.streams.supervision import ArmState, Moving, Promise, Supervision

NOISE = 1e-4
"""Standard deviation of a measured coordinate [m]."""
SPREAD = NOISE * np.sqrt(3.0)
"""The same as a distance [m], as a diagnosis tells it."""
RATE = 60.0
"""Measurements a second of a usual tracker."""


def noticed(deviations, unsure=5e-6):
    """Return after how many deviations the model is given up, and why; None where it is not."""
    watch = Supervision(Promise.of(SPREAD, unsure, 2000))
    for k, deviation in enumerate(deviations):
        watch.take(deviation, k / RATE)
        if why := watch.withdrawn(k / RATE):
            return k + 1, why
    return None


def white(rng, count):
    return rng.normal(scale=NOISE, size=(count, 3))


def filtered(rng, count):
    """An instrument that smooths over a tenth of a second, with as much noise as promised."""
    out, keep = white(rng, count), 0.8
    for k in range(1, count):
        out[k] = keep * out[k - 1] + np.sqrt(1.0 - keep**2) * out[k]
    return out


def of_one_camera(rng, count):
    return white(rng, count) * np.array([0.1, 0.1, 1.72])


def with_outliers(rng, count):
    return white(rng, count) + 0.01 * (rng.random((count, 1)) < 0.02)


@pytest.mark.parametrize('kind', [white, filtered, of_one_camera, with_outliers])
def test_noise_of_any_kind_is_no_change(kind):
    assert noticed(kind(np.random.default_rng(3), 20_000)) is None


@pytest.mark.parametrize('kind', [white, with_outliers])
def test_a_change_smaller_than_the_noise_is_noticed_in_half_a_minute(kind):
    changed = kind(np.random.default_rng(4), 30 * int(RATE)) + np.array([0.0, 8e-5, -6e-5])
    count, why = noticed(changed)
    assert count <= 30 * RATE
    assert 'the mean of the last' in why


def test_a_wrong_model_that_was_learned_with_much_noise_is_noticed_whichever_way_it_is_off():
    """A steady instrument, and an arm that is off by as much everywhere, in every direction."""
    rng = np.random.default_rng(9)
    turn = np.arange(10 * int(RATE)) / RATE
    way = np.column_stack([np.cos(turn), np.sin(turn), np.cos(0.7 * turn)]) / np.sqrt(1.5)
    count, why = noticed(3.3e-4 * way + 0.1 * white(rng, turn.size), unsure=3.4e-5)
    assert count <= 10 * RATE
    assert 'the medians of the last' in why


def test_a_large_change_is_noticed_at_once():
    rng = np.random.default_rng(5)
    calm = white(rng, 500)
    count, why = noticed(np.vstack([calm, white(rng, 40) + np.array([5e-4, 0.0, 0.0])]))
    assert 500 < count <= 520
    assert 'the last 20 measurements' in why


def test_what_the_model_is_not_sure_of_is_no_change():
    off = white(np.random.default_rng(6), 5_000) + np.array([9e-5, 0.0, 0.0])
    assert noticed(off, unsure=3e-5) is None
    assert noticed(off) is not None


def test_an_instrument_without_noise_shows_a_small_change_too():
    count, _ = noticed(np.full((2_000, 3), 5e-5))
    assert count <= 30 * RATE


def test_without_a_promise_nothing_is_held_against_it():
    watch = Supervision()
    for k in range(50):
        watch.take(np.array([1.0, 0.0, 0.0]), k / RATE)
    assert not watch.withdrawn(50 / RATE)
    assert 'is lost' in watch.withdrawn(53.0)


def test_after_a_loss_the_model_is_used_once_twenty_measurements_bear_it_out():
    """A load may have been changed meanwhile: the first of them tell nothing yet."""
    rng = np.random.default_rng(7)
    for change, used in ((0.0, True), (1e-3, False)):
        watch = Supervision(Promise.of(SPREAD, 5e-6, 2000))
        for k in range(60):
            watch.take(white(rng, 1)[0], k / RATE)
        assert not watch.withdrawn(60 / RATE)
        assert 'is lost' in watch.withdrawn(60 / RATE + 3.0)
        back = 60 / RATE + 4.0
        watch.pass_over(back)
        for k in range(20):
            assert f'was lost: {k} of the 20' in watch.withdrawn(back)
            watch.take(white(rng, 1)[0] + np.array([change, 0.0, 0.0]), back + k / RATE)
        assert (not watch.withdrawn(back + 1.0)) is used


def test_an_arm_tells_where_it_stands_and_from_which_side_each_joint_came():
    arm = ArmState()
    assert not arm.heard and arm.where(0.0, 1.0) is None and arm.start(0.0, 1.0) == Start()
    way = np.linspace(0.0, 0.01, 51)
    noise = 4e-5 * (-1.0) ** np.arange(51)
    for k, q in enumerate(np.column_stack([way, -way, noise])):
        arm.take(q, 0.01 * k)
    start = arm.start(0.5, 1.0)
    assert start.moving and start.came.tolist() == [1.0, -1.0, 0.0]
    arm.take(np.array([0.01 - 6e-5, -0.01, 0.0]), 0.51)  # as little as that turns nothing
    assert arm.start(0.51, 1.0).came.tolist() == [1.0, -1.0, 0.0]
    for k in range(20):
        arm.take(np.array([0.0098, -0.01, 0.0]), 0.52 + 0.01 * k)
    start = arm.start(0.75, 1.0)
    assert start.q.tolist() == [0.0098, -0.01, 0.0] and start.came.tolist() == [-1.0, -1.0, 0.0]
    assert not start.moving
    assert arm.where(1.7, 1.0) is not None and arm.where(1.8, 1.0) is None
    arm.forget()
    assert not arm.heard


def test_whether_all_joints_of_a_model_moved_is_known_of_the_time_just_gone():
    watch = Moving([0, 2])
    assert watch.at(5)  # nothing is remembered
    for k in range(1000):  # four seconds, in the last two of which joint 2 rests
        t = 0.004 * k
        watch.take(round(1e9 * t), np.array([0.1 * t, 0.0, 0.1 * min(t, 2.0)]))
    assert watch.at(1_500_000_000) and not watch.at(2_500_000_000)
    assert watch.at(1_000_000)  # as little as 20 ms tell no speed
    watch.take(1_000_000_000, np.zeros(3))  # a clock that was set back
    assert watch.at(1_000_000_000)
