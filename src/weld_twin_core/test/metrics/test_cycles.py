# Copyright 2026 weld_twin contributors
# SPDX-License-Identifier: Apache-2.0
"""Poses and paths that are repeated are found; ISO 9283 of them, and who conforms, are known by hand."""

import statistics

import numpy as np
import pytest

from weld_twin_core import DataError, JointMotion, Measurements, Recording, Robot
from weld_twin_core.metrics.circle import circle_of
from weld_twin_core.metrics.conformity import FAIL, OPEN, PASS, Rule
from weld_twin_core.metrics.performance import path_cycles, performance_of, pose_cycles, stops

TURNTABLE = Robot.from_mapping({'name': 'turntable', 'joints': [{'name': 'turn', 'a': 1.0}]})
"""One joint whose tool goes round at a metre."""
ANGLES = np.array([0.0, 0.5, 1.0])


def on_circle(q, radius=1.0):
    q = np.asarray(q)
    return np.stack([radius * np.cos(q), radius * np.sin(q), 0.0 * q], axis=-1)


def radial(q, off):
    """Return positions that lie off the circle by so much."""
    return on_circle(q, 1.0 + np.asarray(off))


def stations(order, offs):
    """Return stations at the angles numbered by `order`, each off by its own distance outwards."""
    q = ANGLES[order]
    t = 60.0 * np.arange(len(order))
    return Recording(
        'stations', JointMotion(t, q[:, None], static=True), Measurements(t, radial(q, offs))
    )


def there_and_back(offs, period=10.0, late=0.0, rest=0.0):
    """Return a motion from 0 to 1 rad and back, once for each radial offset, rests between."""
    part = np.arange(0.0, period, 0.01)
    pause = np.zeros(round(rest / 0.01))
    one = np.concatenate([pause, 0.5 - 0.5 * np.cos(2.0 * np.pi * part / period)])
    q = np.tile(one, len(offs))
    t = 0.01 * np.arange(q.size)
    measured_t = np.arange(0.004, t[-1], 0.017)
    measured_q = np.interp(measured_t, t, q)
    cycle = np.minimum((measured_t / (0.01 * one.size)).astype(int), len(offs) - 1)
    return Recording(
        'passes',
        JointMotion(t, q[:, None]),
        Measurements(measured_t + late, radial(measured_q, np.asarray(offs)[cycle])),
    )


def test_stations_are_grouped_by_their_command_and_know_where_the_arm_came_from():
    order = [0, 1, 2, 0, 2, 1, 0]
    found = pose_cycles(stops(stations(order, np.zeros(7))), TURNTABLE)
    assert [len(group.t) for group in found] == [3, 2, 2]
    assert [group.came_from for group in found] == [(-1, 2, 1), (0, 2), (1, 0)]
    np.testing.assert_allclose(found[1].command[:3, 3], on_circle(0.5), atol=1e-12)


def test_accuracy_and_repeatability_of_stations_by_hand():
    offs = np.array([1.0, 5.0, 3.0, 5.0, 5.0, 5.0]) * 1e-3
    found = performance_of(stations([0, 1, 0, 1, 0, 1], offs), TURNTABLE)
    first, second = (pose.performance for pose in found.poses)
    assert first.cycles == 3
    assert first.ap_m == pytest.approx(3e-3)
    assert first.rp_m == pytest.approx(
        statistics.mean([2e-3, 0.0, 2e-3]) + 3.0 * statistics.stdev([2e-3, 0.0, 2e-3])
    )
    assert second.ap_m == pytest.approx(5e-3)
    assert second.rp_m == pytest.approx(0.0, abs=1e-12)
    assert found.path is None
    assert 'stations at rest have no path' in found.lacking
    assert any('30' in text for text in found.lacking)


