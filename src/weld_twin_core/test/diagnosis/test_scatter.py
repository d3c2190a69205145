# Copyright 2026 weld_twin contributors
# SPDX-License-Identifier: Apache-2.0
"""Noise is laid on the joint that makes it, and on none where an instrument does."""

from types import SimpleNamespace

import numpy as np
import pytest
from scipy.optimize import lsq_linear
from small_arm import small_arm

import weld_twin_core as wt
from weld_twin_core.diagnosis.algebra.problem import Model, Problem
from weld_twin_core.diagnosis.levels.gathered import _shared_out, scatter

COUNT = 600
SHOULDER = 1


def told(shaking, noise):
    """Return the scatter of every joint where one shakes [rad] as it moves, beside white noise [m]."""
    robot, rng = small_arm(), np.random.default_rng(1)
    t = 0.02 * np.arange(COUNT)
    q = np.sin(np.outer(t, [0.6, 1.1, 1.7]) + [0.0, 1.0, 2.0]) + [0.0, -1.2, 1.4]
    run = wt.Recording('run', wt.JointMotion(t, q))
    seen = wt.Twin(robot).poses(run)
    problem = Problem((run.with_measured(wt.Measurements(t, seen.position, seen.rotation)),))
    model, scale = Model(robot, (robot.T_world_base,)), problem.unit_scale()
    (maker,) = problem.features(model)
    part = shaking * rng.normal(size=COUNT) * maker.column(('q', SHOULDER))
    part[:3] += noise * rng.normal(size=(3, COUNT))
    unseen = SimpleNamespace(
        problem=problem, scale=scale, targets=problem.whitened([part], scale)[None]
    )
    return scatter(SimpleNamespace(dense=False, final=SimpleNamespace(model=model)), unseen)


@pytest.mark.parametrize(('noise', 'share'), [(1e-6, 1.0), (1e-4, 0.5)])
def test_noise_that_comes_from_a_joint_is_told_with_its_share(noise, share):
    base, shoulder, elbow = told(2e-4, noise)
    assert shoulder.joint == 'shoulder_lift_joint' and shoulder.steady > 5.0
    assert max(base.share, elbow.share) < 0.1 * shoulder.share
    assert 0.6 * share < shoulder.share <= 1.05
    assert share == 1.0 or shoulder.share < 0.95


def test_white_noise_of_an_instrument_comes_from_no_joint():
    assert max(one.share for one in told(0.0, 1e-4)) < 0.1


@pytest.mark.parametrize('off', [0.0, 5.0])
def test_variances_are_those_of_least_squares_with_none_below_zero(off):
    rng = np.random.default_rng(2)
    ways = rng.normal(size=(6, 40)) ** 2
    ways[4] = 0.0
    wanted = [0.5, 0.0, 2.0, 1.0, 0.0, 3.0] @ ways + off * rng.normal(size=40)
    found = _shared_out(ways @ ways.T, ways @ wanted)
    expected = lsq_linear(ways[[0, 1, 2, 3, 5]].T, wanted, (0.0, np.inf), tol=1e-14).x
    np.testing.assert_allclose(np.delete(found, 4), expected, atol=1e-5)
    assert found[4] == 0.0 and (found >= 0.0).all()
