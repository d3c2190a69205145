# Copyright 2026 weld_twin contributors
# SPDX-License-Identifier: Apache-2.0
"""What the checks of data stand on, each held against what can be said of it by hand."""

from dataclasses import replace
from types import SimpleNamespace

import numpy as np
import pytest
from measured_cells import asked, moving, recorded, rejointed, stations

from weld_twin_core import DataError, JointMotion, Recording, load
from weld_twin_core.cameras.sightings import Fitted
from weld_twin_core.diagnosis.algebra.definite import outside, span_of
from weld_twin_core.diagnosis.result import Site
from weld_twin_core.diagnosis.soundness.computed import _gap
from weld_twin_core.diagnosis.soundness.efforts import compared, efforts, with_sign
from weld_twin_core.diagnosis.soundness.evidence import Case, _believed
from weld_twin_core.diagnosis.soundness.gate import Examined, _gave_way
from weld_twin_core.diagnosis.soundness.images import _undone
from weld_twin_core.diagnosis.soundness.lag import Lag, lag
from weld_twin_core.diagnosis.soundness.lengths import instant, length, listed
from weld_twin_core.diagnosis.soundness.mending import Given, as_entry
from weld_twin_core.diagnosis.soundness.richness import (
    _apart,
    _common,
    motion,
    refuse_reused,
    repeats,
)
from weld_twin_core.diagnosis.soundness.slips import Rest, Settling, Slip, changes, rest_of
from weld_twin_core.diagnosis.soundness.snapshot import FRAMES, Snapshot
from weld_twin_core.diagnosis.soundness.stamps import _stream, clocks, written
from weld_twin_core.diagnosis.soundness.stuck import _inside
from weld_twin_core.diagnosis.soundness.suspicions import doubles, suspicions, turned_bases
from weld_twin_core.diagnosis.soundness.touches import _moved_run
from weld_twin_core.effects.dated import InstrumentKnock, JointSlip, ToolSlip
from weld_twin_core.twin.features import with_expected_effort

ELBOW = np.array([1.0, 1.0, np.degrees(1.0), 1.0, 1.0, 1.0])
"""Columns of joints, the elbow's in degrees."""


@pytest.fixture
def still(ur5, rng):
    return recorded(ur5, stations(ur5, rng, 40), rng, points=True)


# The table of mix-ups ---------------------------------------------------------------------------


def test_every_suspicion_is_another_one_and_changes_what_it_says(ur5, still):
    every = [*suspicions(ur5), *doubles(ur5), *turned_bases()]
    # The alphabet of this arm is one swap, and told as such.
    other = [each for each in every if 'alphabetical' not in each.sentence]
    assert len({str(as_entry(each.mend)) for each in other}) == len(other) == len(every) - 1
    given = Given((still,), ur5, FRAMES)
    for each in every:
        made = each.mend(given)
        q, seen = made.recordings[0].joints.q, made.recordings[0].seen.position
        same = np.array_equal(q, still.joints.q)
        joints = {'joints_swapped', 'coupled_axes', 'constant_angle'}
        assert same != (
            each.kind in joints or (each.kind != 'base_turned' and each.at[0] in ur5.joint_names)
        )
        if each.kind == 'other_robot':
            assert made.robot.name in each.sentence and made.robot.n == ur5.n
        if each.at == ('instrument',) and each.kind != 'camera_inverted':
            assert not np.array_equal(seen, still.seen.position)


