# Copyright 2026 weld_twin contributors
# SPDX-License-Identifier: Apache-2.0
"""Plans of a measurement: what more stations, less noise and a wider region change."""

import numpy as np
import pytest

from weld_twin_core.arm import catalog
from weld_twin_core.arm.chain import forward
from weld_twin_core.diagnosis.predicting.planned import plan_stations
from weld_twin_core.errors import DataError

ROBOT = catalog.load('ur5')


@pytest.fixture(scope='module')
def plan():
    return plan_stations(ROBOT, 30, 2e-4, 3e-5)


def test_every_station_makes_it_surer(plan):
    assert (np.diff(plan.sigma) <= 0.0).all()
    assert (np.diff(plan.within) >= 0.0).all()
    assert plan.within[0] == 0.0, 'nothing is known before base and tool are'
    assert plan.within[-1] > 0.95
    assert (np.diff(plan.elsewhere) <= 0.0).all()
    assert plan.elsewhere[-1] > plan.sigma[-1] > 3e-5, "a diagnosis counts noise as the arm's"


def test_stations_are_all_different_and_clear_of_the_floor(plan):
    apart = np.linalg.norm(plan.q[:, None] - plan.q[None], axis=2) + 9.0 * np.eye(30)
    assert apart.min() > 0.1
    assert forward(ROBOT, plan.q)[:, 2, 3].min() > 0.1
    ROBOT.check_positions(plan.q)


def test_noise_is_paid_for_in_proportion_once_all_is_known(plan):
    rough = plan_stations(ROBOT, 30, 2e-4, 3e-4)
    assert 3.0 < rough.sigma[-1] / plan.sigma[-1] <= 10.0


def test_chosen_stations_say_more_than_stations_that_look_alike(plan):
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
