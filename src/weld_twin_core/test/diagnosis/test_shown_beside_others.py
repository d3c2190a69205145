# Copyright 2026 weld_twin contributors
# SPDX-License-Identifier: Apache-2.0
"""How sure an effect is beside all small errors of an arm: against ridge regression, and by hand."""

import numpy as np
import pytest

import weld_twin_core as wt
from weld_twin_core.arm.rotation import rotation_matrix
from weld_twin_core.diagnosis.algebra.problem import Model, Problem
from weld_twin_core.diagnosis.predicting.allowed import Conditioning, shown_beside_others
from weld_twin_core.diagnosis.predicting.sizes import Prior, Rows


def stations(robot, rng, size, real):
    q = np.array([0.3, -1.3, 1.5, -1.2, -1.5, 0.2]) + rng.uniform(-size, size, (40, 6))
    joints = wt.JointMotion(np.arange(40.0), q, static=True)
    poses = wt.Twin(robot, real).poses(wt.Recording('real', joints), joints.t)
    noise = rng.normal(scale=2e-5, size=(2, 40, 3))
    seen = wt.Measurements(
        joints.t, poses.position + noise[0], rotation_matrix(noise[1]) @ poses.rotation
    )
    return wt.Recording('real', joints, seen)


@pytest.mark.parametrize(('size', 'sure'), [(1.2, True), (0.03, False)])
def test_a_zero_is_sure_where_postures_part_it_from_all_other_small_errors(size, sure):
    robot, rng = wt.load('ur5'), np.random.default_rng(3)
    zero = wt.effects.JointOffset('elbow_joint', offset=2e-3)
    problem = Problem((stations(robot, rng, size, [zero]),), frozenset({'base', 'tool'}))
    model = Model(robot, (robot.T_world_base,)).with_found((zero,))
    (shown,) = shown_beside_others(problem, model, problem.unit_scale())
    assert (shown > 3.0) is sure
    assert sure or shown < 1.0


def test_coordinates_beside_each_other_are_those_of_ridge_regression():
    rng = np.random.default_rng(5)
    columns, width = rng.normal(size=(4, 30)), np.array([0.5, 1.0, 2.0, 3.0])
    residual = rng.normal(size=30)
    none = np.zeros(4)
    prior = Prior(none, width, none.astype(int), np.array([False]), np.array([False]))
    mean, covariance = Conditioning(Rows(columns, residual, 1.0), prior, width, 1.0).given()
    inverse = np.linalg.inv(columns @ columns.T + np.diag(width**-2.0))
    assert mean == pytest.approx(inverse @ columns @ residual)
    assert covariance == pytest.approx(inverse)