@pytest.mark.parametrize(
    ('words', 'spoil'),
    [
        ('joint positions are in degrees', lambda q: np.degrees(q)),
        ("joint 'elbow_joint' is in degrees where", lambda q: q * ELBOW),
        ("joint 'elbow_joint' is in degrees, the others", lambda q: np.radians(q) * ELBOW),
        ("joint 'elbow_joint' counts the other", lambda q: q * [1, 1, -1, 1, 1, 1]),
        ('all joints count the other way', lambda q: -q),
        ("'elbow_joint' and 'wrist_3_joint' are swapped", lambda q: q[:, [0, 1, 5, 3, 4, 2]]),
        ('in reverse order', lambda q: q[:, ::-1]),
        ('in alphabetical order', lambda q: q[:, [2, 1, 0, 3, 4, 5]]),
        ("'elbow_joint' lies +90 degrees", lambda q: q - [0, 0, np.pi / 2, 0, 0, 0]),
        ("'elbow_joint' lies +180 degrees", lambda q: q - [0, 0, np.pi, 0, 0, 0]),
    ],
)  # fmt: skip
def test_what_a_suspicion_says_of_joints_is_what_it_undoes(ur5, still, words, spoil):
    fitting = [each for each in suspicions(ur5) if words in each.sentence]
    bad = Given((rejointed(still, spoil(still.joints.q)),), ur5, FRAMES)
    undone = [each.mend(bad).recordings[0].joints.q for each in fitting]
    assert any(np.allclose(q, still.joints.q, atol=1e-12) for q in undone)


@pytest.mark.parametrize(
    ('words', 'factor'),
    [
        ('measured positions are in millimetres', 1e3),
        ('measured positions are in inches', 1.0 / 0.0254),
        ('y of the measured positions is in millimetres where', [1.0, 1e3, 1.0]),
        ('y of the measured positions is in millimetres, the others', [1e-3, 1.0, 1e-3]),
    ],
)
def test_what_a_suspicion_says_of_positions_is_what_it_undoes(ur5, still, words, factor):
    (fitting,) = (each for each in suspicions(ur5) if words in each.sentence)
    position = still.measured.position
    bad = still.with_measured(replace(still.measured, position=position * factor))
    (undone,) = fitting.mend(Given((bad,), ur5, FRAMES)).recordings
    np.testing.assert_allclose(undone.measured.position, position, atol=1e-12)


def test_joint_3_counted_against_the_ground_is_put_right_either_way(ur5, still):
    for sign, word in ((1.0, 'Add'), (-1.0, 'Subtract')):
        bad = np.array(still.joints.q)
        bad[:, 2] -= sign * bad[:, 1]
        (each,) = (s for s in suspicions(ur5) if s.kind == 'coupled_axes' and word in s.remedy)
        (made,) = each.mend(Given((rejointed(still, bad),), ur5, FRAMES)).recordings
        np.testing.assert_allclose(made.joints.q, still.joints.q, atol=1e-12)


def test_joints_that_slide_are_told_in_lengths_and_turn_by_no_quarter(still):
    robot = load('ur5')
    track = replace(robot, prismatic=np.arange(robot.n) == 0)
    own = [s for s in suspicions(track) if s.at == (robot.joint_names[0],)]
    assert {s.kind for s in own} == {'units', 'sign'}
    assert any('millimetres' in s.sentence for s in own) and not any(
        'degrees' in s.sentence for s in own
    )
    for each in suspicions(track):
        if 'degrees' in each.sentence:  # of the joints that turn
            (made,) = each.mend(Given((still,), track, FRAMES)).recordings
            np.testing.assert_array_equal(made.joints.q[:, 0], still.joints.q[:, 0])


def test_a_base_stands_turned_in_three_and_twenty_ways(ur5):
    turns = [each.mend(Given((), ur5)).robot.T_world_base[:3, :3] for each in turned_bases()]
    assert len(turns) == 23 and all(np.linalg.det(turn) > 0.999 for turn in turns)
    about_z = [each for each in turned_bases() if 'about its z axis' in each.sentence]
    assert sorted(each.sentence.split(' degrees')[0].split()[-1] for each in about_z) == [
        '-90',
        '180',
        '90',
    ]


