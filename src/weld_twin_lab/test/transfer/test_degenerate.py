# Copyright 2026 weld_twin contributors
# SPDX-License-Identifier: Apache-2.0
"""Recordings that hardly say anything are diagnosed, or refused in a sentence, never a traceback."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
import pytest
from hypothesis import HealthCheck, given, settings
from hypothesis import strategies as st

from weld_twin_lab.transfer.degenerate import (
    ALIGNS,
    ERRORS,
    ROBOTS,
    Draw,
    drawn,
    recording_of,
    tried,
)

DRAWS = st.builds(
    Draw,
    robot=st.sampled_from(ROBOTS),
    stations=st.booleans(),
    count=st.integers(1, 60),
    turned=st.booleans(),
    align=st.sampled_from(ALIGNS),
    still=st.integers(0, 9),
    travel=st.sampled_from([0.0, 1e-6, 0.02, 0.5, 1.5]),
    grid=st.sampled_from([0.0, 1.0, 10.0]),
    repeats=st.sampled_from([1, 2, 10]),
    noise=st.sampled_from([0.0, 1e-9, 2e-5, 1e-3]),
    flat=st.integers(0, 3),
    error=st.sampled_from(ERRORS),
    warm=st.booleans(),
    seed=st.integers(0, 10_000),
)


@pytest.mark.slow
@pytest.mark.filterwarnings('ignore')
@settings(
    max_examples=80, deadline=None, derandomize=True, suppress_health_check=list(HealthCheck)
)
@given(DRAWS)
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
@pytest.mark.parametrize('seed', [10, 40, 107, 108, 1084, 1146])
def test_draws_that_once_ended_in_a_traceback(seed):
    assert tried(drawn(seed))['traceback'] is None


@pytest.mark.filterwarnings('ignore')
@pytest.mark.parametrize('seed', [383, 1329], ids=['frames put back', 'many at once'])
def test_nothing_is_told_beyond_what_machines_have(seed):
    assert tried(drawn(seed))['wrong'] == []


def test_a_draw_is_what_it_says():
    draw = Draw('nine', still=4, grid=10.0, repeats=3, flat=2, count=12)
    recording, robot = recording_of(draw)
    q, position = recording.joints.q, recording.measured.position
    assert robot.n == 9 and q.shape == (12, 9)
    assert not np.ptp(q[:, 5:], axis=0).any() and np.ptp(q[:, :5], axis=0).all()
    np.testing.assert_allclose(np.degrees(q) / 10.0, np.rint(np.degrees(q) / 10.0), atol=1e-9)
    assert (q[0] == q[2]).all() and (q[0] != q[3]).any()
    assert not position[:, :2].any() and position[:, 2].any()
