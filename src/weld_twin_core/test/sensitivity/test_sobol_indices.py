# Copyright 2026 weld_twin contributors
# SPDX-License-Identifier: Apache-2.0
"""Sobol and Morris against functions whose indices are known on paper, and against SALib."""

from importlib.metadata import version

import numpy as np
import pytest
from SALib.analyze import morris as salib_screening
from SALib.analyze import sobol as salib_analyze
from SALib.sample import morris as salib_ways
from SALib.sample import sobol
from SALib.sample import sobol as salib_sample
from SALib.util import compute_groups_matrix
from scipy.stats import norm

from weld_twin_core.errors import DataError
from weld_twin_core.sensitivity import MorrisDesign, SobolDesign, morris_screening, sobol_indices
from weld_twin_core.sensitivity.sobol import base_pair, mixed, sobol_estimates, sobol_half_widths


def ishigami(unit):
    x = np.pi * (2.0 * unit - 1.0)
    return np.sin(x[:, 0]) + 7.0 * np.sin(x[:, 1]) ** 2 + 0.1 * x[:, 2] ** 4 * np.sin(x[:, 0])


def ishigami_indices(a=7.0, b=0.1):
    """Ishigami and Homma (1990), in closed form."""
    v1 = 0.5 * (1.0 + b * np.pi**4 / 5.0) ** 2
    v2 = a**2 / 8.0
    v13 = 8.0 * b**2 * np.pi**8 / 225.0
    total = v1 + v2 + v13
    return np.array([v1, v2, 0.0]) / total, np.array([v1 + v13, v2, v13]) / total


G_WEIGHTS = np.array([0.0, 1.0, 4.5, 9.0, 99.0])


def sobol_g(unit):
    return np.prod((np.abs(4.0 * unit - 2.0) + G_WEIGHTS) / (1.0 + G_WEIGHTS), axis=1)


def sobol_g_indices():
    """Saltelli and Sobol (1995), in closed form."""
    part = 1.0 / (3.0 * (1.0 + G_WEIGHTS) ** 2)
    whole = np.prod(1.0 + part) - 1.0
    others = np.prod(1.0 + part) / (1.0 + part)
    return part / whole, part * others / whole


def inside(found, half, wanted):
    # An index that is zero on paper may have an interval of no width at all.
    return np.abs(found - wanted) <= half + 1e-3


@pytest.mark.parametrize(
    ('function', 'wanted', 'count'),
    [(ishigami, ishigami_indices(), 3), (sobol_g, sobol_g_indices(), 5)],
)
def test_indices_lie_in_their_intervals_around_the_analytic_ones(function, wanted, count):
    found = sobol_indices(function, [f'x{k}' for k in range(count)], 1024, seed=0)
    first, total = wanted
    assert inside(found.first, found.first_half, first).all()
    assert inside(found.total, found.total_half, total).all()
    assert found.total_half.max() < 0.1


def test_first_order_index_of_a_linear_model_is_its_share_of_the_variance():
    weights, std = np.array([3.0, -1.0, 0.5]), np.array([1.0, 2.0, 0.1])
    found = sobol_indices(lambda u: norm.ppf(u) * std @ weights, 'abc', 1024)
    share = (weights * std) ** 2 / ((weights * std) ** 2).sum()
    np.testing.assert_allclose(found.first, share, atol=0.01)
    np.testing.assert_allclose(found.total, share, atol=0.01)


@pytest.mark.parametrize('groups', [None, ('g', 'h', 'g', 'f')])
def test_the_design_is_the_one_salib_would_draw(groups):
    problem = {'num_vars': 4, 'names': list('abcd'), 'bounds': [[0.0, 1.0]] * 4}
    if groups:
        problem['groups'] = list(groups)
    wanted = sobol.sample(problem, 64, calc_second_order=False, seed=5)
    found = SobolDesign(tuple('abcd'), 64, groups, 5)
    np.testing.assert_array_equal(found.samples(), wanted)
    _, names = compute_groups_matrix(list(groups or 'abcd'))
    assert found.labels == tuple(names)


def test_group_index_of_a_linear_model_is_the_share_of_the_group():
    weights = np.array([1.0, 2.0, 3.0, 4.0])
    groups = ('left', 'right', 'left', 'right')
    found = sobol_indices(lambda u: u @ weights, 'abcd', 1024, groups=groups)
    assert found.names == ('left', 'right')
    np.testing.assert_allclose(found.total, [10.0 / 30.0, 20.0 / 30.0], atol=0.01)