@pytest.mark.parametrize('off', [0.4, 0.6])
def test_frames_are_off_in_units_of_what_a_cause_may_be(ur5, rng, off):
    """Half a metre, or a fifth of a radian, of the base; a tenth of a metre of the tool."""
    for turn, most in ((0.0, 0.5), (0.5 * off, 0.2)):
        base = np.eye(4)
        base[:2, :2] = [[np.cos(turn), -np.sin(turn)], [np.sin(turn), np.cos(turn)]]
        base[0, 3] = 0.0 if turn else off
        seen = recorded(ur5.with_frames(base=ur5.T_world_base @ base), stations(ur5, rng, 40), rng)
        shot = Snapshot((seen,), asked(ur5, seen, align=())[1], frozenset())
        assert shot.arm.displaced == pytest.approx((turn or off) / most, rel=0.1)
        assert shot.arm.bent < 1.0 and shot.arm.off == max(shot.arm.bent, shot.arm.displaced)
        free = replace(shot, align=FRAMES)
        assert free.arm.displaced == 0.0 and free.remaining < 1e-3 < shot.remaining


# Snapshots --------------------------------------------------------------------------------------


def test_whatever_is_shrunk_must_leave_less_for_its_size(ur5, still):
    _, model = asked(ur5, still)
    shot = Snapshot((still,), model)
    small = Snapshot(
        (still.with_measured(replace(still.measured, position=1e-3 * still.seen.position)),), model
    )
    assert (shot.collapsed, shot.shrunk(shot)) == (1.0, 1.0)
    assert small.shrunk(shot) == pytest.approx(1e3) and shot.shrunk(small) == 1.0
    assert small.collapsed > 50.0


def test_readings_far_beyond_a_joints_range_are_not_possible(ur5, still):
    _, model = asked(ur5, still)
    turn = ur5.upper[0] + np.array([0.9, 1.1])
    for more, possible in zip(turn, (True, False), strict=True):
        q = np.array(still.joints.q)
        q[3, 0] = more
        assert Snapshot((rejointed(still, q),), model).possible is possible


# Readings that stand still ----------------------------------------------------------------------


def test_after_a_stop_an_arm_settles_and_at_a_station_it_has(ur5, rng):
    run = recorded(ur5, moving(ur5, rng), rng)
    t = run.joints.t
    inside = _inside(run, 100, 200)
    assert run.seen.t[inside].min() >= t[100] + 0.2 and run.seen.t[inside].max() <= t[199]
    still = replace(run, joints=replace(run.joints, static=True, qd=None))
    assert run.seen.t[_inside(still, 100, 200)].min() == pytest.approx(t[100], abs=0.02)


# Clocks -----------------------------------------------------------------------------------------


def test_of_lags_that_explain_as_much_the_nearest_is_told(rng):
    """A motion that comes round again every two seconds is late by a little, not by a round more."""

    def round_and_round(t):
        return np.stack([np.sin(np.pi * t), np.cos(2.0 * np.pi * t), np.zeros(t.size)], axis=1)

    joints, t = np.linspace(0.0, 40.0, 4001), np.linspace(3.0, 37.0, 1500)
    seen = round_and_round(t - 0.3) + rng.normal(scale=1e-2, size=(t.size, 3))
    found = lag(joints, round_and_round(joints), t, seen)
    assert found.late == pytest.approx(0.3, abs=1e-2) and found.rate == 0.0


def test_too_few_samples_tell_no_lag():
    t = np.linspace(0.0, 10.0, 19)
    wave = np.sin(np.outer(t, [6.0, 5.0, 1.3]))
    assert lag(t, wave, t, wave) is None


@pytest.mark.parametrize(('digits', 'step'), [(2, 1e-2), (3, 1e-3), (6, 1e-6), (9, 0.0)])
def test_the_digits_that_were_written_are_seen(rng, digits, step):
    assert written(np.round(rng.uniform(0.0, 10.0, 50), digits)) == pytest.approx(step)


def told(t):
    return [(found.level, found.sentence) for found in _stream(t, 'They')]


