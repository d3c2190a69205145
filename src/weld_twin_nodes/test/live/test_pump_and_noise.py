# Copyright 2026 weld_twin contributors
# SPDX-License-Identifier: Apache-2.0
"""Pacing and noise: the parts of the live cell that decide when and how much."""

import numpy as np
import pytest

from weld_twin_core.effects.instrument import MeasurementNoise
from weld_twin_nodes.live.trajectory_generator import STALLED, Pump
from weld_twin_nodes.streams.twin_stream import Noise

STAMPS = np.arange(100) * 10_000_000 + 5
S = 1_000_000_000


@pytest.mark.parametrize(('playback', 'due'), [(1.0, [1, 2]), (2.0, [1, 2, 3, 4, 5])])
def test_a_sample_is_sent_when_its_time_has_come_at_any_speed(playback, due):
    pump = Pump(STAMPS, playback=playback, window=10, answered=False)
    assert list(pump.due(7 * S, 50)) == [0]
    assert list(pump.due(7 * S + 25_000_000, 50)) == due


def test_no_more_than_a_window_is_under_way():
    pump = Pump(STAMPS, playback=0.0, window=10, answered=True)
    assert len(pump.due(0, 50)) == 10
    assert len(pump.due(1, 50)) == 0
    pump.answer(int(STAMPS[3]))
    assert list(pump.due(2, 50)) == [10, 11, 12, 13]


def test_answers_that_stay_out_open_the_window():
    pump = Pump(STAMPS, playback=0.0, window=10, answered=True)
    pump.due(0, 50)
    pump.due(1, 50)
    stalled = int((STALLED + 0.1) * S)
    pump.due(stalled, 50)
    assert len(pump.due(stalled + 1, 50)) > 0


def test_every_sample_is_sent_once():
    pump = Pump(STAMPS, playback=0.0, window=7, answered=True)
    sent = []
    while not pump.done:
        sent += pump.due(0, 5)
        pump.answer(int(STAMPS[sent[-1]]))
    assert sent == list(range(100))


def test_noise_one_sample_at_a_time_is_that_in_bulk_with_the_spread_it_is_told():
    effects = [MeasurementNoise(1e-5), MeasurementNoise(3e-5)]
    bulk = Noise(effects, 5).draw(40)
    live = Noise(effects, 5)
    np.testing.assert_array_equal(np.vstack([live.draw(1) for _ in range(40)]), bulk)
    assert not np.array_equal(Noise(effects, 6).draw(40), bulk)
    drawn = Noise([MeasurementNoise(3e-5), MeasurementNoise(4e-5)], 0).draw(20_000)
    np.testing.assert_allclose(drawn.std(axis=0), 5e-5, rtol=0.03)
    np.testing.assert_allclose(drawn.mean(axis=0), 0.0, atol=2e-6)
