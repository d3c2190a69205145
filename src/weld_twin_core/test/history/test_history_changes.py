# Copyright 2026 weld_twin contributors
# SPDX-License-Identifier: Apache-2.0
"""Changes between diagnoses, against years of simulated weekly recordings."""

from dataclasses import replace

import numpy as np
import pytest

from weld_twin_core.errors import DataError
from weld_twin_core.history import Observation, Outlook, changes, outlook, reaches
from weld_twin_core.history.series import series_of

COUNT = 20
NAMES = tuple(f'joint_offset joint_{k} 0' for k in range(COUNT))


def year(seed, drift=None, weeks=52, same=()):
    """Return the weekly posteriors of an arm whose coordinates do what ``drift(week)`` adds."""
    rng = np.random.default_rng(seed)
    arm = 0.5 * rng.normal(size=COUNT)
    motion = rng.normal(size=(60, COUNT)) @ np.diag(rng.uniform(0.3, 3.0, COUNT))
    out = []
    for week in range(weeks):
        rows = motion + 0.3 * rng.normal(size=motion.shape)
        for one, other in same:
            rows[:, one] = rows[:, other]
        moved = arm + (0.0 if drift is None else drift(week))
        covariance = np.linalg.inv(rows.T @ rows + np.eye(COUNT))
        seen = rows @ moved + rng.normal(size=len(rows))
        value = covariance @ (rows.T @ seen)
        out.append(Observation(7.0 * week, NAMES, value, covariance, np.ones(COUNT)))
    return out


def part(whole, first, end):
    """Return an observation of some of the coordinates."""
    own = {name: getattr(whole, name)[first:end] for name in ('names', 'value', 'prior_std')}
    return replace(whole, **own, covariance=whole.covariance[first:end, first:end])


def only(place, size, begin):
    return lambda week: size * (np.arange(COUNT) == place) * (week >= begin)


@pytest.mark.parametrize('seed', range(8))
def test_nothing_is_told_of_a_year_without_a_change(seed):
    assert changes(year(seed)) == ()


def test_the_first_looks_are_held_to_as_much_as_the_last():
    quiet = [year(seed, weeks=8) for seed in range(100, 160)]
    told = sum(any(changes(seen[:count]) for count in range(4, 9)) for seen in quiet)
    assert told <= 3  # held to what eight weeks try, it was ten


@pytest.mark.parametrize('seed', range(8))
def test_a_step_of_four_standard_errors_is_found_within_three_recordings(seed):
    place = seed % COUNT
    error = np.sqrt(year(seed)[30].covariance[place, place])
    found = changes(year(seed, only(place, 4.0 * error, 30), weeks=33))
    assert [(each.name, each.kind) for each in found] == [(NAMES[place], 'step')]
    assert abs(found[0].size - 4.0 * error) < 4.0 * found[0].std
    assert found[0].between[0] <= 7.0 * 30 <= found[0].between[1] + 7.0
    assert found[0].std < error


@pytest.mark.parametrize('finer', [1.0, 1e6])
def test_two_steps_of_one_coordinate_are_as_well_known_as_one(finer):
    """Of an instant at which the other step is nothing is left to be known, but rounding."""
    error = np.sqrt(year(3)[30].covariance[5, 5])
    up, down = only(5, 4.0 * error, 12), only(5, -4.0 * error, 26)
    seen = [
        replace(each, value=each.value / finer, covariance=each.covariance / finer**2)
        for each in year(3, lambda week: up(week) + down(week), weeks=40)
    ]
    with np.errstate(invalid='raise'):
        found = changes(seen)
    assert [each.name for each in found] == [NAMES[5]] * 2
    assert all(each.std * finer < error for each in found)