def test_what_is_said_of_stamps_is_what_they_are(rng):
    t = 0.02 * np.arange(500.0)
    assert not told(t)
    lost = np.delete(t, np.arange(100, 110))
    ((level, words),) = told(lost)
    assert (
        level == 'note'
        and '1 gap(s), the longest 0.22 s at t = 1.98 s; about 10 messages' in words
    )
    half = np.delete(t, np.arange(100, 300))
    assert told(half)[0][0] == 'warning'
    for start in (0.0, 0.123456):
        rounded = start + np.round(np.arange(500.0) / 60.0, 2)
        assert 'in whole 10 ms' in told(rounded)[0][1]
    assert 'give or take' in told(t + rng.uniform(0.0, 0.015, t.size))[0][1]


# Repeats and strays -----------------------------------------------------------------------------


def test_rows_in_common_are_equal_to_the_last_digit(rng):
    first = rng.normal(size=(30, 3))
    second = np.concatenate([first[:7], first[7:9] + 1e-12, rng.normal(size=(5, 3))])
    assert _common(first, second) == 7


@pytest.mark.parametrize(('shared', 'refused'), [(6, False), (12, True)])
def test_what_is_judged_on_may_share_a_few_readings_of_a_coarse_instrument(
    ur5, rng, shared, refused
):
    one = recorded(ur5, stations(ur5, rng, 40), rng, points=True)
    other = recorded(ur5, stations(ur5, rng, 40), rng, points=True, name='other')
    position = np.array(other.seen.position)
    position[:shared] = one.seen.position[:shared]
    held = other.with_measured(replace(other.measured, position=position))
    if refused:
        with pytest.raises(DataError, match=f'holds {shared} of its 40'):
            refuse_reused([one], [held])
    else:
        refuse_reused([one], [held])


def test_a_stray_is_far_from_its_neighbours_and_a_step_is_none(rng):
    position = 2e-5 * rng.standard_normal((3, 300))
    assert not _apart(position).any()
    position[:, 150:] += 5e-3
    assert not _apart(position).any()
    position[1, 80] += 9e-3
    assert np.flatnonzero(_apart(position)).tolist() == [80]
    assert _apart(position)[80] == pytest.approx(9e-3, rel=0.02)


def test_places_that_moved_are_found_in_a_row_and_the_shorter_part_is_told(rng):
    points = 1e-5 * rng.standard_normal((30, 3))
    points[8:20] += [1e-3, 0.0, 0.0]
    first, last, shift, explained = _moved_run(points)
    assert (first, last) == (8, 20) and explained > 0.99
    assert shift == pytest.approx(1e-3, rel=0.02)
    points[:] = 1e-5 * rng.standard_normal((30, 3))
    points[:22] += [0.0, 2e-3, 0.0]
    assert _moved_run(points)[:2] == (22, 30)


# Motion -----------------------------------------------------------------------------------------


def test_a_joint_that_goes_back_a_little_has_reversed(ur5, rng):
    t = np.linspace(0.0, 10.0, 400)
    q = np.tile(moving(ur5, rng).q[0], (400, 1)) + np.linspace(0.0, 0.5, 400)[:, None]
    q[300:, 2] = q[300, 2] - 0.05 * (t[300:] - t[300])
    run = recorded(ur5, JointMotion(t, q), rng)
    problem, model = asked(ur5, run, align=())
    case = SimpleNamespace(problem=problem, model=model, recordings=(run,), motions=[q])
    (one_way,) = (f.sentence for f in motion(case) if 'never' in f.sentence)
    assert "'elbow_joint'" not in one_way and "'wrist_1_joint'" in one_way
    assert "and 'wrist_3_joint' never reverse; " in one_way
    q[300:] = q[300] - 0.05 * (t[300:] - t[300])[:, None] * [1, 1, 1, 1, 1, 0]
    (one_way,) = (f.sentence for f in motion(case) if 'never' in f.sentence)
    assert one_way.startswith("'wrist_3_joint' never reverses; ")


@pytest.mark.parametrize(
    ('value', 'words'),
    [(2.5, '2.5 m'), (0.0123456, '12.3 mm'), (4.2e-5, '0.042 mm'), (1e-8, 'less than 0.001 mm')],
)
def test_lengths_are_told_as_fine_as_instruments_are(value, words):
    assert length(value) == words