def test_what_a_joint_is_off_at_a_repetition_is_not_the_arms_fault():
    order, small = [0, 1, 0, 1], 4e-4
    recording = stations(order, np.zeros(4))
    q = np.array(recording.joints.q)
    q[2] += small
    moved = Measurements(recording.joints.t, on_circle(q[:, 0]))
    again = Recording('r', JointMotion(recording.joints.t, q, static=True), moved)
    first = performance_of(again, TURNTABLE).poses[0].performance
    assert first.cycles == 2
    assert max(first.ap_m, first.rp_m) < 1e-7


def test_lost_motion_shows_as_variation_between_ways_and_warming_as_drift():
    order = [1, 0, 1, 2] * 20
    offs = np.zeros(80)
    offs[2::4] = 1e-3  # from pose 0
    offs[4::4] = -1e-3  # from pose 2
    offs += 1e-5 * np.arange(80)
    middle = performance_of(stations(order, offs), TURNTABLE).poses[0]
    assert middle.approaches == 2
    # the two ways lie 2 mm apart, and two stations of warming lie between the middles of them
    assert middle.variation_m == pytest.approx(2e-3, abs=4e-5)
    assert middle.performance.cycles == 40
    # stations 0, 2, ... 18 lie at 9e-5 in the mean, and one more is beyond than behind; of the
    # last ten, at 69e-5, as many are beyond as behind
    assert middle.drift.dap_m == pytest.approx(69e-5 - (9e-5 + 1e-4))
    assert middle.hours == pytest.approx(78 * 60 / 3600)


def test_stops_of_a_motion_are_measured_after_they_settled():
    recording = there_and_back([1e-3, 3e-3, 2e-3], rest=2.0)
    found = performance_of(recording, TURNTABLE)
    assert [pose.performance.cycles for pose in found.poses] == [3]
    assert found.poses[0].performance.ap_m == pytest.approx(2e-3, abs=1e-8)
    np.testing.assert_allclose(found.poses[0].command, on_circle(0.0), atol=1e-12)


@pytest.mark.parametrize(('rest', 'whole'), [(0.0, False), (1.5, True)])
def test_a_path_that_was_passed_twice_after_a_way_to_it_is_repeated(rest, whole):
    """Where the arm rests at its start the path begins there, else at some place on it."""
    cycles = there_and_back([0.0, 0.0], rest=rest).joints
    q = np.concatenate([np.linspace(-0.8, 0.0, 300), cycles.q[:, 0]])
    motion = JointMotion(0.01 * np.arange(q.size), q[:, None])
    recording = Recording('twice', motion, Measurements(motion.t, on_circle(q)))
    found = path_cycles(recording, TURNTABLE)
    assert len(found.spans) == 2
    assert all((each.end - each.start > 9.0) is whole for each in found.spans)


@pytest.mark.parametrize('late', [0.0, 0.08])
@pytest.mark.parametrize('rest', [0.0, 1.5])
def test_path_accuracy_and_repeatability_are_what_was_put_in(late, rest):
    offs = [1e-3, 3e-3, 2e-3, 2e-3]
    found = performance_of(there_and_back(offs, late=late, rest=rest), TURNTABLE)
    path = found.path.performance
    distance = [abs(off - 2e-3) for off in offs]
    wanted = statistics.mean(distance) + 3.0 * statistics.stdev(distance)
    assert path.cycles == 4
    assert path.at_m == pytest.approx(2e-3, abs=2e-7)
    assert path.rt_m == pytest.approx(wanted, abs=1e-6)
    # there and back by one radian, but for the ends
    assert found.path.arc[-1] == pytest.approx(0.98 * 2.0, abs=0.01)
    # a cycle lasts from being 5 mrad off the start to being as near to it again
    assert found.path.seconds == pytest.approx(10.0 - 10.0 / np.pi * np.arccos(0.99), abs=0.03)


