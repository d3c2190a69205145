# Copyright 2026 weld_twin contributors
# SPDX-License-Identifier: Apache-2.0
"""Plans of a measurement; how much farther off regions are than models say, of known draws."""

import numpy as np
import pytest

from weld_twin_core import DataError, catalog, forward
from weld_twin_core.diagnosis.predicting.allowed import Conditioning, dispersion
from weld_twin_core.diagnosis.predicting.planned import plan_stations
from weld_twin_core.diagnosis.predicting.sizes import Prior, Rows

ROBOT = catalog.load('ur5')


@pytest.fixture(scope='module')
def plan():
    return plan_stations(ROBOT, 30, 2e-4, 3e-5)


def test_every_station_makes_it_surer(plan):
    assert (np.diff(plan.sigma) <= 0.0).all()
    assert (np.diff(plan.within) >= 0.0).all()
    assert plan.within[0] == 0.0, 'nothing is known before base and tool are'
    assert plan.within[-1] > 0.95
    # One in three of errors with a standard deviation of the tolerance, or more, is beyond it.
    assert plan.within[plan.sigma > 2e-4].max() < 0.5 + 0.5 * 0.683
    assert (np.diff(plan.elsewhere) <= 0.0).all()
    assert plan.elsewhere[-1] > plan.sigma[-1] > 3e-5, "a diagnosis counts noise as the arm's"


def test_stations_are_all_different_say_more_than_such_that_look_alike_and_pay_for_noise(plan):
    apart = np.linalg.norm(plan.q[:, None] - plan.q[None], axis=2) + 9.0 * np.eye(30)
    assert apart.min() > 0.1
    assert forward(ROBOT, plan.q)[:, 2, 3].min() > 0.1
    ROBOT.check_positions(plan.q)
    rough = plan_stations(ROBOT, 30, 2e-4, 3e-4)
    assert 3.0 < rough.sigma[-1] / plan.sigma[-1] <= 10.0
    alike = plan_stations(ROBOT, 30, 2e-4, 3e-5, spread=np.radians(10.0))
    # Among postures that look alike little is open, for little of the arm is seen.
    assert alike.sigma[0] <= plan.sigma[0] + 1e-9
    assert np.ptp(alike.q, axis=0).max() <= np.radians(20.0) + 1e-9


@pytest.mark.parametrize('values', [(0, 1e-4, 1e-5), (5, 0.0, 1e-5), (5, 1e-4, -1.0)])
def test_numbers_that_mean_nothing_are_refused(values):
    with pytest.raises(DataError, match='a plan needs stations, a tolerance'):
        plan_stations(ROBOT, *values)


def test_few_stations_promise_what_an_arm_corrected_by_them_keeps():
    # Four arms with every usual small error kept 0.03 to 0.08 mm after sixteen stations.
    assert 3e-5 < plan_stations(ROBOT, 16, 2e-4, 3e-5).sigma[-1] < 1e-4


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
        told.append(dispersion(rows.parts(regions), 1.0, [rooted])[0])
    assert 0.6 * true < np.mean(told) < 1.6 * true


def test_regions_that_say_nothing_leave_it_at_what_is_usual():
    rng = np.random.default_rng(1)
    columns, regions = 1e-9 * rng.normal(size=(COUNT, 80)), np.repeat(np.arange(8), 10)
    residual = rng.normal(size=80)
    rows = Rows(columns, residual, 1.0)
    prior = Prior(np.zeros(COUNT), np.ones(COUNT), np.zeros(COUNT, int), NO, NO)
    rooted = Conditioning(rows, prior, np.ones(COUNT), 1.0).rooted
    # A logarithm of standard deviation one half: its exponential has the mean e^(1/8).
    told, _ = dispersion(rows.parts(regions), 1.0, [rooted])
    assert told == pytest.approx(np.exp(0.125), rel=0.01)