def test_an_instant_is_a_station_or_a_time(still):
    assert instant(still, 0.5 * (still.seen.t[11] + still.seen.t[12])) == 'station 12 of 40'
    run = replace(still, joints=replace(still.joints, static=False))
    assert instant(run, 1.25) == 't = 1.25 s'


# Changes in time --------------------------------------------------------------------------------


def test_a_change_explains_what_was_put_in_and_nothing_once_it_is_taken_out(ur5, rng):
    run = recorded(ur5, stations(ur5, rng, 80), rng, points=True)
    problem, model = asked(ur5, run, align=())
    after = (np.arange(80) >= 50).astype(float)
    part = problem.residuals(model)[0] + 1e-3 * np.array([[1.0], [-1.0], [0.5]]) * after
    rest = rest_of([part], problem, model)
    base, no_other = rest.change('base'), np.zeros(80, dtype=bool)
    assert int(base.step_gains(0, no_other).argmax()) == 50
    shapes = np.array([np.arange(80) >= k for k in (20, 50, 70)], dtype=float)
    np.testing.assert_allclose(
        base.gains(shapes), base.step_gains(0, no_other)[[20, 50, 70]], rtol=1e-6
    )
    assert base.size(after) == pytest.approx(1.5e-3, rel=0.05)
    assert base.log_bayes_factor(after) > 50.0
    left = base.taken_out(after)
    assert left.change('base').gains(after[None])[0] < 1e-6 * base.gains(after[None])[0]
    assert left.far < 0.2 * rest.far and left.rms(0) < rest.rms(0)


def test_a_change_takes_off_what_least_squares_do_beside_frames_and_arm():
    """Of a recording of poses and one of points; what is sure of it counts every part by its rows."""
    rng, samples, rows = np.random.default_rng(9), (40, 10), (6, 3)
    there = np.arange(6) < np.repeat(rows, samples)[:, None]
    basis = span_of((rng.normal(size=(4, 50, 6)) * there).reshape(4, -1))
    given = outside((rng.normal(size=(50, 6)) * there).reshape(1, -1), basis)
    columns, metres = rng.normal(size=(50, 6, 2)) * there[..., None], rng.normal(size=(50, 3, 2))
    rest = Rest(given.reshape(50, 6), basis, {'base': (columns, metres)}, rows, samples, 1e-4)
    change, steps = rest.change('base'), np.arange(50) >= np.arange(40, 50)[:, None]
    np.testing.assert_allclose(
        change.step_gains(1, steps[0] & False), change.gains(steps * 1.0), rtol=1e-9
    )
    for shape in (rng.uniform(0.0, 1.0, 50), steps[4] * 1.0):
        every = np.concatenate([basis.T, (columns * shape[:, None, None]).reshape(300, 2)], axis=1)
        step = np.linalg.lstsq(every, given[0], rcond=None)[0]
        left = (given[0] - every @ step).reshape(50, 6)
        gain = (given**2).sum() - (left**2).sum()
        assert change.gains(shape[None]) == pytest.approx([gain], rel=1e-4)
        after = change.taken_out(shape)
        np.testing.assert_allclose(after.residual, left, atol=1e-9)
        moved = metres[shape > 0.05 * shape.max()] @ step[-2:]
        assert change.size(shape) == pytest.approx(
            np.sqrt((moved**2).sum(axis=1).mean()), rel=1e-4
        )
        counts = after.share * (1.0 - 6.0 / 270.0) * np.array([150.0, 150.0])
        falls = [
            np.log((rest.residual[:, k] ** 2).sum() / (left[:, k] ** 2).sum())
            for k in (slice(3), slice(3, 6))
        ]
        expected = (counts @ falls - 2.0 * np.log(counts.sum())) / 2.0
        assert change.log_bayes_factor(shape) == pytest.approx(expected, rel=1e-6)
        assert after.far == pytest.approx((left[:, :3] ** 2).sum())
    # All but the worst fifth of a recording.
    off = np.sort((rest.residual[40:, :3] ** 2).sum(axis=1))[:8]
    assert rest.rms(1) == pytest.approx(1e-4 * np.sqrt(off.mean()))


