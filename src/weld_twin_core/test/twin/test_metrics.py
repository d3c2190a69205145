# Copyright 2026 weld_twin contributors
# SPDX-License-Identifier: Apache-2.0
"""Deviation metrics, seam directions and criteria of ISO 9283 against hand values and laws."""

import json
import statistics

import numpy as np
import pytest
from scipy.integrate import quad
from scipy.spatial.transform import Rotation

from weld_twin_core import DataError, Poses
from weld_twin_core.metrics import deviation, iso9283
from weld_twin_core.motion import seam_frame

NOMINAL = np.array([[0.0, 0, 0], [0.3, 0, 0], [0.3, 0.4, 0]])
OFF = np.array([[3e-3, 4e-3, 0], [0, 0, 0], [0, 0, -1e-3]])


def test_metrics_of_three_samples_by_hand():
    found = deviation.deviation_metrics(NOMINAL + OFF, NOMINAL, t=[0.0, 1.0, 3.0])
    assert found.samples == 3
    assert found.path_length_m == pytest.approx(0.7)
    assert found.max_m == pytest.approx(5e-3)
    assert found.mean_m == pytest.approx(2e-3)
    assert found.rms_m == pytest.approx(np.sqrt(26 / 3) * 1e-3)
    assert found.p95_m == pytest.approx(4.6e-3)  # 0.9 of the way from 1 mm to 5 mm
    assert found.d_norm == pytest.approx(5e-3 / 0.7)
    assert found.d_cum_m == pytest.approx(6e-3)
    assert found.d_time_m_s == pytest.approx(2.5e-3 + 1e-3)
    assert found.orientation_rms_rad is None
    assert found.along_rms_m is None


def test_the_papers_two_normalisations_meet_at_the_largest_deviation():
    over_time = deviation.normalized_deviation(OFF, 0.7)
    found = deviation.deviation_metrics(NOMINAL + OFF, NOMINAL)
    assert over_time.max() == pytest.approx(found.d_norm)
    with pytest.raises(DataError, match=r'^a path of length 0.0 m cannot normalise a deviation$'):
        deviation.normalized_deviation(OFF, 0.0)


def test_the_sum_grows_with_the_sample_rate_and_the_integral_does_not():
    def run(count):
        t = np.linspace(0.0, 1.0, count)
        off = 1e-3 * np.stack([np.sin(3 * t), np.cos(3 * t) - 1, t**2], axis=-1)
        nominal = np.stack([t, 0 * t, 0 * t], axis=-1)
        return deviation.deviation_metrics(nominal + off, nominal, t=t)

    def size(t):
        return 1e-3 * np.sqrt(np.sin(3 * t) ** 2 + (np.cos(3 * t) - 1) ** 2 + t**4)

    coarse, fine = run(1001), run(2001)
    assert fine.d_cum_m == pytest.approx(2 * coarse.d_cum_m, rel=2e-3)
    assert fine.d_time_m_s == pytest.approx(quad(size, 0, 1)[0], rel=1e-6)


def test_orientation_error_is_the_angle_of_the_turn_between():
    rng = np.random.default_rng(0)
    nominal = Rotation.random(5, random_state=1).as_matrix()
    turn = rng.normal(scale=0.2, size=(5, 3))
    actual = Rotation.from_rotvec(turn).as_matrix() @ nominal
    points = rng.normal(size=(5, 3))
    found = deviation.deviation_metrics(Poses(points, actual), Poses(points, nominal))
    angles = np.linalg.norm(turn, axis=1)
    assert found.orientation_max_rad == pytest.approx(angles.max())
    assert found.orientation_rms_rad == pytest.approx(np.sqrt((angles**2).mean()))


def test_seam_components_are_along_left_and_out_of_the_plate():
    found = seam_frame.seam_components([1.0, 2.0, 3.0], [5.0, 0, 0], [0.7, 0, 0.1])
    np.testing.assert_allclose(found, [1.0, 2.0, 3.0], atol=1e-15)
    found = seam_frame.seam_components([1.0, 2.0, 3.0], [0, 2.0, 0], [0, 0, 1.0])
    np.testing.assert_allclose(found, [2.0, -1.0, 3.0], atol=1e-15)


