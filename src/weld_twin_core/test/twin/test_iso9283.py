# Copyright 2026 weld_twin contributors
# SPDX-License-Identifier: Apache-2.0
"""ISO 9283 criteria on data whose answer is known by construction."""

import statistics

import numpy as np
import pytest
from scipy.spatial.transform import Rotation

from weld_twin_core.errors import DataError
from weld_twin_core.metrics import iso9283

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
def test_data_that_do_not_allow_a_criterion_are_refused(call, sentence):
    with pytest.raises(DataError) as error:
        call()
    assert str(error.value) == sentence
