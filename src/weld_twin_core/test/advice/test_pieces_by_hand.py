# Copyright 2026 weld_twin contributors
# SPDX-License-Identifier: Apache-2.0
"""How pieces of a measurement are weighed and put together, against what can be said by hand."""

from dataclasses import replace
from types import SimpleNamespace

import numpy as np
import pytest

from weld_twin_core import JointMotion, Measurements, Recording, Signal, load
from weld_twin_core.diagnosis.advice.candidates import (
    MASS,
    PRESS,
    RISE,
    STAY,
    Piece,
    _alone,
    candidates,
)
from weld_twin_core.diagnosis.advice.chosen_pieces import SAFE, Plan, _by_turns, _longer
from weld_twin_core.diagnosis.advice.experiment import _apart, _name, _side
from weld_twin_core.diagnosis.advice.next_touches import MOST, _Option
from weld_twin_core.diagnosis.advice.postures import Limits, Room, joined, widened
from weld_twin_core.diagnosis.advice.separation import Parting, _ahead, _remainder
from weld_twin_core.diagnosis.algebra.problem import Model, Problem, Scale
from weld_twin_core.diagnosis.answer.next_step import _in_place, _promise
from weld_twin_core.effects import Backlash, JointCompliance, JointOffset


@pytest.fixture
def rng():
    return np.random.default_rng(5)


def left(stack):
    """Return what the columns (all rows but the last) leave of the last one."""
    columns, last = stack[:-1].T, stack[-1]
    return np.linalg.norm(last - columns @ np.linalg.lstsq(columns, last, rcond=None)[0])


def test_what_pieces_add_is_what_least_squares_leave_of_the_difference(rng):
    ways = [rng.normal(size=(4, 60)), rng.normal(size=(3, 60))]
    more = [[rng.normal(size=(len(way), 20)) for _ in range(5)] for way in ways]
    parting = Parting(
        [way @ way.T for way in ways],
        [np.array([piece @ piece.T for piece in own]) for own in more],
    )
    assert parting.before == pytest.approx([left(way) for way in ways], rel=1e-6)
    together = [
        [np.hstack([w, m[2], m[k]]) for k in (0, 4)] for w, m in zip(ways, more, strict=True)
    ]
    expected = np.mean(
        [
            [np.sqrt(left(stack) ** 2 - left(way) ** 2) for stack in own]
            for own, way in zip(together, ways, strict=True)
        ],
        axis=0,
    )
    assert parting.gained((2,), (0, 4)) == pytest.approx(expected, rel=1e-6)


def test_a_difference_that_the_other_explanation_can_make_parts_nothing(rng):
    stack = rng.normal(size=(3, 40))
    stack[-1] = stack[0] - 2.0 * stack[1]
    parting = Parting([stack @ stack.T] * 2, [np.array([stack @ stack.T])] * 2)
    assert parting.before.max() < 1e-3 * np.linalg.norm(stack[-1])


def test_what_rounding_leaves_of_one_difference_does_not_touch_that_of_another(rng):
    stack = rng.normal(size=(3, 40))
    square = stack @ stack.T
    copied = np.array(square)
    copied[2], copied[:, 2] = square[1], square[:, 1]
    # A little less than its own projection, as rounding may have it.
    copied[2, 2] = (1.0 - 1e-6) * square[1, 1]
    told = _remainder(np.array([square, copied]))
    assert told == pytest.approx([left(stack), 0.0], rel=1e-6)


