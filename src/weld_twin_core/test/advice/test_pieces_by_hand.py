# Copyright 2026 weld_twin contributors
# SPDX-License-Identifier: Apache-2.0
"""How pieces of a measurement are weighed and put together, against what can be said by hand."""

from types import SimpleNamespace

import numpy as np
import pytest

from weld_twin_core.arm.catalog import load
from weld_twin_core.diagnosis.advice.candidates import Piece
from weld_twin_core.diagnosis.advice.chosen_pieces import SAFE, Plan, _by_turns, _longer
from weld_twin_core.diagnosis.advice.experiment import _apart, _name, _side
from weld_twin_core.diagnosis.advice.next_step import _promise
from weld_twin_core.diagnosis.advice.postures import Limits, Room, joined, widened
from weld_twin_core.diagnosis.advice.separation import Parting
from weld_twin_core.diagnosis.algebra.problem import Problem
from weld_twin_core.effects import Backlash, JointCompliance, JointOffset
from weld_twin_core.recording import JointMotion, Measurements, Recording


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


def test_a_way_is_travelled_within_half_of_speed_and_acceleration(problem):
    robot = load('ur5')
    room = Room(problem, robot, Limits())
    stops = [room.home, room.home + 0.5, room.home]
    for speed in (1.0, 0.25):
        made = room.travel(stops, speed)
        rates = np.diff(made.q, axis=0) / np.diff(made.t)[:, None]
        most = (np.abs(rates) / (speed * robot.max_velocity)).max()
        assert most < 0.501
        np.testing.assert_allclose(made.q[[0, -1]], [room.home] * 2, atol=1e-12)
    assert np.abs(made.q - stops[1]).sum(axis=1).min() < 1e-9


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


def test_explanations_are_told_by_what_each_has_alone():
    zero, spring, play = JointOffset('a', 1e-3), JointCompliance('a', 1e-6), Backlash('b', 1e-3)
    assert _apart((zero, spring), (zero, play)) == ([spring], [play])
    assert _side([play, Backlash('b', 2e-3)]) == [
        {'effect': 'backlash', 'joint': 'b', 'at': 'b', 'on': 'direction'}
    ]
    assert _name(play, [spring]) == 'backlash of b'
