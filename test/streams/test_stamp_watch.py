# Copyright 2026 weld_twin contributors
# SPDX-License-Identifier: Apache-2.0
"""What stamps tell: gaps of a beat are counted, what is no beat is let be, jumps are no gaps."""

import re

import numpy as np
import pytest

from weld_twin_nodes.streams.stamp_watch import (
    FEWEST,
    GAP,
    JUMPED,
    JUMPED_ANYHOW,
    ON_BEAT,
    REGULAR,
    RUSH,
    SILENT,
    SPAN,
    UNPAIRED,
    ClockWatch,
    StampWatch,
    Stream,
)

S = 1_000_000_000
STEP = 2_000_000
N = 4000
STAMPS = S + np.arange(N) * STEP
CAME = np.arange(N) * STEP / S
RNG = np.random.default_rng(5)


def seen(stamps, came):
    """Return the sum of what is missing and the largest jumps, by a look a second."""
    watch, looks, k = StampWatch(), [], 0
    for end in np.arange(came[0] + 1.0, came[-1] + 4.0):
        while k < len(stamps) and came[k] < end:
            watch.add(int(stamps[k]), float(came[k]))
            k += 1
        looks.append(watch.look())
    return sum(x.missing for x in looks), max(x.ahead for x in looks), max(x.back for x in looks)


def without(*spans, share=0.0):
    kept = RNG.random(N) >= share
    for a, b in spans:
        kept[a:b] = False
    kept[[0, -1]] = True
    return kept


def jittered(share):
    return STAMPS + (RNG.normal(0.0, share, N) * STEP).astype(np.int64)


def test_a_stream_keeps_some_seconds_of_samples_that_are_not_too_close():
    stream, here = Stream(0.02), np.zeros(3)
    for k in range(3000):  # at 250 Hz; every fifth is 20 ms after the one before
        stream.add(S + 4_000_000 * k, here, 50.0 + 0.004 * k)
    kept = [sample.stamp for sample in stream.samples]
    assert set(np.diff(kept)) == {20_000_000} and kept[-1] > stream.newest - 20_000_000
    assert kept[-1] - kept[0] == pytest.approx(SPAN * S, abs=20_000_000)
    assert stream.newest == S + 4_000_000 * 2999 and stream.ahead == pytest.approx(-49.0)
    assert stream.in_real_time and stream.alive(62.9) and not stream.alive(63.6)
    stream.add(2 * S, here, 62.0)  # a clock that was set back
    assert [sample.stamp for sample in stream.samples] == [2 * S]


@pytest.mark.parametrize(('pace', 'real'), [(0.6, False), (0.8, True), (1.3, True), (1.5, False)])
def test_stamps_pass_as_time_does_or_faster_or_slower(pace, real):
    stream = Stream(0.02)
    for k in range(100):
        assert not stream._arrivals or k > 74 or not stream.in_real_time  # in less than 0.75 s
        stream.add(S + round(10_000_000 * pace * k), np.zeros(3), 0.01 * k)
    assert stream.in_real_time is real


@pytest.mark.parametrize('kept', [without(share=0.03), without(share=0.3), without((100, 900))])
@pytest.mark.parametrize('stamps', [STAMPS, jittered(0.08)])
def test_what_is_missing_on_a_beat_is_counted(kept, stamps):
    came = CAME if kept[500] else CAME * 0.02  # a queue that overran, played out at once
    missing, ahead, back = seen(stamps[kept], came[kept])
    assert missing == pytest.approx((~kept).sum(), rel=0.0 if stamps is STAMPS else 1e-2)
    assert ahead == back == 0.0