def test_seam_components_keep_the_length_of_the_deviation():
    rng = np.random.default_rng(2)
    off, tangent, normal = rng.normal(size=(3, 50, 3))
    axes = seam_frame.seam_axes(tangent, normal)
    np.testing.assert_allclose(
        axes @ np.swapaxes(axes, 1, 2), np.tile(np.eye(3), (50, 1, 1)), atol=1e-12
    )
    np.testing.assert_allclose(np.linalg.det(axes), 1.0)
    found = deviation.deviation_metrics(off, np.zeros((50, 3)), tangent=tangent, normal=normal)
    total = found.along_rms_m**2 + found.across_rms_m**2 + found.normal_rms_m**2
    assert total == pytest.approx(found.rms_m**2)


def test_tangents_of_a_circle_are_square_to_its_radius_and_hold_at_rests():
    phi = np.linspace(0.0, 1.0, 50)
    circle = np.stack([np.cos(phi), np.sin(phi), 0 * phi], axis=-1)
    points = np.concatenate([circle[:1], circle[:1], circle, circle[-1:], circle[-1:]])
    tangents = seam_frame.path_tangents(points)
    np.testing.assert_allclose(np.linalg.norm(tangents, axis=1), 1.0)
    np.testing.assert_allclose((tangents[3:-3] * circle[1:-1]).sum(axis=1), 0.0, atol=1e-12)
    np.testing.assert_allclose(tangents[0], tangents[2], atol=1e-12)
    np.testing.assert_allclose(tangents[-1], tangents[-2], atol=1e-12)
    assert tangents[3, 1] > 0.9


def test_a_path_at_rest_has_metrics_without_normalisation():
    found = deviation.deviation_metrics(np.full((4, 3), 1e-3), np.zeros((4, 3)))
    assert found.d_norm is None
    assert found.path_length_m == 0.0


def test_the_dictionary_is_plain_and_frozen_results_stay():
    found = deviation.deviation_metrics(NOMINAL + OFF, NOMINAL)
    assert json.loads(json.dumps(found.as_dict()))['max_m'] == found.max_m
    with pytest.raises(AttributeError):
        found.max_m = 0.0


CROSS = 1e-3 * np.array([[1.0, 0, 0], [-1, 0, 0], [0, 3, 0], [0, -3, 0]])


def test_pose_accuracy_and_repeatability_by_hand():
    off = np.array([2e-3, 0.0, -1e-3])
    found = iso9283.pose_performance([1.0, 2.0, 3.0] + off + CROSS, [1.0, 2.0, 3.0])
    assert found.cycles == 4
    assert found.ap_m == pytest.approx(np.sqrt(5) * 1e-3)
    np.testing.assert_allclose(found.ap_xyz_m, off, atol=1e-15)
    radii = [1e-3, 1e-3, 3e-3, 3e-3]
    assert found.rp_m == pytest.approx(2e-3 + 3 * statistics.stdev(radii))


def test_repeatability_does_not_see_the_command_and_accuracy_not_the_scatter():
    rng = np.random.default_rng(0)
    points = rng.normal(size=(30, 3))
    here, there = (iso9283.pose_performance(points, goal) for goal in ([0, 0, 0], [5, 5, 5]))
    assert here.rp_m == there.rp_m
    doubled = points.mean(axis=0) + 2 * (points - points.mean(axis=0))
    assert iso9283.pose_performance(doubled, [0, 0, 0]).ap_m == pytest.approx(here.ap_m)
    assert iso9283.pose_performance(doubled, [0, 0, 0]).rp_m == pytest.approx(2 * here.rp_m)


def test_orientation_accuracy_and_repeatability_about_one_axis():
    goal = Rotation.from_rotvec([0.3, -0.8, 0.2])
    angles = np.array([1e-3, 2e-3, 6e-3])
    turned = Rotation.from_rotvec(angles[:, None] * [0, 0, 1]) * goal
    found = iso9283.pose_performance(
        np.zeros((3, 3)), np.zeros(3), turned.as_matrix(), goal.as_matrix()
    )
    np.testing.assert_allclose(found.ap_rad, [0, 0, 3e-3], atol=1e-12)
    np.testing.assert_allclose(found.rp_rad, [0, 0, 3 * statistics.stdev(angles)], atol=1e-12)


def straight(offset, count=37, wobble=0.0):
    x = np.linspace(-0.1, 1.1, count)
    return np.stack([x, offset + wobble * x, 0 * x], axis=-1)