def test_the_way_to_the_start_and_a_stranger_in_between_do_not_count():
    cycles = there_and_back([0.0] * 3, rest=1.0).joints
    stranger = 0.3 * np.sin(np.linspace(0.0, np.pi, 300))
    q = np.concatenate(
        [np.linspace(-0.8, 0.0, 300), cycles.q[:2200, 0], stranger, cycles.q[2200:, 0]]
    )
    t = 0.01 * np.arange(q.size)
    begins = np.array([4.0, 15.0, 29.0])
    measured_t = t[:-1] + 0.003
    offs = np.array([9e-3, 1e-3, 3e-3, 5e-3])[np.searchsorted(begins - 0.5, measured_t)]
    offs[(measured_t > 24.8) & (measured_t < 28.2)] = 9e-3
    recording = Recording(
        'approach',
        JointMotion(t, q[:, None]),
        Measurements(measured_t, radial(np.interp(measured_t, t, q), offs)),
    )
    found = path_cycles(recording, TURNTABLE)
    assert len(found.spans) == 3
    np.testing.assert_allclose([s.start for s in found.spans], begins, atol=0.3)
    away = np.linalg.norm(found.crossed - found.command, axis=-1)
    np.testing.assert_allclose(
        away, np.outer([1e-3, 3e-3, 5e-3], np.ones(away.shape[1])), atol=1e-6
    )


def test_a_gap_in_the_measurements_is_not_bridged():
    recording = there_and_back([0.0, 0.0, 1e-3])
    measured = recording.measured
    lost = (measured.t > 12.0) & (measured.t < 14.5)
    whole, holey = (
        path_cycles(r, TURNTABLE)
        for r in (recording, recording.with_measured(measured.take(~lost)))
    )
    assert holey.arc.size < whole.arc.size
    away = np.linalg.norm(holey.crossed - holey.command, axis=-1)
    assert away.max() < 1e-3 + 1e-5


@pytest.mark.parametrize(
    ('recording', 'said'),
    [
        (stations([0, 1, 2], np.zeros(3)), 'no pose was measured twice, 3 different ones'),
        (there_and_back([0.0]), 'the motion does not go the same way twice'),
        (
            Recording('none', JointMotion([0.0, 1.0], np.zeros((2, 1)))),
            'none holds no measured poses or points',
        ),
    ],
)
def test_what_is_missing_is_said_in_a_sentence(recording, said):
    with pytest.raises(DataError, match=said):
        performance_of(recording, TURNTABLE)


@pytest.mark.parametrize(
    ('size', 'verdict'), [(0.83e-3, PASS), (0.84e-3, OPEN), (1.16e-3, OPEN), (1.17e-3, FAIL)]
)
def test_one_reading_is_judged_with_1_645_standard_uncertainties(size, verdict):
    assert Rule(1e-3, 1e-4).judged(size) == verdict


def test_without_a_tolerance_nothing_is_judged():
    assert Rule(None, 1e-4).judged(5.0) is None


@pytest.mark.parametrize('count', [1, 30, 1000])
def test_a_robot_right_at_its_tolerance_seldom_fails_however_many_readings(count):
    rng = np.random.default_rng(2)
    rule = Rule(1e-3, 5e-5, count)
    largest = (1e-3 + rng.normal(0.0, 5e-5, (4000, count))).max(axis=1)
    wrong = np.mean([rule.judged(float(v)) == FAIL for v in largest])
    assert wrong == pytest.approx(0.05, abs=0.012)


def test_a_circle_is_found_where_it_was_put():
    turn = np.linspace(0.0, 2.0 * np.pi, 200)
    across, up = np.array([0.6, 0.8, 0.0]), np.array([0.0, 0.0, 1.0])
    points = [0.4, 0.1, 0.2] + 0.07 * (np.outer(np.cos(turn), across) + np.outer(np.sin(turn), up))
    found = circle_of(points)
    assert found is not None
    assert found.centre == pytest.approx([0.4, 0.1, 0.2])
    assert found.radius == pytest.approx(0.07)
    assert np.allclose(found.outwards(points), (points - found.centre) / 0.07)


def test_half_a_circle_and_a_line_are_none():
    turn = np.linspace(0.0, np.pi, 200)
    half = np.column_stack([np.cos(turn), np.sin(turn), 0 * turn])
    assert circle_of(half) is None
    assert circle_of(np.column_stack([turn, 2 * turn, 0 * turn])) is None