@pytest.mark.parametrize(
    ('stamps', 'came'),
    [
        pytest.param(STAMPS, CAME, id='whole'),
        pytest.param(jittered(0.1), CAME, id='stamped on arrival'),
        pytest.param(np.repeat(STAMPS, 2), np.repeat(CAME, 2), id='two with the same stamps'),
        pytest.param(STAMPS, np.repeat(CAME[::20], 20), id='in bursts'),
        pytest.param(S + np.cumsum(RNG.exponential(STEP, N)).astype(int), CAME, id='as it likes'),
        pytest.param(
            np.concatenate([STAMPS[:2000], STAMPS[2000::2]]),
            np.concatenate([CAME[:2000], CAME[2000::2]]),
            id='half as often from now on',
        ),
        pytest.param(STAMPS[: FEWEST // 2], CAME[: FEWEST // 2], id='too few'),
        pytest.param(
            STAMPS + (np.arange(N) >= 2000) * 5 * S, CAME + (np.arange(N) >= 2000) * 5.0, id='rest'
        ),
    ],
)
def test_nothing_is_missing_where_nothing_is(stamps, came):
    assert seen(stamps, came) == (0, 0.0, 0.0)


@pytest.mark.parametrize('by', [1.5 * JUMPED, 1000.0, 3600.0])
def test_a_clock_that_jumps_is_no_loss(by):
    after = (np.arange(N) >= 2000) * int(by * S)
    missing, ahead, back = seen(STAMPS + after, CAME)
    assert (missing, back) == (0, 0.0)
    assert ahead == pytest.approx(by)
    missing, ahead, back = seen(STAMPS - after, CAME)
    assert (missing, ahead) == (0, 0.0)
    assert back == pytest.approx(by, abs=2 * STEP / S)


@pytest.mark.parametrize('gone', [1, 120, 2000])
def test_what_is_lost_beside_a_pause_is_counted(gone):
    # Five seconds without a message, in which the stamps went on by what is gone and no more.
    kept, came = without((1000, 1000 + gone)), CAME + (np.arange(N) >= 1000 + gone) * 5.0
    assert seen(STAMPS[kept], came[kept])[0] == gone


@pytest.mark.parametrize('waiting', [1, 8, 60, 700])
def test_what_a_node_lost_that_stood_still_is_no_jump_of_a_clock(waiting):
    # It goes on with the few messages that still waited, and then with those of now.
    kept, came = without((500 + waiting, 2500)), CAME.copy()
    came[500:2500] = CAME[2500] - 1e-3 + np.arange(2000) * 1e-7
    missing, ahead, back = seen(STAMPS[kept], came[kept])
    assert (missing, ahead, back) == (2000 - waiting, 0.0, 0.0)


def gap_of(size, came_too=True, rush=1.0):
    """Return what is seen of one gap of so many steps between beats that come so much quicker."""
    stamps, came = STAMPS[:400].copy(), CAME[:400] * rush
    stamps[200:] += round((size - 1.0) * STEP)
    if came_too:
        came[200:] += (size - 1.0) * STEP / S
    return seen(stamps, came)


def test_the_numbers_decide_where_they_say():
    assert [gap_of(size)[0] for size in (GAP - 0.1, GAP + 0.1)] == [0, 1]
    silent = SILENT / (STEP / S)
    assert gap_of(silent - 5.0)[0] == pytest.approx(silent - 6.0, abs=1.0)
    assert gap_of(silent + 5.0)[0] == 0
    jump = JUMPED / (STEP / S)
    assert [gap_of(jump + d, came_too=False)[1] > 0.0 for d in (-5.0, 5.0)] == [False, True]
    assert gap_of(jump + 5.0, came_too=False, rush=RUSH * 0.9)[1] == 0.0
    assert gap_of(jump + 5.0, came_too=False, rush=RUSH * 1.1)[1] > 0.0
    anyhow = JUMPED_ANYHOW / (STEP / S)
    assert [gap_of(anyhow + d, False, 0.01)[1] > 0.0 for d in (-9.0, 9.0)] == [False, True]


def test_a_stream_off_the_beat_more_often_than_allowed_tells_nothing():
    off = 0.5 * (ON_BEAT + 0.5)
    for share, tells in ((1.0 - REGULAR - 0.04, True), (1.0 - REGULAR + 0.04, False)):
        steps = np.ones(N)
        steps[: round(share * N)] += off
        steps = RNG.permutation(steps)
        steps[2000] = 4.0
        stamps = S + np.cumsum(steps * STEP).astype(np.int64)
        assert (seen(stamps, stamps / S)[0] > 0) == tells


def watched(ahead=0.0, rate=0.0, pairs=True, seconds=12):
    """Return what is told, second by second, of one way that is stamped by two clocks."""
    watch, told, paired = ClockWatch(), [], 0
    for k in range(250 * seconds):
        t = k / 250
        place = np.array([0.1 * np.sin(0.9 * t), 0.05 * np.cos(1.7 * t), 0.0])
        watch.twin.add(S + round(t * S), place, t)
        if k % 5 == 0:
            watch.measured.add(S + round((t + ahead + rate * t) * S), place, t)
            paired += pairs
        if k % 250 == 249:
            told.append(watch.look(t, paired, 3, 1))
    return told


LATE = ', or every joint trails by as much'
UNMET = 'no measurement meets a pose of the twin: 3 wait, 1 are dropped'


@pytest.mark.parametrize(
    ('how', 'last'),
    [
        ({}, ''),
        ({'ahead': 0.05}, f'measurements are 0.050 s ahead of the joints{LATE}'),
        ({'ahead': -0.05}, 'measurements are 0.050 s behind the joints'),
        ({'ahead': 0.01}, ''),  # as servo loops trail
        ({'ahead': 0.7}, 'measurements are 0.70 s ahead of the joints'),
        ({'pairs': False}, UNMET),
        ({'pairs': False, 'ahead': -5.0}, f'{UNMET}; measurements are 5.0 s behind the joints'),
    ],
)
def test_two_clocks_are_told_apart_by_stamps_or_by_the_motion(how, last):
    told = watched(**how)
    assert told[-1] == last
    if how == {'pairs': False}:
        assert told == [''] * (round(UNPAIRED) + 1) + [UNMET] * (11 - round(UNPAIRED))


def test_a_clock_that_runs_faster_is_told_with_its_rate():
    told = watched(rate=3e-4, seconds=45)[-1]
    assert re.match(
        r'the clock of the measurements drifts by \+(29\d|30\d) ppm .*, \+\d\.\d ms in', told
    )