@pytest.mark.parametrize(('static', 'telling'), [(True, 60), (False, 40)])
def test_a_station_counts_by_itself_and_a_moving_arm_every_seventh_of_a_second(
    problem, static, telling
):
    """Of a zero of the first joint, by how far the tool is from its axis while that joint turns."""
    robot, home = load('ur5'), problem.recordings[0].joints.q[0]
    model = Model(robot, (robot.T_world_base,))
    ways = [(JointOffset(robot.joint_names[0], 2e-3),), (JointOffset(robot.joint_names[0], 1e-3),)]
    made = SimpleNamespace(model=model, new_base=False, new_tool=False)
    t = np.linspace(0.0, 6.0, 60)
    turning = home + np.outer(t / 6.0, np.eye(6)[0])
    motion = JointMotion(t, turning, static=static)
    side = _ahead(problem, made, Recording('next', motion), ways, Scale(2e-5, 1.0, (np.ones(30),)))
    tip = model.twin(0).poses(Recording('next', motion), t).position
    assert side.rows == 3
    apart = np.linalg.norm(side.predicted[0] - side.predicted[1])
    expected = 1e-3 * np.hypot(tip[0, 0], tip[0, 1]) / 2e-5
    assert apart == pytest.approx(expected * np.sqrt(telling), rel=1e-3)


def candidate(*seconds, static=False):
    pieces = tuple(Piece(k, None, each) for k, each in enumerate(seconds))
    return SimpleNamespace(pieces=pieces, static=static, set_up=3.0)


def gaining(*table):
    """Return partings that add what a table says, whatever is in already."""
    return [
        SimpleNamespace(gained=lambda _, more, row=row: np.array(row)[list(more)]) for row in table
    ]


def test_the_piece_that_adds_most_is_next_and_of_equal_ones_the_shorter():
    plan = Plan(candidate(30.0, 20.0, 20.0, 10.0), (), others=(1,))
    assert _longer(plan, gaining([4.0, 9.0, 5.0, 9.0]), (0, 1, 2, 3)).chosen == (3,)
    assert _longer(plan, gaining([1.0, 2.0, 1.5, 2.0]), (0, 1, 2)).chosen == (1,)


def test_what_the_verdict_names_counts_more_and_no_more_than_decides():
    plan = Plan(candidate(10.0, 10.0), (), named=2, others=(1, 2))
    assert _longer(plan, gaining([5.0, 0.0], [0.0, 12.0]), (0, 1)).chosen == (0,)
    assert _longer(plan, gaining([5.0, 0.0], [0.0, 16.0]), (0, 1)).score == pytest.approx(15.0)
    alone = Plan(candidate(10.0, 10.0), (), others=(1, 2))
    assert _longer(alone, gaining([90.0, 12.0], [0.0, 12.0]), (0, 1)).chosen == (1,)


def test_a_plan_says_which_explanation_it_parts_and_whether_that_is_enough():
    plan = Plan(
        candidate(60.0, 30.0), (0, 1), named=2, others=(1, 3), known=np.array([2.0, 16.0]),
        gains=np.array([4.0, 20.0]),
    )  # fmt: skip
    assert (plan.other, plan.before, plan.after) == (1, 2.0, 4.0)
    assert not plan.decided and not plan.enough and plan.apart == 24.0
    assert (plan.seconds, plan.robot_minutes, plan.minutes) == (90.0, 1.5, 4.5)
    nothing = Plan(
        plan.candidate, (0,), named=2, others=(1, 3), known=plan.known, gains=np.array([2.0, 20.0])
    )
    assert (nothing.other, nothing.decided, nothing.enough) == (3, True, True) and SAFE == 15.0
    assert Plan(plan.candidate, ()).after is None
    assert Plan(plan.candidate, (0,)).open(89.0) == [] and Plan(plan.candidate, (0,)).open(
        90.0
    ) == [1]


@pytest.mark.parametrize(
    ('count', 'alone', 'turns'),
    [(5, 2, [0, 3, 1, 4, 2]), (4, 0, [0, 1, 2, 3]), (4, 3, [0, 1, 2, 3])],
)
def test_pieces_of_all_joints_and_of_one_take_turns(count, alone, turns):
    assert _by_turns(count, alone) == turns


