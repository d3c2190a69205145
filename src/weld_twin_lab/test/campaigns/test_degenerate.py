# Copyright 2026 weld_twin contributors
# SPDX-License-Identifier: Apache-2.0
"""Recordings that hardly say anything are diagnosed, or refused in a sentence, never a traceback."""

from dataclasses import replace

import numpy as np
import pytest

from weld_twin_lab.campaigns.fuzz import ALIGNS, ERRORS, ROBOTS, Draw, drawn, recording_of, tried

DRAWS = 8
"""Recordings drawn; `weld-twin lab campaign fuzz --recordings 3000` draws thousands."""
VALUES = {
    'robot': ROBOTS,
    'stations': (True, False),
    'count': (1, 2, 3, 4, 5, 6, 7, 9, 12, 20, 40, 60),
    'turned': (True, False),
    'align': ALIGNS,
    'still': tuple(range(10)),
    'travel': (0.0, 1e-6, 0.02, 0.5, 1.5),
    'grid': (0.0, 1.0, 10.0),
    'repeats': (1, 2, 10),
    'noise': (0.0, 1e-9, 2e-5, 1e-3),
    'flat': (0, 1, 2, 3),
    'error': ERRORS,
    'warm': (True, False),
    'seed': range(10_000),
}


def spread():
    """Return draws in which every value of every field comes about equally often."""
    rng = np.random.default_rng(0)
    columns = {}
    for name, values in VALUES.items():
        places = (np.arange(DRAWS) * len(values) // DRAWS + rng.integers(len(values))) % len(
            values
        )
        columns[name] = [values[place] for place in rng.permutation(places)]
    return [
        Draw(**dict(zip(columns, row, strict=True))) for row in zip(*columns.values(), strict=True)
    ]


@pytest.mark.slow
@pytest.mark.filterwarnings('ignore')
@pytest.mark.parametrize('draw', spread(), ids=range(DRAWS))
def test_no_traceback_and_nothing_absurd(draw):
    came = tried(draw)
    assert came['traceback'] is None, came['traceback']
    assert came['wrong'] == []
    if came['status'] == 'refused':
        assert len(came['sentence'].split()) > 3


SLIDE = Draw('slide', False, 3, False, '', 0, 0.02, 0.0, 1, 0.0, 0, 'none', False, 0)
"""One axis that hardly moves, measured without noise."""


@pytest.mark.filterwarnings('ignore')
@pytest.mark.parametrize(
    'draw',
    [
        SLIDE,
        replace(SLIDE, count=21, align='tool', travel=0.5, repeats=2, flat=1, error='jumbled'),
    ],
)
def test_one_axis_is_no_traceback(draw):
    assert tried(draw)['traceback'] is None


@pytest.mark.filterwarnings('ignore')
@pytest.mark.parametrize('seed', [10, 40, 107, 108])
def test_draws_that_once_ended_in_a_traceback(seed):
    assert tried(drawn(seed))['traceback'] is None


@pytest.mark.filterwarnings('ignore')
def test_many_causes_at_once_are_none_beyond_what_machines_have():
    assert tried(drawn(1329))['wrong'] == []


def test_a_draw_is_what_it_says():
    draw = Draw('nine', still=4, grid=10.0, repeats=3, flat=2, count=12)
    recording, robot = recording_of(draw)
    q, position = recording.joints.q, recording.measured.position
    assert robot.n == 9 and q.shape == (12, 9)
    assert not np.ptp(q[:, 5:], axis=0).any() and np.ptp(q[:, :5], axis=0).all()
    np.testing.assert_allclose(np.degrees(q) / 10.0, np.rint(np.degrees(q) / 10.0), atol=1e-9)
    assert (q[0] == q[2]).all() and (q[0] != q[3]).any()
    assert not position[:, :2].any() and position[:, 2].any()