def test_constant_errors_of_an_arm_leave_nothing_that_changed(ur5, rng):
    run = recorded(ur5, stations(ur5, rng, 80), rng, points=True)
    problem, model = asked(ur5, run, align=())
    (maker,) = problem.features(model)
    off = 2e-3 * maker.column(('q', 2))[:3] + 1e-3 * maker.column(('a', 1))[:3]
    both = rest_of([problem.residuals(model)[0] + off], problem, model)
    alone = rest_of([problem.residuals(model)[0]], problem, model)
    assert both.rms(0) < 1.2 * alone.rms(0)


SIDE = np.array([[1.0], [-1.0], [0.5]])
"""Direction of a change of the set-up."""


def changed(ur5, *runs, by, align=('tool',), largest=0.01):
    """Return what is found of runs whose first points are moved by (M,) lengths along `SIDE` [m]."""
    problem, model = asked(ur5, *runs, align=align)
    parts = problem.residuals(model)
    parts[0] = parts[0] + SIDE * by
    return changes(problem, rest_of(parts, problem, model), ur5.joint_names, largest)


def test_a_step_is_one_where_nothing_smooth_does_as_well(ur5, rng):
    run = recorded(ur5, stations(ur5, rng, 80), rng, points=True)
    age = np.arange(80.0)
    (step,) = changed(ur5, run, by=1e-3 * (age >= 50), align=())
    assert isinstance(step.effect, InstrumentKnock) and step.effect.time == 49.5 and step.dated
    assert step.size == pytest.approx(1.5e-3, rel=0.05)
    (warm,) = changed(ur5, run, by=1e-3 * np.exp(-age / 15.0), align=())
    assert isinstance(warm, Settling) and warm.time_constant == pytest.approx(15.0, rel=0.15)
    assert not changed(ur5, run, by=1e-3 * age / 80.0, align=())
    assert not changed(ur5, run, by=0.0 * age, align=())


def test_a_step_is_dated_beside_strays_that_are_larger(ur5):
    alone = 0
    for seed in range(12):
        rng = np.random.default_rng(seed)
        run = recorded(ur5, stations(ur5, rng, 62), rng, points=True)
        step = 4e-4 * (np.arange(62) >= 21)
        step[[18, 40, 61]] += [3e-3, -3e-3, 2e-3]
        found = changed(ur5, run, by=step, align=())
        assert all(isinstance(one.effect, InstrumentKnock) for one in found)
        assert 20.5 in [one.effect.time for one in found]
        # Beside a stray there may be another, which the search has to refuse.
        if len(found) == 1:
            alone += 1
            assert found[0].size == pytest.approx(6e-4, rel=0.15)
        strays = np.where(np.abs(step) > 1e-3, step, 0.0)
        assert not changed(ur5, run, by=strays, align=())
    assert alone >= 10


@pytest.mark.parametrize(('times', 'dated'), [(2.3, True), (2.7, False)])
def test_a_step_far_larger_than_the_largest_gaps_is_no_cause(ur5, rng, times, dated):
    run = recorded(ur5, stations(ur5, rng, 80), rng, points=True)
    step = 1e-3 * (np.arange(80) >= 50)
    (found,) = changed(ur5, run, by=step, align=(), largest=1.5e-3 / times)
    assert found.dated is dated


def test_what_moved_before_a_recording_is_no_step_in_one(ur5, rng):
    runs = [recorded(ur5, stations(ur5, rng, 50), rng, points=True, name=n) for n in 'ab']
    (moved,) = changed(ur5, *runs, by=np.full(50, 1e-3))
    assert isinstance(moved, Slip) and (moved.recording, moved.effect.time) == (1, 0.0)
    assert not moved.dated
    assert not changed(ur5, *runs, by=np.full(50, 1e-3), align=('base', 'tool'))