def test_a_trend_on_top_of_another_is_told_as_such():
    error = np.sqrt(year(3)[20].covariance[5, 5])
    rise = [1.5 * error * (week - 3 * max(week - 10, 0)) for week in range(20)]
    line = [each * (np.arange(COUNT) == 5) for each in rise]
    found = sorted(changes(year(3, line.__getitem__, weeks=20)), key=lambda each: each.day)
    assert [(each.kind, each.faster) for each in found] == [('trend', False), ('trend', True)]
    assert found[0].size > 0.0 > found[1].size


@pytest.mark.parametrize('seed', range(4))
def test_what_stays_as_it_is_makes_diagnoses_comparable(seed):
    # Of ten coordinates each diagnosis sees hardly more than what they come to together with the
    # others; those others are no different in the next one.
    steady = frozenset(NAMES[10:])
    alike = [(place, place + 10) for place in range(10)]
    error = np.sqrt(np.diag(year(seed)[0].covariance))[10:]
    place, size = int(np.argmin(error)), 10.0 * float(error.min())
    moved = [
        replace(each, steady=steady)
        for each in year(seed, only(place, size, 1), weeks=2, same=alike)
    ]
    found = changes(moved)
    assert [each.name for each in found] == [NAMES[place]]
    assert abs(found[0].size - size) < 4.0 * found[0].std
    unsteady = [replace(part(each, 0, 10), steady=frozenset()) for each in moved]
    assert changes(unsteady) == ()
    assert [each.name for each in changes([moved[0], part(moved[1], 0, 15)])] == [NAMES[place]]


def test_a_trend_is_no_step_and_has_its_rate():
    found = changes(year(3, lambda week: 0.1 * (np.arange(COUNT) == 5) * max(week - 20, 0)))
    assert [(each.name, each.kind) for each in found] == [(NAMES[5], 'trend')]
    assert found[0].size == pytest.approx(0.1 / 7.0, rel=0.1)
    assert found[0].day == pytest.approx(7.0 * 20, abs=21.0)


def test_a_season_is_neither():
    def swing(week):
        return 0.6 * (np.arange(COUNT) == 2) * np.sin(2.0 * np.pi * week * 7.0 / 365.25 + 0.4)

    found = changes(year(4, swing))
    assert [(each.name, each.kind) for each in found] == [(NAMES[2], 'season')]
    assert found[0].size == pytest.approx(0.6, rel=0.15)


def test_two_changes_are_both_found():
    found = changes(year(6, lambda w: only(1, 1.0, 10)(w) + only(7, -1.2, 33)(w)))
    assert {(each.name, each.kind) for each in found} == {(NAMES[1], 'step'), (NAMES[7], 'step')}


def test_what_recordings_cannot_tell_apart_comes_as_a_set():
    """Every motion shows the sum of two coordinates only."""
    months = year(9, only(0, 1.5, 12), weeks=24, same=[(1, 0)])
    found = changes(months)
    assert {NAMES[0], NAMES[1]} <= {found[0].name, *found[0].alike}
    assert changes(months, named={NAMES[1]})[0].name == NAMES[1]


@pytest.mark.parametrize('slow', [0, 1])
def test_what_warmth_alone_changes_steps_no_sooner_than_what_is_knocked(slow):
    months = year(9, only(0, 1.5, 12), weeks=24, same=[(1, 0)])
    found = changes(months, likely=NAMES, slow={NAMES[slow]})
    assert (found[0].kind, found[0].name) == ('step', NAMES[1 - slow])


@pytest.mark.parametrize('slow', [0, 1])
def test_what_warmth_alone_changes_is_as_likely_in_a_season_as_before(slow):
    swing = year(
        9, lambda w: 1.5 * np.sin(2.0 * np.pi * w / 52.0) * only(0, 1.0, 0)(w), same=[(1, 0)]
    )
    told = [changes(swing, likely=NAMES, slow=each) for each in ((), {NAMES[slow]})]
    assert told[0] == told[1] and told[0][0].kind == 'season'


