# Copyright 2026 weld_twin contributors
# SPDX-License-Identifier: Apache-2.0
"""How much farther off regions are than models say: against draws whose dispersion is known."""

import numpy as np
import pytest

from weld_twin_core.diagnosis.predicting.allowed import Conditioning, dispersion
from weld_twin_core.diagnosis.predicting.sizes import Prior, Rows

REGIONS, EACH, COUNT = 3, 150, 60
"""Regions of posture, rows of each, and coordinates."""
NO = np.array([False])
"""Of the one family that there is: neither of gears nor tied."""


@pytest.mark.parametrize('true', [1.0, 3.0])
def test_it_is_how_many_times_larger_the_variance_of_unseen_regions_is(true):
    """Every region pulls the coordinates its own way, and by so much that the variance is so large."""
    told = []
    for seed in range(6):
        rng = np.random.default_rng(seed)
        columns = rng.normal(size=(COUNT, REGIONS * EACH))
        regions = np.repeat(np.arange(REGIONS), EACH)
        truth = rng.normal(size=COUNT)
        # A third of what a region alone leaves open: what the others leave open and what they are
        # pulled by themselves make up the rest.
        residual = truth @ columns + rng.normal(size=regions.size)
        for region in range(REGIONS):
            here = columns[:, regions == region]
            open_ = np.linalg.cholesky(np.linalg.inv(here @ here.T))
            own = np.sqrt((true - 1.0) / REGIONS) * open_ @ rng.normal(size=COUNT)
            residual[regions == region] += own @ here
        rows = Rows(columns, residual, 1.0)
        prior = Prior(np.zeros(COUNT), np.ones(COUNT), np.zeros(COUNT, int), NO, NO)
        rooted = Conditioning(rows, prior, np.ones(COUNT), 1.0).rooted
        told.append(dispersion(rows.parts(regions), 1.0, [rooted]))
    assert 0.6 * true < np.mean(told) < 1.6 * true


def test_regions_that_say_nothing_leave_it_at_what_is_usual():
    rng = np.random.default_rng(1)
    columns, regions = 1e-9 * rng.normal(size=(COUNT, 80)), np.repeat(np.arange(8), 10)
    residual = rng.normal(size=80)
    rows = Rows(columns, residual, 1.0)
    prior = Prior(np.zeros(COUNT), np.ones(COUNT), np.zeros(COUNT, int), NO, NO)
    rooted = Conditioning(rows, prior, np.ones(COUNT), 1.0).rooted
    # A logarithm of standard deviation one half: its exponential has the mean e^(1/8).
    told = dispersion(rows.parts(regions), 1.0, [rooted])
    assert told == pytest.approx(np.exp(0.125), rel=0.01)