def test_motions_follow_each_other_without_a_jump():
    one = JointMotion(np.array([0.0, 1.0, 2.0]), np.array([[0.0], [1.0], [3.0]]))
    other = JointMotion(np.array([5.0, 5.5]), np.array([[3.0], [2.0]]))
    both = joined(one, other)
    assert both.t.tolist() == [0.0, 1.0, 2.0, 2.5] and both.q[:, 0].tolist() == [
        0.0,
        1.0,
        3.0,
        2.0,
    ]


@pytest.fixture
def problem(rng):
    q = np.array([0.2, -1.2, 1.5, -1.0, -1.4, 0.3]) + 0.1 * rng.uniform(-1.0, 1.0, (30, 6))
    t = np.arange(30.0)
    seen = Measurements(t, np.zeros((30, 3)))
    return Problem((Recording('seen', JointMotion(t, q, static=True), seen),), frozenset())


@pytest.mark.parametrize(('way', 'speed'), [(0.2, 1.0), (2.0, 1.0), (0.5, 0.25)])
def test_a_way_takes_as_long_as_half_of_speed_or_of_acceleration_asks(problem, way, speed):
    robot = load('ur5')
    room = Room(problem, robot, Limits())
    stops = [room.home, room.home + way, room.home]
    made = room.travel(stops, speed)
    step = made.t[1] - made.t[0]
    rates = np.abs(np.diff(made.q, axis=0)) / step
    jumps = np.abs(np.diff(made.q, n=2, axis=0)) / step**2
    shares = (rates / (speed * robot.max_velocity)).max(), (jumps / robot.max_acceleration).max()
    assert max(shares) == pytest.approx(0.5, rel=0.1) and max(shares) < 0.501
    np.testing.assert_allclose(made.q[[0, -1]], [room.home] * 2, atol=1e-12)
    assert np.abs(made.q - stops[1]).sum(axis=1).min() < 1e-9


def test_a_way_that_is_not_free_leads_by_home_and_one_joint_alone_goes_as_far_as_it_may():
    home, q = np.zeros(2), np.array([[1.0, 1.0], [2.0, 1.0], [-1.0, 0.5], [1.0, 0.5]])
    room = SimpleNamespace(home=home, low=np.array([-1.0, -2.0]), high=np.array([1.5, 1.0]))
    # Nobody may pass from one side to the other.
    room._ways = lambda start, end: start[:, 0] * end[:, 0] > 0.0
    expected = [q[0], q[1], home, q[2], home, q[3]]
    np.testing.assert_array_equal(Room.linked(room, q), expected)
    for most, share in ((2.0, 1.0), (0.8, 0.5), (0.01, 0.125)):
        room.way = lambda stops, most=most: np.abs(stops).max() <= most
        high, low = share * room.high[0], share * room.low[0]
        expected = [home, [high, 0.0], [low, 0.0], home]
        np.testing.assert_allclose(_alone(room, 0), expected)


def test_joints_stay_within_their_limits_and_near_what_was_recorded(problem):
    robot, q = load('ur5'), problem.recordings[0].joints.q
    room = Room(problem, robot, Limits())
    assert (room.low >= robot.lower).all() and (room.high <= robot.upper).all()
    assert (room.low <= q.min(axis=0)).all() and (room.high >= q.max(axis=0)).all()
    assert (room.high - room.low <= 2.4 + np.ptp(q, axis=0)).all()
    low, high = widened(problem, robot)
    assert (high - low).min() == pytest.approx(0.7) and (low < q.min(axis=0)).all()


def verdict(**other):
    return SimpleNamespace(**{'status': 'ambiguous', 'confidence': 0.5, 'sets': [1], **other})


def asking(sigma, effect='backlash'):
    side = [{'effect': effect, 'joint': 'a'}]
    return {'expected_separation_sigma': sigma, 'between': [side, side], 'motion': {}}


