# Copyright 2026 weld_twin contributors
# SPDX-License-Identifier: Apache-2.0
"""How many readings may be called strays before they are structure, and what they spoil."""

import numpy as np
import pytest

from weld_twin_core.arm.catalog import load
from weld_twin_core.diagnosis import diagnose
from weld_twin_core.diagnosis.algebra.fit import trusted
from weld_twin_core.diagnosis.result import Site
from weld_twin_core.effects import LinkLength
from weld_twin_core.recording import JointMotion, Measurements, Recording
from weld_twin_core.twin.twin import Twin


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
