# Copyright 2026 weld_twin contributors
# SPDX-License-Identifier: Apache-2.0
"""Geometry of the plant against 4 x 4 DH products written in the tests."""

import numpy as np
import pytest
from plant_cells import EXACT, ROBOTS, UR5, dh_pose, dh_positions, record, stations, weave
from scipy.spatial.transform import Rotation

from weld_twin_lab.plant.tracker import Tracker


@pytest.mark.parametrize('name', ROBOTS)
def test_clean_stations_are_the_dh_product(name):
    robot = ROBOTS[name]
    command = stations(robot, 40)
    got = record(robot, [], command)
    for q, position, quaternion in zip(command.q, got.position, got.quaternion, strict=True):
        want = dh_pose(robot, q)
        assert np.abs(position - want[:3, 3]).max() < 1e-12
        assert np.abs(Rotation.from_quat(quaternion).as_matrix() - want[:3, :3]).max() < 1e-12
    assert got.static
    assert np.array_equal(got.t_measured, command.t)


@pytest.mark.parametrize('name', ROBOTS)
def test_clean_motion_is_the_dh_product(name):
    robot = ROBOTS[name]
    command = weave(robot, 2.0)
    got = record(robot, [], command)
    assert np.abs(got.position - dh_positions(robot, command.q)).max() < 1e-10
    assert np.allclose(got.q, command.q, rtol=0.0, atol=1e-14)
    assert np.allclose(got.qd[1:-1], np.gradient(command.q, command.t, axis=0)[1:-1], atol=2e-3)


def test_between_samples_the_motion_is_smooth():
    command, fine = weave(UR5, 1.5), weave(UR5, 1.5, rate=1000.0)
    got = record(UR5, [], command, Tracker(rate=77.0))
    want = np.stack(
        [np.interp(got.t_measured, fine.t, column) for column in dh_positions(UR5, fine.q).T],
        axis=1,
    )
    assert np.abs(got.position - want).max() < 2e-6


def test_unknown_names_are_refused():
    with pytest.raises(ValueError, match='unknown effect'):
        record(UR5, [{'effect': 'gremlins'}], stations(UR5, 3), EXACT)
    with pytest.raises(ValueError, match='no joint'):
        record(UR5, [{'effect': 'backlash', 'joint': 'knee', 'width': 1e-4}], stations(UR5, 3))
