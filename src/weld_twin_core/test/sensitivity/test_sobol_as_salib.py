# Copyright 2026 weld_twin contributors
# SPDX-License-Identifier: Apache-2.0
"""Sobol's design, indices and intervals against those of SALib."""

from __future__ import annotations

import numpy as np
import pytest
from SALib.analyze import sobol as salib_analyze
from SALib.sample import sobol as salib_sample

from weld_twin_core.sensitivity.sobol import base_pair, mixed, sobol_estimates, sobol_half_widths


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
