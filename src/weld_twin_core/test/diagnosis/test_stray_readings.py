# Copyright 2026 weld_twin contributors
# SPDX-License-Identifier: Apache-2.0
"""How many readings may be called strays before they are structure, and whose noise is laid on whom."""

from types import SimpleNamespace

import numpy as np
import pytest
from scipy.optimize import lsq_linear
from small_arm import small_arm

import weld_twin_core as wt
from weld_twin_core import JointMotion, Measurements, Recording, Twin, diagnose, load
from weld_twin_core.diagnosis.algebra.fit import trusted
from weld_twin_core.diagnosis.algebra.problem import Model, Problem
from weld_twin_core.diagnosis.levels.gathered import _shared_out, scatter
from weld_twin_core.diagnosis.result import Site
from weld_twin_core.effects import LinkLength


@pytest.mark.parametrize(('count', 'strays', 'left_out'), [(70, 1, 1), (70, 5, 1), (200, 5, 4)])
def test_only_a_few_of_many_stations_are_left_out(count, strays, left_out):
    weights = np.ones(count)
    weights[:strays] = np.linspace(0.01, 0.1, strays)
    good = trusted([weights])[0]
    assert (~good).sum() == left_out
    assert good[strays:].all()


def wild(where, count=60, weight=1e-5):
    """Return the weights of a sound recording of which some readings are hundreds of times off."""
    weights = np.ones(count)
    weights[where] = weight
    return weights


def test_four_wild_readings_of_sixty_leave_every_quoted_figure():
    good = trusted([np.ones(60), wild([3, 20, 21, 58])])
    assert good[0].all()
    assert np.flatnonzero(~good[1]).tolist() == [3, 20, 21, 58]


def test_readings_left_out_before_never_count_however_many_stray_beside_them():
    """They have no weight to be divided by: the RMS of all would be no number."""
    weights = wild(slice(10, 20))
    weights[[3, 30, 40]] = 0.0
    good = trusted([weights])[0]
    assert not good[[3, 30, 40]].any() and good.sum() > 40


@pytest.mark.parametrize(
    'weights',
    [
        wild(slice(55, None)),  # the set-up moved before the last five
        wild(slice(None, None, 8)),  # every eighth is no stray
        wild([3, 20, 41, 58], weight=0.05),  # as far off as a missing effect may be
    ],
)
def test_what_structure_may_be_stays_in_every_quoted_figure(weights):
    assert (~trusted([weights])[0]).sum() <= 1


def test_three_strays_of_forty_stations_spoil_neither_the_name_nor_what_is_promised():
    robot, rng = load('ur5'), np.random.default_rng(2)
    link = robot.joint_names[1]
    at_rest = JointMotion(np.arange(40.0), rng.uniform(-1.0, 1.0, (40, robot.n)), static=True)
    seen = Twin(robot, [LinkLength(link, 8e-4)]).poses(Recording('run', at_rest), at_rest.t)
    position = seen.position + 2e-5 * rng.normal(size=(40, 3))
    position[[4, 18, 31]] += 1e-3 * rng.normal(size=(3, 3))
    measured = Recording('run', at_rest, Measurements(at_rest.t, position))
    result = diagnose([measured], robot, align=('base', 'tool'), experiment=False)
    (cause,) = result.causes
    assert (cause.name[0][0], cause.sure) == (Site('link_length', link), True)
    assert result.evidence.strays == ('station 5', 'station 19', 'station 32')
    # Of the gap of half a millimetre no more than the noise is left.
    assert result.shrink.rms_after_m < 5e-5
    assert result.shrink.ratio < 0.1
    # All figures are of the same readings.
    assert not any(result.traces.trusted[0][[4, 18, 31]])
    alone = result.model.alone
    assert max(alone.recorded_m, alone.whole_recorded_m) < 5e-5


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
