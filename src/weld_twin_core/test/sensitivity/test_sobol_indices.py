# Copyright 2026 weld_twin contributors
# SPDX-License-Identifier: Apache-2.0
"""Sobol and Morris against functions whose indices are known on paper, and against SALib."""

from importlib.metadata import version

import numpy as np
import pytest

from weld_twin_core.errors import DataError
from weld_twin_core.sensitivity import MorrisDesign, SobolDesign, morris_screening, sobol_indices


def ishigami(unit):
    x = np.pi * (2.0 * unit - 1.0)
    return np.sin(x[:, 0]) + 7.0 * np.sin(x[:, 1]) ** 2 + 0.1 * x[:, 2] ** 4 * np.sin(x[:, 0])


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
    from SALib.analyze import morris as measured  # takes half a second, which collecting is spared
    from SALib.sample import morris as drawn

    names = tuple('abcde')
    design = MorrisDesign(names, 6, seed=4)
    problem = {'num_vars': 5, 'names': list(names), 'bounds': [[0.02, 0.98]] * 5}
    asked = {'num_levels': 8}
    seeds = [np.random.default_rng([4, k]) for k in range(2)]
    runs = drawn.sample(problem, 6, seed=seeds[0], **asked)
    np.testing.assert_allclose(design.samples(), runs, rtol=1e-14)
    results = np.sin(runs @ np.arange(1.0, 6.0)) + runs[:, 0] * runs[:, 4]
    wanted = measured.analyze(problem, runs, results, seed=seeds[1], **asked)
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


@pytest.mark.parametrize('groups', [None, tuple('ghgfh')])
def test_design_indices_and_intervals_are_those_of_salib(groups):
    from SALib.analyze import sobol as measured
    from SALib.sample import sobol as drawn
    from SALib.util import compute_groups_matrix

    problem = {'num_vars': 5, 'names': list('abcde'), 'bounds': [[0.0, 1.0]] * 5}
    if groups:
        problem['groups'] = list(groups)
    theirs = drawn.sample(problem, 64, calc_second_order=False, seed=7)
    design = SobolDesign(tuple('abcde'), 64, groups, 7)
    np.testing.assert_array_equal(design.samples(), theirs)
    _, names = compute_groups_matrix(list(groups or 'abcde'))
    assert design.labels == tuple(names)
    runs = theirs @ np.arange(5.0) + 3.0 * theirs[:, 0] * theirs[:, 4] ** 2
    wanted = measured.analyze(problem, runs, calc_second_order=False, seed=7)
    found = design.indices(runs)
    for key, value in (
        ('S1', found.first),
        ('ST', found.total),
        ('S1_conf', found.first_half),
        ('ST_conf', found.total_half),
    ):
        np.testing.assert_allclose(value, np.asarray(wanted[key], dtype=float), atol=1e-12)
