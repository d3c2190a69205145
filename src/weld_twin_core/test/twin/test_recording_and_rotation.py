# Copyright 2026 weld_twin contributors
# SPDX-License-Identifier: Apache-2.0
"""Streams at other times and thinned, rotations and cubic curves against scipy's and their laws."""

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st
from scipy.interpolate import CubicHermiteSpline, CubicSpline
from scipy.linalg import expm
from scipy.spatial.transform import Rotation
from scipy.stats.qmc import Halton

from weld_twin_core import DataError, JointMotion, Measurements, Recording, Signal, rotation
from weld_twin_core.arrays import halton
from weld_twin_core.cubics import hermite, natural_slopes
from weld_twin_core.recording import on_one_clock

vectors = st.tuples(*[st.floats(-1.7, 1.7)] * 3).map(np.array)


def test_velocity_of_a_parabola_is_exact_on_irregular_stamps():
    t = np.array([0.0, 0.1, 0.25, 0.3, 0.7])
    motion = JointMotion(t, (t**2)[:, None])
    np.testing.assert_allclose(motion.velocity[:, 0], 2 * t, atol=1e-12)


def test_positions_between_samples_follow_the_measured_velocity():
    t = np.linspace(0.0, 2.0, 9)
    motion = JointMotion(t, np.sin(t)[:, None], np.cos(t)[:, None])
    at = np.linspace(0.0, 2.0, 50)
    q, qd = motion.at(at)
    # Cubic Hermite: h^4 / 384 times the fourth derivative, h^3 / 72 sqrt(3) for the slope.
    assert np.abs(q[:, 0] - np.sin(at)).max() < 0.25**4 / 384
    assert np.abs(qd[:, 0] - np.cos(at)).max() < 0.25**3 / 72 * np.sqrt(3) * 1.01


def test_dates_tell_how_much_later_recordings_are_and_without_them_each_follows_the_last():
    def later(*dates):
        motion = JointMotion([1.0, 3.0], np.zeros((2, 1)))
        runs = [Recording('run', motion, epoch_ns=int(date * 1e9)) for date in dates]
        return [run.later for run in on_one_clock(runs)]

    day = 1.7e9
    assert later(day, day + 60.0, day + 20.0) == pytest.approx([0.0, 60.0, 20.0])
    # One second after the end at 3 s, where the stamps begin at 1 s.
    assert later(0, 0, 0) == [0.0, 3.0, 6.0]
    assert later(day, 0) == later(0, day) == [0.0, 3.0]


def test_outside_its_stamps_a_motion_rests_at_its_ends():
    motion = JointMotion([0.0, 1.0], [[1.0], [2.0]], [[3.0], [3.0]])
    q, qd = motion.at(np.array([-1.0, 0.0, 1.0, 5.0]))
    np.testing.assert_array_equal(q[:, 0], [1.0, 1.0, 2.0, 2.0])
    np.testing.assert_array_equal(qd[:, 0], [0.0, 3.0, 3.0, 0.0])


@pytest.mark.parametrize('static', [True, False])
def test_stations_and_single_samples_stand_still(static):
    t = [0.0, 1.0, 2.0] if static else [0.0]
    motion = JointMotion(t, np.arange(len(t))[:, None], np.ones((len(t), 1)), static=static)
    q, qd = motion.at(np.array([[0.2, 1.9]]))
    assert q.shape == (1, 2, 1)
    np.testing.assert_array_equal(q[..., 0], [[0.0, 2.0 if static else 0.0]])
    assert not qd.any()


def test_signals_are_straight_between_samples_and_held_at_the_ends():
    signal = Signal([0.0, 2.0], np.array([[0.0] * 6, [2.0] * 6]))
    at = np.array([[-1.0, 0.5], [1.5, 9.0]])
    np.testing.assert_allclose(signal.at(at)[..., 3], [[0.0, 0.5], [1.5, 2.0]])
    np.testing.assert_allclose(Signal([0.0, 2.0], [5.0, 7.0]).at(at), [[5.0, 5.5], [6.5, 7.0]])


def test_taken_measurements_keep_all_they_have():
    whole = Measurements([0.0, 1.0, 2.0], np.eye(3), np.tile(np.eye(3), (3, 1, 1)), [1, 2, 3])
    part = whole.take(np.array([True, False, True]))
    np.testing.assert_array_equal(part.t, [0.0, 2.0])
    np.testing.assert_array_equal(part.sigma, [1.0, 3.0])
    assert part.rotation.shape == (2, 3, 3)


@settings(max_examples=60, deadline=None)
@given(vectors, st.sampled_from([1.0, 1e-3, 1e-5, 1e-9, 0.0]))
def test_rotation_matrix_is_the_matrix_exponential(vector, size):
    v = vector * size
    np.testing.assert_allclose(rotation.rotation_matrix(v), expm(rotation.skew(v)), atol=1e-14)
    np.testing.assert_allclose(
        rotation.rotation_vector(rotation.rotation_matrix(v)), v, atol=1e-12
    )


@settings(max_examples=60, deadline=None)
@given(vectors, st.sampled_from([1.0, 1e-3, 1e-5, 0.0]))
def test_left_jacobian_is_the_derivative_of_the_rotation(vector, size):
    v, step = vector * size, 1e-6
    found = rotation.left_jacobian(v)
    for k, dv in enumerate(np.eye(3) * step):
        after, before = Rotation.from_rotvec(v + dv), Rotation.from_rotvec(v - dv)
        spin = (after * before.inv()).as_rotvec() / (2 * step)
        np.testing.assert_allclose(found[:, k], spin, atol=1e-8)


