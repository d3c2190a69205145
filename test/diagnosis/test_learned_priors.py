# Copyright 2026 weld_twin contributors
# SPDX-License-Identifier: Apache-2.0
"""The size learned for a family against maximising the marginal likelihood outright."""

import numpy as np
import pytest
from diagnosis_cells import effect, known_scale, tiny
from scipy.optimize import minimize
from scipy.stats import multivariate_normal

from weld_twin_core.diagnosis.algebra.fit import fit
from weld_twin_core.diagnosis.algebra.learned_sizes import learned_precision
from weld_twin_core.diagnosis.beliefs import Beliefs
from weld_twin_core.diagnosis.many.small_errors import shrunk_fit

ROWS = 150


def members(sizes, noise, seed=0, count=12):
    """Return columns, data, group numbers and scales of groups whose members have given sizes."""
    rng = np.random.default_rng(seed)
    labels = np.repeat(np.arange(len(sizes)), count)
    scales = rng.uniform(0.5, 2.0, labels.size) * np.repeat([1e-3, 1.0, 30.0][: len(sizes)], count)
    x = rng.normal(size=labels.size) * np.array(sizes)[labels] * scales
    columns = rng.normal(size=(labels.size, ROWS)) / scales[:, None]
    return columns, x @ columns + noise * rng.normal(size=ROWS), labels, scales


def learned(columns, y, labels, scales):
    """Return the prior precision and the freedom it leaves."""
    return learned_precision(columns @ columns.T, columns @ y, y @ y, y.size, labels, scales)


def most_likely(columns, y, labels, scales):
    """Return the prior precision that maximises p(y), the members integrated out."""
    parts = [(columns[labels == g] * scales[labels == g, None]) for g in range(labels.max() + 1)]
    kernels = [part.T @ part for part in parts]

    def loss(logs):
        covariance = np.exp(logs[-1]) * np.eye(y.size)
        for log, kernel in zip(logs[:-1], kernels, strict=True):
            covariance += np.exp(log) * kernel
        return -multivariate_normal.logpdf(y, cov=covariance)

    found = minimize(loss, np.zeros(len(parts) + 1), method='L-BFGS-B').x
    return np.exp(found[-1] - found[labels]) / scales**2


def test_the_precision_learned_maximises_the_marginal_likelihood_whatever_the_noise():
    problem = members([2.0, 0.5], noise=1.3)
    np.testing.assert_allclose(learned(*problem)[0], most_likely(*problem), rtol=0.03)
    columns, y, labels, scales = members([2.0, 0.7], noise=5.0, seed=3)
    expected = most_likely(columns, y, labels, scales)
    np.testing.assert_allclose(learned(columns, y, labels, scales)[0], expected, rtol=0.05)


def test_a_group_that_the_data_do_not_need_shrinks_to_nothing():
    columns, y, labels, scales = members([1.0, 0.0], noise=1.0, seed=4)
    precision, _ = learned(columns, y, labels, scales)
    fitted = np.linalg.solve(columns @ columns.T + np.diag(precision), columns @ y) / scales
    free = np.linalg.lstsq(columns.T, y, rcond=None)[0] / scales
    needed = labels == 0
    assert np.linalg.norm(fitted[~needed]) < 0.35 * np.linalg.norm(free[~needed])
    assert np.linalg.norm(fitted[needed]) > 0.9 * np.linalg.norm(free[needed])


def test_the_freedom_left_is_the_trace_of_what_maps_data_to_fit():
    columns, y, labels, scales = members([0.3, 0.1], noise=2.0, seed=5)
    precision, freedom = learned(columns, y, labels, scales)
    normal = columns @ columns.T
    mapping = columns.T @ np.linalg.solve(normal + np.diag(precision), columns)
    assert freedom == pytest.approx(np.trace(mapping), rel=0.02)
    assert freedom < 0.9 * labels.size


