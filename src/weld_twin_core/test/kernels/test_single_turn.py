# Copyright 2026 weld_twin contributors
# SPDX-License-Identifier: Apache-2.0
"""One turn in plain numbers, against scipy's rotations."""

import numpy as np
import pytest
from scipy.spatial.transform import Rotation

from weld_twin_core.arm.single_pose import quaternion_matrix, turn_between, turn_matrix
from weld_twin_core.errors import DataError

RNG = np.random.default_rng(8)
SIZES = (0.0, 1e-9, 1e-5, 0.999e-4, 1.001e-4, 1e-2, 1.0, 1.6, 3.1, np.pi)


@pytest.mark.parametrize('size', SIZES)
def test_a_turn_and_back(size):
    for axis in RNG.normal(size=(20, 3)):
        turn = size * axis / np.linalg.norm(axis)
        start = Rotation.from_quat(RNG.normal(size=4))
        matrix = turn_matrix(turn)
        np.testing.assert_allclose(matrix, Rotation.from_rotvec(turn).as_matrix(), atol=1e-15)
        back = np.array(turn_between(matrix @ start.as_matrix(), start.as_matrix()))
        # Near half a turn rounding decides which of two vectors it is, and grows.
        apart = Rotation.from_rotvec(back) * Rotation.from_rotvec(turn).inv()
        assert apart.magnitude() < 1e-14


def test_quaternions_of_any_length_near_one():
    for q in RNG.normal(size=(50, 4)):
        given = q / np.linalg.norm(q) * RNG.uniform(0.9901, 1.0099)
        expected = Rotation.from_quat(q).as_matrix()
        np.testing.assert_allclose(quaternion_matrix(*given, 'q'), expected, atol=1e-15)


@pytest.mark.parametrize('length', [0.0, 0.98, 1.02, np.nan, np.inf])
def test_what_is_no_rotation_is_refused(length):
    with pytest.raises(DataError, match='orientation'):
        quaternion_matrix(0.0, 0.6 * length, 0.0, 0.8 * length, 'orientation')