def test_a_pose_moved_by_what_is_missing_is_the_one_that_is_wanted():
    rng = np.random.default_rng(0)
    turns = Rotation.random(6, random_state=1).as_matrix()
    wanted, real = rotation.transform(turns, rng.normal(size=(6, 3))).reshape(2, 3, 4, 4)
    step = rotation.missing(wanted, real)
    np.testing.assert_allclose(rotation.moved(real, step), wanted, atol=1e-12)
    between = Rotation.from_matrix(wanted[:, :3, :3]) * Rotation.from_matrix(real[:, :3, :3]).inv()
    np.testing.assert_allclose(step[:, 3:], between.as_rotvec(), atol=1e-12)
    np.testing.assert_allclose(step[:, :3], wanted[:, :3, 3] - real[:, :3, 3])


def test_rotations_are_batched_even_when_there_are_none():
    for lead in ((), (0,), (2, 3)):
        matrix = rotation.rotation_matrix(np.zeros((*lead, 3)))
        assert rotation.rotation_vector(matrix).shape == (*lead, 3)
        assert rotation.quaternion_from_matrix(matrix).shape == (*lead, 4)
        assert rotation.angle_between(matrix, matrix).shape == (*lead, 3)
        assert rotation.matrix_from_quaternion(np.ones((*lead, 4)) / 2).shape == (*lead, 3, 3)


def test_a_quaternion_of_wrong_length_names_its_sample():
    with pytest.raises(DataError, match=r'^pose 1 has length 2, a rotation needs 1; check the'):
        rotation.matrix_from_quaternion([[0, 0, 0, 1], [0, 0, 0, 2]], 'pose')


def long(static=False):
    t = np.arange(0.0, 40.0, 0.008)
    q = np.stack([np.sin(2.0 * t), np.cos(3.0 * t)], axis=1)
    at = np.arange(0.5, 39.0, 0.02) if not static else t
    measured = Measurements(at, np.stack([at, at, at], axis=1))
    return Recording('long', JointMotion(t, q, static=static), measured, notes=('first',))


def test_a_recording_within_its_bounds_stays_as_it_is():
    recording = long()
    assert recording.thinned(10_000, 10_000) is recording


def test_measurements_are_taken_evenly_from_the_first_to_the_last():
    thin = long().thinned(100, 10_000)
    t = thin.measured.t
    assert t.size == 100
    assert (t[0], t[-1]) == (long().measured.t[0], long().measured.t[-1])
    assert np.ptp(np.diff(t)) < 0.021
    assert thin.joints is not None
    assert thin.joints.t.size == long().joints.t.size
    assert thin.notes == ('first', '100 of 1925 measurements are used, evenly over the recording')


def test_thinned_joints_still_follow_the_motion():
    thin = long().thinned(10_000, 1300)
    assert thin.joints.t.size <= 1301
    assert thin.joints.t[-1] == long().joints.t[-1]
    at = np.linspace(1.0, 39.0, 777)
    q, qd = thin.joints.at(at)
    np.testing.assert_allclose(q, np.stack([np.sin(2 * at), np.cos(3 * at)], 1), atol=2e-6)
    np.testing.assert_allclose(
        qd, np.stack([2 * np.cos(2 * at), -3 * np.sin(3 * at)], 1), atol=1e-3
    )
    assert 'motion above 16 Hz is not seen' in thin.notes[-1]


def test_stations_stay_whole():
    stations = long(static=True)
    assert stations.thinned(10, 10) is stations


@pytest.fixture
def knots():
    rng = np.random.default_rng(2)
    x = np.cumsum(rng.uniform(0.1, 1.0, 9))
    return x, rng.normal(size=(9, 3)), np.append(x, rng.uniform(x[0], x[-1], 40))


def same(x, y, slopes, at, other):
    value, rate = hermite(x, y, slopes, at)
    np.testing.assert_allclose(value, other(at), atol=1e-13)
    np.testing.assert_allclose(rate, other(at, 1), atol=1e-12)


def test_curves_through_knots_are_those_of_scipy(knots):
    x, y, at = knots
    slopes = np.random.default_rng(3).normal(size=y.shape)
    same(x, y, slopes, at, CubicHermiteSpline(x, y, slopes, axis=0))
    same(x, y, natural_slopes(x, y), at, CubicSpline(x, y, bc_type='natural'))


def test_a_natural_spline_through_two_knots_is_a_line():
    x, y = np.array([0.0, 2.0]), np.array([[1.0], [5.0]])
    np.testing.assert_allclose(natural_slopes(x, y), [[2.0], [2.0]], atol=1e-14)


def test_points_that_fill_a_box_are_those_of_halton():
    points = Halton(20, scramble=False).random(101)[1:]
    np.testing.assert_allclose(halton(20, 100), points, atol=1e-15)


@pytest.mark.parametrize('size', [1e-9, 1e-3, 0.3, 2.0, 3.14159])
def test_turns_of_every_size_are_those_of_scipy(size):
    vectors = np.random.default_rng(4).normal(size=(200, 3))
    turns = Rotation.from_rotvec(size * vectors / np.linalg.norm(vectors, axis=1)[:, None])
    matrices, quaternions = turns.as_matrix(), turns.as_quat(canonical=True)
    np.testing.assert_allclose(rotation.rotation_vector(matrices), turns.as_rotvec(), atol=2e-15)
    np.testing.assert_allclose(rotation.quaternion_from_matrix(matrices), quaternions, atol=1e-15)
    np.testing.assert_allclose(
        rotation.matrix_from_quaternion(1.005 * quaternions), matrices, atol=2e-15
    )