def test_more_is_promised_of_what_parts_farther_and_is_believed_more():
    promised = [_promise(verdict(), asking(sigma)) for sigma in (0.0, 3.0, 6.0, 12.0, 1e3)]
    assert promised == sorted(promised) and promised[0] < 1e-3
    assert promised[2] == pytest.approx(0.5 * 0.8) and promised[-1] == pytest.approx(0.8)
    assert _promise(verdict(confidence=0.9), asking(6.0)) > promised[2]
    assert _promise(verdict(), {**asking(6.0), 'between': None}) is None


def test_no_more_is_promised_than_what_is_believed():
    far = asking(1e3)
    assert _promise(verdict(status='unknown', confidence=0.3), far) == pytest.approx(0.3)
    assert _promise(verdict(status='unknown', confidence=0.3, sets=[]), far) == pytest.approx(0.7)
    nameless = asking(1e3, 'joint_curve')
    assert _promise(verdict(status='unknown', confidence=0.3), nameless) == pytest.approx(0.5)


def test_explanations_with_another_in_place_of_one_come_likeliest_first_and_not_the_one_at_hand():
    def other(site, probability, found):
        model = SimpleNamespace(found=found)
        return SimpleNamespace(
            site=site, probability=probability, fit=SimpleNamespace(model=model)
        )

    listed = [
        [other(1, 0.2, 'two'), other(2, 0.7, 'own')],
        [other(1, 0.4, 'one'), other(3, 0.1, 'far')],
    ]
    result = SimpleNamespace(
        small=SimpleNamespace(model=SimpleNamespace(found='own')), candidate_sets=listed
    )
    named = verdict(sets=[[1, 2]])
    assert _in_place(result, named, named=True) == ['one', 'two']
    assert _in_place(result, named, named=False) == ['far']


def test_explanations_are_told_by_what_each_has_alone():
    zero, spring, play = JointOffset('a', 1e-3), JointCompliance('a', 1e-6), Backlash('b', 1e-3)
    assert _apart((zero, spring), (zero, play)) == ([spring], [play])
    assert _side([play, Backlash('b', 2e-3)]) == [
        {'effect': 'backlash', 'joint': 'b', 'at': 'b', 'on': 'direction'}
    ]
    assert _name(play, [spring]) == 'backlash of b'


def test_while_nothing_shows_what_comes_nearest_to_it_is_next():
    plan = Plan(candidate(10.0, 10.0, 10.0), (), others=(1,))
    assert _longer(plan, gaining([0.5, 2.0, 1.0]), (0, 1, 2)).chosen == (1,)
    assert _longer(plan, gaining([0.5, 2.0, 1.0]), (0, 1, 2)).score == 0.0


@pytest.mark.parametrize('count', [3, MOST])
def test_touches_are_needed_until_most_of_what_they_can_narrow_is_narrowed(count):
    spread = [100.0, *(64.0 * 0.5**k for k in range(count))]
    known = [SimpleNamespace(open=lambda _, each=each: each) for each in spread]
    option = _Option([], None, list(range(count)), known)
    gone = 10.0 - np.sqrt(spread)
    expected = int(np.flatnonzero(gone >= 0.9 * gone[-1])[0])
    assert option.needed(np.zeros(0)) == (expected if count == MOST else None)


# What could be measured -------------------------------------------------------------------------


def could_be(problem, robot=None, **limits):
    robot = robot or load('ur5')
    model = Model(robot, (robot.T_world_base,) * len(problem.recordings))
    return {each.kind: each for each in candidates(problem, model, Limits(**limits))}


def beside(problem, **signals):
    """Return the problem with signals in its recording."""
    (recording,) = problem.recordings
    return replace(problem, recordings=(replace(recording, **signals),))


def test_what_needs_a_hand_or_another_set_up_is_offered_where_that_may_be(problem):
    changing = {'warm_up', 'payload_swap', 'longer_tool', 'moved_instrument'}
    assert set(could_be(problem)) == {'path', 'stations', 'bidirectional'} | changing
    assert set(could_be(problem, set_up=False)) == {'stations', 'bidirectional'}


