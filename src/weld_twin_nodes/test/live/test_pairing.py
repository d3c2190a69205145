# Copyright 2026 weld_twin contributors
# SPDX-License-Identifier: Apache-2.0
"""Pairing by stamp, against curves whose value between samples is known."""

import time
from contextlib import suppress

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st

from weld_twin_core import DataError, deviation_metrics, load
from weld_twin_core.metrics.deviation import RunningMetrics
from weld_twin_msgs_py.assembly.intake import RESTART_AFTER, Forward
from weld_twin_msgs_py.messages import from_messages
from weld_twin_msgs_py.messages.topics import MEASURED_POSE, TWIN_BASE, TWIN_POSE
from weld_twin_nodes.live.deviation_analyzer import DeviationAnalyzer
from weld_twin_nodes.streams.deviation_stream import Deviations, Pairing

MS = 1_000_000


def parabola(ns):
    t = ns * 1e-9
    return np.array([1.0 + t, -2.0 * t * t, 3.0 - t + 0.5 * t * t])


def paired(twin_ns, measured_ns, **options):
    pairing = Pairing(**options)
    out = []
    for ns in measured_ns:
        out += pairing.add_measured(ns, np.zeros(3))
    for ns in twin_ns:
        out += pairing.add_twin(ns, parabola(ns))
    return pairing, out


@given(st.integers(500 * MS, 775 * MS))
def test_a_parabola_is_interpolated_exactly_between_uneven_stamps(ns):
    _, pairs = paired([175 * MS, 500 * MS, 775 * MS], [ns])
    np.testing.assert_allclose(pairs[0].twin, parabola(ns), rtol=0.0, atol=1e-14)


def test_between_the_first_two_poses_the_twin_is_taken_as_straight():
    _, pairs = paired([10 * MS, 20 * MS], [15 * MS])
    middle = 0.5 * (parabola(10 * MS) + parabola(20 * MS))
    np.testing.assert_allclose(pairs[0].twin, middle, rtol=0.0, atol=1e-15)


def test_a_measurement_waits_until_the_twin_has_passed_it():
    pairing = Pairing()
    pairing.add_twin(10 * MS, parabola(10 * MS))
    assert pairing.add_measured(15 * MS, np.zeros(3)) == []
    assert pairing.waiting == 1
    assert len(pairing.add_twin(20 * MS, parabola(20 * MS))) == 1
    assert (pairing.waiting, pairing.dropped) == (0, 0)