def test_what_would_look_the_same_is_told_with_its_place(still):
    slip = Slip(
        ToolSlip(time=11.5), 0, 2e-3, 90.0, (InstrumentKnock(time=11.5), JointSlip('elbow_joint'))
    )
    assert slip.alike == (
        ('instrument_knocked', ('instrument',)),
        ('joint_slipped', ('elbow_joint',)),
    )
    words = slip.sentence(still)
    assert words.startswith('The reflector jumped') and 'station 12 of 40' in words
    assert (
        "A knock at instrument or base or a slip of joint 'elbow_joint' would look the same"
        in words
    )
    found = _gave_way(slip, SimpleNamespace(recordings=(still,)))
    assert (found.kind, found.at, found.alike) == ('reflector_jumped', ('tool',), slip.alike)


def test_of_one_recording_what_gave_way_is_for_the_search_to_weigh(ur5, still):
    knock = InstrumentKnock(time=12.5)
    slip = Slip(ToolSlip(time=11.5), 0, 2e-3, 90.0, (knock,))
    found = Examined(Given((still,), ur5), asked(ur5, still), (), (), (), (slip,))
    (jumped,) = found.unsound_with([slip.effect], [])
    assert jumped.kind == 'reflector_jumped' and not jumped.alike
    (knocked,) = found.unsound_with([knock], [(Site.of(slip.effect), Site.of(knock))])
    assert knocked.kind == 'instrument_knocked' and 'at station 13 of 40' in knocked.sentence
    assert knocked.alike == (('reflector_jumped', ('tool',)),)
    assert found.unsound_with([], []) == ()


# Efforts ----------------------------------------------------------------------------------------


@pytest.mark.parametrize('holds', [True, False])
def test_efforts_tell_whether_they_hold_the_load_and_what_nobody_said_that_hangs_there(rng, holds):
    robot = load('ur10e')
    heavy = replace(robot, payload_mass=robot.payload_mass + 3.0)
    run = recorded(robot, stations(robot, rng, 40), rng, points=True)
    # As a controller reports them, who may mean either; first they are taken for what holds.
    effort = with_expected_effort(run, heavy, -1.0 if holds else 1.0).effort
    (known,) = with_sign([replace(run, effort=effort)], robot)
    assert known.effort_holds is holds
    sign, difference = efforts(Case(*asked(robot, known)))
    assert sign.level == 'note'
    assert ('as what holds the load' in sign.sentence) is holds
    assert difference.level == 'warning' and '+3.00 kg of payload' in difference.sentence
    (agreed,) = efforts(Case(*asked(heavy, known)))
    assert 'correlate by 1.00' in agreed.sentence
    assert not efforts(Case(*asked(robot, run)))


def test_noise_of_efforts_makes_nothing_a_cause_that_explains_none_of_the_difference(rng):
    robot = load('ur10e')
    run = recorded(robot, stations(robot, rng, 400), rng, points=True)
    heavy = replace(robot, payload_mass=robot.payload_mass + 3.0)
    effort = with_expected_effort(run, heavy, -1.0).effort
    shaken = effort.value + rng.normal(scale=6.0, size=effort.value.shape)
    (known,) = with_sign([replace(run, effort=replace(effort, value=shaken))], robot)
    assert [cause.name for cause in compared([known], robot).causes] == ['payload']


# What is believed -------------------------------------------------------------------------------


@pytest.mark.parametrize(
    ('rate', 'after', 'believed'),
    [(0.0, 4e-3, True), (0.2, 4e-3, False), (0.0, 0.02, False), (0.0, 5.5e-3, False)],
)
def test_a_lag_must_explain_most_of_the_gap_and_be_one_of_clocks(rate, after, believed):
    before = Lag(0.3, 0.0, 5.0, before=0.01 if after < 0.01 else 0.1)
    assert _believed(before, Lag(0.3, rate, 5.0, after=after)) is believed
    assert not _believed(None, before) and not _believed(before, None)