def test_every_station_takes_its_time_the_last_one_as_well(problem):
    stations = could_be(problem)['stations']
    plan = Plan(stations, tuple(range(len(stations.pieces)))[:4])
    assert 60.0 * plan.robot_minutes == pytest.approx(STAY * plan.motion().t.size)


def test_a_tool_that_is_pressed_is_pressed_along_each_axis_in_turn(problem):
    t = problem.recordings[0].joints.t
    wrench = Signal(t, np.tile([0.0, 0.0, -40.0, 0.0, 0.0, 0.0], (t.size, 1)))
    pressed = could_be(beside(problem, wrench=wrench))['press']
    (recording,) = pressed.recordings
    assert recording.wrench_frame == 'base' and recording.wrench.value.shape[1] == 6
    for piece in pressed.pieces:
        np.testing.assert_array_equal(
            recording.wrench.value[list(piece.rows)], PRESS * np.eye(3, 6)
        )


def test_an_arm_that_warms_up_grows_warmer_from_where_it_was(problem):
    t = problem.recordings[0].joints.t
    warm = beside(problem, temperature=Signal(t, np.full(t.size, 31.0)))
    made = could_be(warm)
    ramp = made['warm_up'].recordings[0].temperature.value
    assert (ramp[0], ramp[-1]) == (31.0, 31.0 + RISE) and (np.diff(ramp) > 0.0).all()
    assert np.ptp(made['stations'].recordings[0].temperature.value) == 0.0
    assert made['warm_up'].whole and len(made['warm_up'].pieces) == 1


def test_a_weight_that_hung_in_one_recording_hangs_in_none_to_come(problem):
    t = problem.recordings[0].joints.t
    load_on_it = Signal(t, np.tile([0.0, 0.0, -40.0, 0.0, 0.0, 0.0], (t.size, 1)))
    loaded = beside(problem, wrench=load_on_it)
    both = replace(problem, recordings=(*problem.recordings, *loaded.recordings))
    assert could_be(loaded)['stations'].recordings[0].wrench.value[0, 2] == -40.0
    assert could_be(both)['stations'].recordings[0].wrench is None
    assert 'press' not in could_be(both)


def test_what_is_changed_is_changed_in_the_model_that_foresees_it(problem):
    robot = load('ur5')
    made = could_be(problem)
    heavy, longer, moved = (
        made[k].model for k in ('payload_swap', 'longer_tool', 'moved_instrument')
    )
    assert heavy.robot.payload_mass == robot.payload_mass + MASS
    assert made['payload_swap'].changed == f'load={MASS:g}'
    step = np.linalg.inv(robot.T_flange_tool) @ longer.robot.T_flange_tool
    assert step[:3, 3] == pytest.approx([0.0, 0.0, 0.2]) and made['longer_tool'].new_tool
    assert np.linalg.norm(moved.bases[0][:3, 3] - robot.T_world_base[:3, 3]) > 1.0
    assert made['moved_instrument'].new_base and not made['stations'].new_base


def test_both_sides_of_a_station_are_equally_far_and_one_measurement(problem):
    both = could_be(problem)['bidirectional']
    q = both.recordings[0].joints.q
    for piece in both.pieces:
        low, middle, high, again = q[list(piece.rows)]
        np.testing.assert_array_equal(middle, again)
        np.testing.assert_allclose(high - middle, middle - low)
        assert (high > middle).all()


def test_a_way_that_leaves_the_box_is_not_free(problem):
    robot = load('ur5')
    tips = Room(problem, robot, Limits())
    free = tips.spread(20)
    assert ((free >= tips.low) & (free <= tips.high)).all() and tips.way(list(free[:1]) * 2)
    box = np.array([[-0.6, -0.9, 0.05], [0.9, 0.9, 0.9]])
    inside = Room(problem, robot, Limits(box=box))
    assert inside.way([inside.home, inside.home])
    upright = np.array([0.0, -np.pi / 2, 0.0, -np.pi / 2, 0.0, 0.0])
    assert not inside.way([inside.home, upright, inside.home])