def test_members_marked_free_have_no_prior():
    columns, y, labels, scales = members([1.0, 1.0], noise=1.0)
    free = np.where(labels == 1, -1, labels)
    precision, _ = learned(columns, y, free, scales)
    assert (precision[labels == 1] == 0.0).all() and (precision[labels == 0] > 0.0).all()


def test_a_spread_learned_is_never_wider_than_that_of_machines_at_large():
    columns, y, labels, scales = members([2.0, 0.5], noise=1.3)
    believed = 1.0 / (np.where(labels == 0, 1.0, 3.0) * scales) ** 2
    parts = columns @ columns.T, columns @ y, y @ y, y.size
    precision, _ = learned_precision(*parts, labels, scales, believed)
    alone, _ = learned(columns, y, labels, scales)
    noise = (precision / believed)[labels == 0][0]
    np.testing.assert_allclose((precision / believed)[labels == 0], noise)
    assert noise == pytest.approx(1.3**2, rel=0.3)
    # Where a machine's own spread is far below, its own members decide.
    np.testing.assert_allclose(precision[labels == 1], alone[labels == 1], rtol=2.5)
    assert (precision[labels == 1] > 4.0 * noise * believed[labels == 1]).all()


FAMILIES = (
    ('joint_offset', 'offset', 2e-4),
    ('link_length', 'da', 1e-4),
    ('link_offset', 'dd', 1e-4),
    ('link_twist', 'dalpha', 2e-4),
)


def small_errors(seed):
    """Return errors of every joint and family, and the precision of a prior of their sizes."""
    rng = np.random.default_rng(seed)
    joints = tiny()[1].robot.joint_names
    true = tuple(
        effect(name, joint=j, **{key: float(rng.normal(scale=size))})
        for name, key, size in FAMILIES
        for j in joints
    )
    return true, np.repeat([size**-2 for _, _, size in FAMILIES], len(joints))


def test_sizes_learned_predict_nearly_as_well_as_sizes_known_and_better_than_none():
    errors = []
    for seed in range(6):
        true, precision = small_errors(seed)
        problem, model = tiny(true, seed, count=20, noise=1e-4, turned=False)
        fresh, _ = tiny(true, seed + 50, count=200, noise=0.0, turned=False)
        scale = known_scale(problem, position=1e-4)
        start = model.with_found(tuple(e.fit.with_coordinates(np.zeros(1)) for e in true))
        fits = (
            shrunk_fit(problem, start, scale, Beliefs())[0],
            fit(problem, start, scale, precision),
            fit(problem, start, scale, np.zeros(precision.size)),
            fit(problem, model, scale),
        )
        errors.append([(fresh.residuals(f.model)[0] ** 2).mean() for f in fits])
    shrunk, known, free, none = np.sqrt(np.mean(errors, axis=0))
    assert shrunk < 1.15 * known
    assert shrunk < 0.9 * free
    assert shrunk < 0.9 * none


@pytest.mark.parametrize('align', [(), ('base',)])
def test_with_priors_the_slope_of_the_fit_balances_their_pull(align):
    offsets = tuple(
        effect('joint_offset', joint=j, offset=2e-4)
        for j in ('shoulder_lift_joint', 'elbow_joint', 'wrist_1_joint')
    )
    problem, model = tiny(offsets, align=align)
    scale = known_scale(problem)
    precision = np.array([1e8, 1e9, 1e7])
    found = fit(problem, model.with_found(offsets), scale, precision)
    step = 1e-7
    for k in range(3):
        costs = []
        for sign in (1.0, -1.0):
            x = found.coordinates + sign * step * np.eye(3)[k]
            moved = tuple(e.fit.with_coordinates(x[j : j + 1]) for j, e in enumerate(offsets))
            residual = problem.whitened(problem.residuals(found.model.with_found(moved)), scale)
            costs.append(residual @ residual)
        slope = (costs[0] - costs[1]) / (2.0 * step)
        assert slope == pytest.approx(-2.0 * precision[k] * found.coordinates[k], rel=2e-3)