def test_the_prior_is_taken_out_of_what_the_data_say():
    rng = np.random.default_rng(5)
    rows, width = rng.normal(size=(9, 4)), np.array([0.1, 1.0, 3.0, 0.5])
    truth = rng.normal(size=4)
    covariance = np.linalg.inv(rows.T @ rows + np.diag(width**-2))
    seen = Observation(0.0, NAMES[:4], covariance @ rows.T @ rows @ truth, covariance, width)
    precision, told = seen.information()
    np.testing.assert_allclose(precision, rows.T @ rows, atol=1e-9)
    np.testing.assert_allclose(told, rows.T @ rows @ truth, atol=1e-9)


def test_an_effect_that_is_not_named_is_taken_to_be_small():
    weeks = year(2, weeks=3)
    series = series_of([part(weeks[0], 1, COUNT), *weeks[1:]])
    k = series.names.index(NAMES[0])
    error = np.median([np.sqrt(each.covariance[0, 0]) for each in weeks[1:]])
    assert series.precision[0, k, k] == pytest.approx(1.0 / (3.0 * error) ** 2)
    assert series.weighted[0, k] == 0.0


def rows_of_a_program(seed):
    """Return the rows that a program of postures shows of an arm."""
    rng = np.random.default_rng(seed)
    return rng.normal(size=(60, COUNT)) @ np.diag(rng.uniform(0.3, 3.0, COUNT))


