# Copyright 2026 weld_twin contributors
# SPDX-License-Identifier: Apache-2.0
"""Clocks that disagree: named by the analyzer, in words that hold the offset."""

import re
import time

import numpy as np
import pytest

from weld_twin_core.arm.catalog import load
from weld_twin_msgs_py.messages.topics import MEASURED_POSE, TWIN_POSE
from weld_twin_nodes.harness.cell import HealthListener
from weld_twin_nodes.live.deviation_analyzer import DeviationAnalyzer
from weld_twin_nodes.streams.deviation_stream import Deviations

S = 1_000_000_000
START = 1_700_000_000 * S
NOISE = 2e-5


def way(t):
    """Return a way of some cm/s that is like itself again at no shift."""
    return 0.1 * np.stack([np.sin(0.8 * t), np.cos(1.1 * t), np.sin(0.5 * t + 1.0)], axis=-1)


@pytest.fixture
def now(monkeypatch):
    """Time in the hand of the test [s]."""
    clock = [50.0]
    module = 'weld_twin_nodes.streams.deviation_stream.time.monotonic'
    monkeypatch.setattr(module, lambda: clock[0])
    return clock


def said_of(now, offset, seconds=5.0, pace=1.0, truth=way, latency=0.0):
    """Return all that is told of a tracker at 60 Hz whose stamps are ahead by an offset(t) [s]."""
    deviations, rng, said = Deviations(load('ur5')), np.random.default_rng(4), []
    events = [(k / 100.0, 'twin') for k in range(round(100 * seconds * pace))]
    events += [(k / 60.0 + latency, 'measured') for k in range(round(60 * seconds * pace))]
    events += [(pace * k, 'look') for k in range(1, round(seconds) + 1)]
    begun = now[0]
    for t, kind in sorted(events):
        now[0] = begun + t / pace
        if kind == 'look':
            said.append(deviations.clocks())
        elif kind == 'twin':
            list(deviations.add_twin(START + round(t * S), way(np.array(t))))
        else:
            taken = t - latency
            seen = truth(np.array(taken)) + rng.normal(scale=NOISE, size=3)
            stamp = START + round((taken + offset(taken)) * S)
            list(deviations.add_measured(stamp, seen))
    return said


def offset_told(said):
    """Return the offset of the last sentence that names one [s]."""
    found = [re.search(r'are ([\d.]+) s (ahead of|behind) the joints', line) for line in said]
    last = next(match for match in reversed(found) if match)
    return float(last[1]) * (1.0 if last[2] == 'ahead of' else -1.0)


@pytest.mark.parametrize('offset', [0.05, -0.05, 0.8, -0.8, 60.0, -60.0, 3600.0])
def test_an_offset_is_named_within_five_seconds(now, offset):
    said = said_of(now, lambda t: offset)
    assert offset_told(said) == pytest.approx(offset, abs=max(0.003, 0.01 * abs(offset)))


def test_what_nothing_pairs_with_is_counted(now):
    line = said_of(now, lambda t: -60.0)[-1]
    assert re.fullmatch(
        r'no measurement meets a pose of the twin: \d+ wait, \d+ are dropped; '
        r'measurements are 60\.0 s behind the joints',
        line,
    )
    dropped = int(re.search(r'(\d+) are dropped', line)[1])
    assert 280 <= dropped <= 300


@pytest.mark.parametrize('pace', [0.1, 1.0, 40.0])
@pytest.mark.parametrize('latency', [0.0, 0.1])
def test_clocks_that_agree_are_not_blamed(now, pace, latency):
    def off(t):
        return way(t) + np.array([1.5e-3, -2e-3, 1e-3]) + 1e-3 * np.sin(5.0 * t)[..., None]

    assert not any(said_of(now, lambda t: 0.0, 12.0 / pace, pace, off, latency * pace))


def test_an_arm_at_rest_shows_no_offset_of_some_hundredths(now):
    rest = np.array([0.3, 0.2, 0.1])
    said = said_of(now, lambda t: 0.05, truth=lambda t: rest)
    assert not any('0.0' in line for line in said)


def test_a_clock_that_drifts_is_told_with_its_rate(now):
    said = said_of(now, lambda t: 100e-6 * t, seconds=120.0)
    rates = [float(m[1]) for line in said if (m := re.search(r'drifts by ([+-]\d+) ppm', line))]
    assert rates and rates[-1] == pytest.approx(100.0, rel=0.15)


def test_a_clock_that_is_set_does_not_look_like_one_that_drifts(now):
    """A step of 20 ms, and 100 ppm from then on: the rate told is that of the drift."""
    said = said_of(now, lambda t: (0.02 + 100e-6 * (t - 15.0)) * (t > 15.0), seconds=90.0)
    rates = [float(m[1]) for line in said if (m := re.search(r'drifts by ([+-]\d+) ppm', line))]
    assert rates
    assert all(rate == pytest.approx(100.0, rel=0.3) for rate in rates)


def test_an_offset_that_comes_while_the_cell_works_is_named_within_five_seconds(now):
    said = said_of(now, lambda t: 0.05 * (t > 15.0), seconds=21.0)
    assert not any(said[:15])
    assert offset_told(said[:20]) == pytest.approx(0.05, abs=0.003)


def run_cell(cell, offset, until, shift=0.0, limit=60.0):
    """Publish twin and measurements in real time until something is so."""
    twin, measured = cell.publisher(TWIN_POSE), cell.publisher(MEASURED_POSE)
    begun, sent = time.monotonic(), [0, 0]
    epoch = time.time_ns()

    def step():
        t = time.monotonic() - begun
        for which, rate in enumerate((100.0, 60.0)):
            while sent[which] / rate < t:
                at = sent[which] / rate
                stamp = epoch + round((at + (offset if which else 0.0)) * S)
                place = way(np.array(at)) + which * shift
                (measured if which else twin).publish(cell.messages.pose(stamp, place, np.eye(3)))
                sent[which] += 1
        return until()

    cell.wait(step, 'the sentence', limit=limit)


@pytest.mark.parametrize(
    ('offset', 'shift', 'pattern'),
    [
        (0.05, 0.0, r'measurements are 0\.0(4|5)\d s ahead of the joints'),
        (
            -60.0,
            0.0,
            r'\d+ wait, \d+ are dropped; measurements are (5[5-9]|6[0-5])\.\d s behind the joints',
        ),
        (0.0, 2.0, r'the deviation is 3\.46e\+03 mm, more than any arm is off by \(20 mm\)'),
    ],
)
def test_the_node_warns_in_its_log_and_health(cell, offset, shift, pattern):
    cell.add(DeviationAnalyzer, reliable_inputs=True)
    health = HealthListener(cell.node)

    def told():
        return [text for level, text in health.of('deviation_analyzer') if level == 'warn']

    run_cell(cell, offset, lambda: any(re.search(pattern, text) for text in told()), shift)