def test_seed_zero_is_a_seed():
    first, second = (sobol_indices(ishigami, 'abc', 256, seed=0) for _ in range(2))
    other = sobol_indices(ishigami, 'abc', 256, seed=1)
    np.testing.assert_array_equal(first.total, second.total)
    np.testing.assert_array_equal(first.total_half, second.total_half)
    assert (first.total != other.total).any()
    assert first.as_dict()['seed'] == 0


def test_morris_keeps_to_seed_zero_as_well():
    runs = [morris_screening(ishigami, 'abc', 20, seed=0).as_dict() for _ in range(2)]
    assert runs[0] == runs[1]


@pytest.mark.skipif(version('SALib') < '1.6', reason='earlier ones draw from other numbers')
def test_ways_and_measures_of_morris_are_those_of_salib():
    names = tuple('abcde')
    design = MorrisDesign(names, 6, seed=4)
    problem = {'num_vars': 5, 'names': list(names), 'bounds': [[0.02, 0.98]] * 5}
    asked = {'num_levels': 8}
    seeds = [np.random.default_rng([4, k]) for k in range(2)]
    runs = salib_ways.sample(problem, 6, seed=seeds[0], **asked)
    np.testing.assert_allclose(design.samples(), runs, rtol=1e-14)
    results = np.sin(runs @ np.arange(1.0, 6.0)) + runs[:, 0] * runs[:, 4]
    wanted = salib_screening.analyze(problem, runs, results, seed=seeds[1], **asked)
    found = design.screening(results)
    for key, value in (
        ('mu_star', found.mu_star),
        ('mu_star_conf', found.mu_star_half),
        ('sigma', found.sigma),
    ):
        np.testing.assert_allclose(value, np.asarray(wanted[key], dtype=float), rtol=1e-12)


def test_results_that_are_not_numbers_are_counted_and_refused():
    design = SobolDesign(('a', 'b'), 64)
    results = design.samples() @ [1.0, 2.0]
    results[[17, 40]] = np.nan, np.inf
    with pytest.raises(DataError, match=r'2 of 256 .* run 17'):
        design.indices(results)
    morris = MorrisDesign(('a', 'b'), 4)
    bad = np.full(12, 1.0)
    bad[5] = np.nan
    with pytest.raises(DataError, match='run 5'):
        morris.screening(bad)


def test_a_result_without_scatter_is_refused():
    with pytest.raises(DataError, match='no scatter'):
        sobol_indices(lambda u: np.ones(len(u)), 'ab', 64)


def test_sample_count_that_is_no_power_of_two_is_refused():
    with pytest.raises(DataError, match='power of two'):
        SobolDesign(('a', 'b'), 1000)


def test_convergence_tells_of_half_and_all_samples():
    found = sobol_indices(ishigami, 'abc', 1024, seed=0)
    assert found.runs == 1024 * 5
    half = sobol_indices(ishigami, 'abc', 512, seed=0)
    assert found.total_half.max() < half.total_half.max()
    # The first half of a Sobol sequence is the shorter sequence.
    assert found.change == pytest.approx(np.abs(found.total - half.total).max())
    assert not sobol_indices(ishigami, 'abc', 16).converged


def test_morris_of_a_linear_model_is_its_slope_without_scatter():
    weights = np.array([3.0, -1.0, 0.0])
    found = morris_screening(lambda u: u @ weights, 'abc', 10)
    np.testing.assert_allclose(found.mu_star, np.abs(weights) * 0.96, rtol=1e-9)
    np.testing.assert_allclose(found.sigma, 0.0, atol=1e-9)


@pytest.mark.parametrize('groups', [None, list('ghgfh')])
def test_design_indices_and_intervals_are_those_of_salib(groups: list[str] | None) -> None:
    problem = {'num_vars': 5, 'names': list('abcde'), 'bounds': [[0.0, 1.0]] * 5}
    if groups:
        problem['groups'] = groups
    theirs = salib_sample.sample(problem, 64, calc_second_order=False, seed=7)
    ours = mixed(*base_pair(5, 64, 7), groups)
    assert np.abs(ours.reshape(theirs.shape) - theirs).max() == 0.0
    runs = theirs @ np.arange(5.0) + 3.0 * theirs[:, 0] * theirs[:, 4] ** 2
    found = salib_analyze.analyze(problem, runs, calc_second_order=False, seed=7)
    results = runs.reshape(64, -1)
    first, total = sobol_estimates(results)
    first_half, total_half = sobol_half_widths(results, 0.95, np.random.default_rng(7))
    assert np.abs(first - found['S1']).max() < 1e-12
    assert np.abs(total - found['ST']).max() < 1e-12
    assert np.abs(first_half - found['S1_conf']).max() < 1e-12
    assert np.abs(total_half - found['ST_conf']).max() < 1e-12