@pytest.mark.parametrize(('gap', 'held'), [(0.06, True), (0.2, False)])
def test_a_tool_that_never_moves_is_held_where_the_arm_says_so_too(ur5, still, gap, held):
    seen = replace(still.measured, position=np.tile(still.seen.position[:1], (40, 1)))
    case = Case(*asked(ur5, still.with_measured(seen)))
    vars(case)['gap'] = gap
    assert case.tool_fixed is held
    case = Case(*asked(ur5, still))
    vars(case)['gap'] = gap
    assert not case.tool_fixed


@pytest.mark.parametrize(
    ('pixel', 'off', 'undone'),
    [(0.4, 1.0, True), (0.4, 5.0, False), (0.9, 1.0, False), (1.1, 0.0, True), (1.6, 0.0, False)],
)
def test_a_mistake_of_cameras_is_one_where_lenses_are_as_calibrated(pixel, off, undone):
    far = 6.0 if pixel > 1.0 else 2.0
    before = Fitted(1.0, np.array([[far, 0.0]]))
    assert _undone(before, Fitted(pixel, np.array([[off, 0.0]]))) is undone


def test_a_gap_is_made_up_for_what_the_fit_took(ur5, still):
    problem, model = asked(ur5, still)
    own = np.median(np.linalg.norm(problem.residuals(model)[0], axis=0))
    assert _gap(problem, model) == pytest.approx(own / np.sqrt(1.0 - 12.0 / 120.0))


def test_stations_that_are_there_twice_are_counted(ur5, rng):
    run = recorded(ur5, stations(ur5, rng, 40), rng, points=True)
    case = SimpleNamespace(tool_fixed=False, recordings=(run,), motions=[run.joints.q])
    assert not list(repeats(case))
    seen, q = run.measured, np.array(run.joints.q)
    position = np.array(seen.position)
    position[[7, 9]], q[[7, 9]] = position[3], q[3]
    both = replace(rejointed(run, q), measured=replace(seen, position=position))
    case = SimpleNamespace(tool_fixed=False, recordings=(both,), motions=[q])
    (found,) = repeats(case)
    assert found.level == 'warning' and found.sentence.startswith('2 station(s)')
    # Three readings of every posture: two that are equal are so by chance.
    q = np.concatenate([np.repeat(q[10:22], 3, axis=0), q[22:26]])
    position = np.array(seen.position)
    position[10] = position[9]
    thrice = replace(rejointed(run, q), measured=replace(seen, position=position))
    assert not list(repeats(SimpleNamespace(tool_fixed=False, recordings=(thrice,), motions=[q])))


def test_names_are_listed_as_people_do():
    assert [listed(list('abc')[:k]) for k in (1, 2, 3)] == ['a', 'a and b', 'a, b and c']


def test_drives_that_trail_by_times_of_their_own_are_no_clock_that_drifts(ur5, rng):
    motion = moving(ur5, rng)
    trails = (0.004, 0.012, 0.02, 0.008, 0.008, 0.008)
    late = np.stack(
        [np.interp(motion.t - by, motion.t, q) for by, q in zip(trails, motion.q.T, strict=True)],
        axis=1,
    )
    real = recorded(ur5, JointMotion(motion.t, late), rng, points=True)
    problem, model = asked(ur5, Recording('run', motion, real.measured), align=('base',))
    case = Case(problem, model)
    vars(case)['lags'] = [Lag(0.009, -9e-4, 10.0, before=5e-3, after=2e-3)]
    assert not list(clocks(case))
    # Of a clock that does drift they explain no more than it does.
    t = real.measured.t
    drifting = Recording('run', motion).with_measured(
        replace(recorded(ur5, motion, rng, points=True).measured, t=t + 5e-3 + 9e-4 * t)
    )
    case = Case(*asked(ur5, drifting, align=('base',)))
    vars(case)['lags'] = [Lag(0.014, 9e-4, 10.0, before=5e-3, after=1e-4)]
    assert [item.kind for item in clocks(case)] == ['clock']