def year_of_programs(seed, repeated, programs, drift=None):
    """Return weekly posteriors, program after program; a share of the noise is each one's own."""
    rng = np.random.default_rng(seed)
    out = []
    for program in range(programs):
        rows = rows_of_a_program((seed, program))
        own = np.sqrt(repeated) * rng.normal(size=len(rows))
        covariance = np.linalg.inv(rows.T @ rows + np.eye(COUNT))
        for week in range(52 // programs * program, 52 // programs * (program + 1)):
            moved = np.zeros(COUNT) if drift is None else drift(week)
            noise = own + np.sqrt(1.0 - repeated) * rng.normal(size=len(rows))
            value = covariance @ (rows.T @ (rows @ moved + noise))
            out.append(Observation(7.0 * week, NAMES, value, covariance, np.ones(COUNT)))
    return out


@pytest.mark.parametrize('seed', range(6))
def test_another_program_is_no_step_of_the_arm(seed):
    """Play that nobody named errs alike at the same postures, each week, and otherwise at others."""
    other = 7.0 * 26
    found = changes(year_of_programs(seed, 0.8, 2))
    assert not [each for each in found if each.between[0] <= other <= each.between[1]]


def test_what_comes_back_at_the_same_postures_hides_no_step_between_them():
    error = np.sqrt(np.diag(year_of_programs(0, 0.8, 1)[0].covariance))
    size = 2.0 * float(error[3])
    (found,) = changes(year_of_programs(0, 0.8, 1, only(3, size, 40)))
    assert (found.name, found.kind) == (NAMES[3], 'step')
    assert abs(found.size - size) < 3.0 * found.std < error[3]
    (plain,) = changes(year_of_programs(0, 0.0, 1, only(3, size, 40)))
    assert found.std == pytest.approx(np.sqrt(0.2) * plain.std, rel=0.2)


def test_postures_measured_twice_as_finely_are_the_same_postures():
    first, *_ = weeks = year_of_programs(0, 0.8, 2)
    finer = replace(
        first,
        covariance=np.linalg.inv(
            4.0 * np.linalg.inv(first.covariance) - 3.0 * np.diag(first.prior_std**-2.0)
        ),
    )
    assert first.same_postures(finer) and finer.same_postures(first)
    assert not first.same_postures(weeks[-1])
    unit = 10.0 ** np.linspace(-3.0, 3.0, first.value.size)  # whatever coordinates are counted in
    one, other = (
        replace(
            each,
            value=unit * each.value,
            covariance=np.outer(unit, unit) * each.covariance,
            prior_std=unit * each.prior_std,
        )
        for each in (first, finer)
    )
    assert one.same_postures(other)


def framed(observations):
    """Return observations whose first six coordinates are those of the tool."""
    axes = ('x', 'y', 'z', 'turn_x', 'turn_y', 'turn_z')
    names = (*(f'tool.{axis}' for axis in axes), *NAMES[6:])
    return [replace(each, names=names) for each in observations]


def test_a_knock_is_one_change_of_one_frame():
    knock = np.array([0.9, -0.7, 0.8, 0.0, 0.0, 0.0, *np.zeros(COUNT - 6)])
    (found,) = changes(framed(year(1, lambda week: knock * (week >= 20), weeks=30)))
    assert (found.kind, len(found.together)) == ('step', 6)
    for each, true in zip(found.together, knock, strict=False):
        assert abs(each.size - true) < 3.0 * each.std
    lead = max(found.together, key=lambda each: abs(each.size) / each.std)
    assert (found.name, found.size, found.std) == lead
    (alone,) = changes(framed(year(1, only(1, 0.9, 20), weeks=30)))
    assert (alone.name, alone.together, alone.alike) == ('tool.y', (), ())


def test_a_tool_that_was_swapped_for_a_week_is_told_once_each_way():
    """It moves by a hundred times of what is believed of a tool's place."""
    found = changes(framed(year(2, lambda week: 100.0 * only(2, 1.0, 20)(week) * (week < 21), 30)))
    assert [(each.name, each.kind) for each in found] == [('tool.z', 'step')] * 2
    assert sorted(each.size for each in found) == pytest.approx([-100.0, 100.0], rel=0.01)


def test_of_what_no_motion_shows_nothing_is_told():
    """Two coordinates that move nothing have values of rounding alone."""
    rng = np.random.default_rng(4)
    blind = []
    for each in year(5, weeks=30):
        value, covariance = each.value.copy(), each.covariance.copy()
        value[:2] = 1e-16 * rng.normal(size=2)
        covariance[:2] = covariance[:, :2] = 0.0
        covariance[:2, :2] = np.eye(2)
        blind.append(replace(each, value=value, covariance=covariance))
    assert changes(blind) == ()


def test_diagnoses_of_one_instant_and_none_are_refused():
    with pytest.raises(DataError, match='of the same instant'):
        changes([year(0, weeks=1)[0]] * 2)
    with pytest.raises(DataError, match='no diagnosis yet'):
        changes([])


def line(value, rate, rate_std):
    return Outlook(np.array([value, rate]), np.diag([0.0, rate_std**2]))


def test_a_limit_is_reached_when_the_line_meets_it():
    low, middle, high = reaches(2.0, line(1.0, 0.1, 0.04))
    assert middle == pytest.approx(10.0, rel=0.02)
    # 90 % of the rates lie within 1.645 standard errors
    assert low == pytest.approx(1.0 / (0.1 + 0.0658), rel=0.02)
    assert high == pytest.approx(1.0 / (0.1 - 0.0658), rel=0.1)
    assert reaches(0.5, line(1.0, 0.1, 0.01)) == (0.0, 0.0, 0.0)
    assert reaches(2.0, line(1.0, -0.1, 0.01))[1] == pytest.approx(30.0, rel=0.02)
    assert reaches(2.0, line(1.0, 0.0, 0.0))[1] == float('inf')


def test_value_and_rise_at_the_end_are_those_of_the_line_and_vary_together():
    seen = year(3, lambda week: 0.1 * (np.arange(COUNT) == 5) * max(week - 20, 0))
    found = changes(seen)
    now = outlook(seen, found, NAMES[5])
    arm = 0.5 * np.random.default_rng(3).normal(size=COUNT)
    error = np.sqrt(np.diag(now.covariance))
    assert abs(now.value[0] - (arm[5] + 0.1 * 31)) < 4.0 * error[0]
    assert abs(now.value[1] - 0.1 / 7.0) < 4.0 * error[1]
    # A line that rises faster ends higher.
    assert now.covariance[0, 1] > 0.0
    assert outlook(seen, found, NAMES[4]) is None