@pytest.mark.parametrize(
    ('twin', 'measured', 'apart'),
    [
        ([10, 20], [5], [5]),  # before the first pose
        ([10, 900], [400], [400]),  # in a gap of the twin
        ([0, 1, 2, 302], [150], [150]),  # at the start, too
        ([k for k in range(200) if not 100 <= k < 120], range(20, 190), range(100, 120)),
    ],
)
def test_nothing_is_interpolated_where_the_twin_has_no_samples_and_that_is_counted(
    twin, measured, apart
):
    pairing, pairs = paired([ns * MS for ns in twin], [ns * MS for ns in measured])
    assert {pair.stamp // MS for pair in pairs} == set(measured) - set(apart)
    assert pairing.dropped == len(apart)


def test_what_was_before_a_break_does_not_bend_what_comes_after():
    before, after = [10 * MS * k for k in range(20)], [600 * MS + 10 * MS * k for k in range(5)]
    pairing, ns = Pairing(), 605 * MS
    for stamp in before:
        pairing.add_twin(stamp, parabola(stamp))
    for stamp in after:
        pairing.add_twin(stamp, parabola(stamp) + 0.5)
    (pair,) = pairing.add_measured(ns, np.zeros(3))
    straight = 0.5 * (parabola(600 * MS) + parabola(610 * MS)) + 0.5
    np.testing.assert_allclose(pair.twin, straight, rtol=0.0, atol=1e-15)


@pytest.mark.parametrize('burst', [[1, 9], [1, 1, 20], [1, 1, 1, 1, 20]])
def test_a_twin_that_comes_in_bursts_is_interpolated(burst):
    twin = np.cumsum(np.tile(burst, 60)) * MS
    measured = twin[20:-1] + MS // 2
    pairing, pairs = paired([int(ns) for ns in twin], [int(ns) for ns in measured])
    assert (len(pairs), pairing.dropped) == (measured.size, 0)


def test_a_single_lost_sample_is_interpolated():
    _, pairs = paired([k * MS for k in range(40) if k != 30], [30 * MS])
    np.testing.assert_allclose(pairs[0].twin, parabola(30 * MS), rtol=0.0, atol=1e-14)


def test_a_twin_that_has_become_slower_is_interpolated_again_soon():
    slow = [100 * MS + 50 * MS * k for k in range(40)]
    measured = [ns + 20 * MS for ns in slow[:-1]]
    pairing, pairs = paired([*(k * MS for k in range(100)), *slow], measured)
    assert 0 < pairing.dropped < 10
    assert pairing.dropped + len(pairs) == len(measured)


def test_the_buffer_is_bounded_and_what_falls_out_is_counted():
    pairing = Pairing(depth=5)
    for k in range(1, 9):
        pairing.add_measured(k * MS, np.zeros(3))
    assert (pairing.waiting, pairing.dropped) == (5, 3)


def test_order_of_arrival_does_not_change_the_pairs():
    twin, measured = range(10, 200, 10), range(13, 190, 7)
    _, first = paired([k * MS for k in twin], [k * MS for k in measured])
    pairing, second = Pairing(), []
    events = sorted([(k, 0) for k in twin] + [(k, 1) for k in measured])
    for k, is_measured in events:
        add = pairing.add_measured if is_measured else pairing.add_twin
        second += add(k * MS, np.zeros(3) if is_measured else parabola(k * MS))
    assert [p.stamp for p in first] == [p.stamp for p in second]
    for one, other in zip(first, second, strict=True):
        np.testing.assert_array_equal(one.twin, other.twin)


def test_one_stamp_that_goes_back_is_refused_and_the_next_good_one_taken():
    order = Forward()
    assert not order.restarted_at(100)
    with pytest.raises(DataError, match='not after the last one'):
        order.restarted_at(50)
    assert not order.restarted_at(101)


def test_a_stream_that_starts_again_is_believed_after_a_few_stamps():
    order = Forward()
    order.restarted_at(10**9)
    for k in range(1, RESTART_AFTER):
        with pytest.raises(DataError):
            order.restarted_at(k)
    assert order.restarted_at(RESTART_AFTER)
    assert not order.restarted_at(RESTART_AFTER + 1)


def test_measurements_that_a_new_start_leaves_unpaired_are_counted():
    pairing = Pairing()
    for k in range(3):
        pairing.add_measured(10**9 + k * MS, np.zeros(3))
    for k in range(1, RESTART_AFTER + 1):
        with suppress(DataError):
            pairing.add_measured(k * MS, np.zeros(3))
    assert (pairing.waiting, pairing.dropped) == (1, 3)


def test_metrics_begin_anew_where_the_twin_does():
    told = Deviations(load('ur5'))
    far, near = np.array([1e-3, 0.0, 0.0]), np.array([1e-4, 0.0, 0.0])

    def run(start, off):
        for k in range(1, 2 * RESTART_AFTER):
            with suppress(DataError):
                list(told.add_twin(start + 10 * k * MS, np.zeros(3)))
            with suppress(DataError):
                list(told.add_measured(start + 10 * k * MS, off))

    run(10**12, far)
    assert told.metrics()['max'] == pytest.approx(1e-3)
    run(0, near)
    assert told.metrics()['max'] == pytest.approx(1e-4)
    assert 0 < told.samples <= RESTART_AFTER


def test_the_last_metrics_of_a_run_are_told_once(cell):
    cell.add(DeviationAnalyzer, reliable_inputs=True, metrics_idle=0.05)
    metrics, base = cell.collect('/deviation/metrics'), cell.publisher(TWIN_BASE)
    each = cell.publisher(TWIN_POSE), cell.publisher(MEASURED_POSE)
    base.publish(cell.messages.pose(1, np.zeros(3), np.eye(3)))
    for k in range(1, 4):
        for out in each:
            out.publish(cell.messages.pose(k * 10 * MS, np.zeros(3), np.eye(3)))
    cell.wait(
        lambda: len(metrics) > 0 and from_messages.metrics(metrics.last)['samples'] == 3,
        'the last metrics',
    )
    count, end = len(metrics), time.monotonic() + 0.4
    cell.wait(lambda: time.monotonic() > end, 'some more looks')
    assert len(metrics) == count


def test_running_metrics_are_those_of_the_whole_run():
    rng = np.random.default_rng(3)
    twin = np.cumsum(rng.normal(scale=1e-3, size=(200, 3)), axis=0)
    off = rng.normal(scale=2e-4, size=(200, 3))
    running = RunningMetrics()
    for vector, position in zip(off, twin, strict=True):
        running.add(vector, position)
    w, told = deviation_metrics(twin + off, twin), running.as_dict()
    keys = ('RMS', 'mean', 'max', 'D_norm', 'D_cum', 'samples', 'path_length')
    whole = (w.rms_m, w.mean_m, w.max_m, w.d_norm, w.d_cum_m, 200, w.path_length_m)
    np.testing.assert_allclose([told[key] for key in keys], whole, rtol=1e-10)
    assert told['D(t)'] == pytest.approx(np.linalg.norm(off[-1]))


def test_after_a_jump_of_the_clock_the_tail_of_the_run_before_is_told_by_its_stamps():
    order = Forward()
    for stamp in (10, 20, 30):
        assert not order.restarted_at(stamp)
    order.reset()
    with pytest.raises(DataError, match='before the clock jumped'):
        order.restarted_at(40)
    assert not order.restarted_at(10)
    assert not order.restarted_at(40)
    order.reset()
    refused = 0
    for stamp in range(50, 50 + RESTART_AFTER):
        try:
            order.restarted_at(stamp)
        except DataError:
            refused += 1
    assert refused == RESTART_AFTER - 1