def test_path_criteria_are_taken_square_to_the_path_whatever_the_sampling():
    command = np.stack([np.linspace(0, 1, 11), np.zeros(11), np.zeros(11)], axis=-1)
    tangent = np.tile([1.0, 0, 0], (11, 1))
    cycles = [straight(1e-3, 37), straight(3e-3, 50), straight(2e-3, 41, wobble=6e-3)]
    found = iso9283.path_performance(cycles, command, tangent)
    # At x the offsets are 1, 3 and 2 + 6 x mm: worst at the far end.
    assert found.at_m == pytest.approx((1 + 3 + 8) / 3 * 1e-3)
    assert found.at_index == 10
    radii = [3e-3, 1e-3, 4e-3]
    assert found.rt_m == pytest.approx(statistics.mean(radii) + 3 * statistics.stdev(radii))
    assert found.cycles == 3


def test_of_several_passes_through_a_plane_the_nearest_counts():
    there_and_there = np.concatenate([straight(0.5), straight(2e-3)])
    found = iso9283.nearest_pass(there_and_there, np.array([0.5, 0, 0]), np.array([1.0, 0, 0]))
    np.testing.assert_allclose(found, [0.5, 2e-3, 0], atol=1e-12)


def test_drift_is_the_largest_change_against_the_first_group():
    groups = [CROSS + [0, 0, z] for z in (1e-3, 4e-3, 2e-3)]
    groups[1] = groups[1] + 1.0 * CROSS
    found = iso9283.drift(groups, [0, 0, 0])
    assert found.dap_m == pytest.approx(3e-3)
    assert found.drp_m == pytest.approx(found.rp_m[0])  # twice the scatter
    np.testing.assert_allclose(found.ap_m, [1e-3, 4e-3, 2e-3])


def test_variation_over_approaches_shows_lost_motion():
    approaches = [CROSS + [x, 0, 0] for x in (0.0, 4e-4, -1e-4)]
    assert iso9283.multidirectional_variation(approaches) == pytest.approx(5e-4)


@pytest.mark.parametrize(
    ('call', 'sentence'),
    [
        (
            lambda: deviation.deviation_metrics(np.zeros((0, 3)), np.zeros((0, 3))),
            'there are no samples to measure a deviation on',
        ),
        (
            lambda: deviation.deviation_metrics(NOMINAL[:2], NOMINAL),
            'actual positions must have shape (3, 3), got (2, 3)',
        ),
        (
            lambda: deviation.deviation_metrics(NOMINAL, NOMINAL, tangent=[1, 0, 0]),
            'seam components need both the tangent and the normal of the seam',
        ),
        (
            lambda: deviation.deviation_metrics(NOMINAL, NOMINAL, t=[0.0, 1.0]),
            '3 deviations need as many stamps, got 2',
        ),
        (
            lambda: seam_frame.path_tangents(np.zeros((3, 3))),
            'the path does not move, so it has no direction; give the seam tangent',
        ),
        (
            lambda: seam_frame.seam_axes([1, 0, 0], [2, 0, 0]),
            'the seam normal lies along the seam; give one that points away from it',
        ),
        (
            lambda: seam_frame.seam_axes([0, 0, 0], [2, 0, 0]),
            'the seam tangent is zero; give a direction',
        ),
        (
            lambda: iso9283.pose_performance([[0, 0, 0]], [0, 0, 0]),
            'repeatability needs at least two cycles, got 1; repeat the pose or path',
        ),
        (
            lambda: iso9283.path_performance([straight(0.0)], [[0, 0, 0]], [[1, 0, 0]]),
            'repeatability needs at least two cycles, got 1; repeat the pose or path',
        ),
        (
            lambda: iso9283.path_performance([straight(0.0)] * 2, [[2.0, 0, 0]], [[1, 0, 0]]),
            'cycle 0 does not pass command point 0; leave out the ends of the command path that not '
            'every cycle covers',
        ),
        (
            lambda: iso9283.drift([CROSS], [0, 0, 0]),
            'drift compares groups of cycles over time, got 1 group',
        ),
        (
            lambda: iso9283.multidirectional_variation([CROSS]),
            'variation of pose accuracy compares directions of approach, got 1 direction',
        ),
        (
            lambda: iso9283.multidirectional_variation([CROSS, CROSS[:1]]),
            'repeatability needs at least two cycles, got 1; repeat the pose or path',
        ),
    ],
)
def test_data_that_do_not_allow_a_metric_or_a_criterion_are_refused(call, sentence):
    with pytest.raises(DataError) as error:
        call()
    assert str(error.value) == sentence
