# Copyright 2026 weld_twin contributors
# SPDX-License-Identifier: Apache-2.0
"""Goals corrected whole or refused, judged on arms whose own numbers were changed by hand."""

from dataclasses import replace

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st
from scipy.interpolate import BPoly

from weld_twin_core.arm.catalog import load
from weld_twin_core.arm.chain import forward
from weld_twin_core.arm.robot import Robot
from weld_twin_core.effects import effect_from_mapping
from weld_twin_core.errors import DataError
from weld_twin_core.recording import JointMotion, Recording
from weld_twin_core.twin.compensation import compensate
from weld_twin_core.twin.directions import Directions, Discrepancy
from weld_twin_core.twin.domain import Domain
from weld_twin_core.twin.goal_correction import GoalLimits, Refusal, Start, corrected_goal
from weld_twin_core.twin.goal_motion import Goal, course, fine_times
from weld_twin_core.twin.posterior import Posterior
from weld_twin_core.twin.program_model import ProgramModel

UR5 = load('ur5')
HOME = np.array([0.1, -1.2, 1.5, -1.8, -1.5, 0.3])
HOMES = {
    'ur5': HOME,
    'kuka_kr16_2': np.array([0.1, -1.3, 1.5, 0.3, 0.7, 0.2]),
    'abb_irb1600': np.array([0.1, 0.3, 0.2, 0.4, 0.6, 0.3]),
}
"""Postures away from singular ones, within the limits of each arm."""
PACE = np.array([0.8, 1.1, 0.5, 0.7, 0.9, 1.3])


def sway(t, size=0.15):
    """Return positions, velocities and accelerations of a smooth motion that begins at rest."""
    s = np.asarray(t)[:, None]
    q = HOME + size * np.cos(PACE * s) - size
    return q, -size * PACE * np.sin(PACE * s), -size * PACE**2 * np.cos(PACE * s)


def goal(count=21, span=2.0, first=0.0, size=0.15):
    t = np.linspace(0.0, span, count)
    return Goal(t + first, *sway(t, size))


def model(*entries, robot=UR5, posterior=None):
    return ProgramModel(robot, tuple(effect_from_mapping(e) for e in entries), posterior)


def offset(size, joint='elbow_joint'):
    return {'effect': 'joint_offset', 'joint': joint, 'offset': size}


def play(width, joint='shoulder_pan_joint'):
    return {'effect': 'backlash', 'joint': joint, 'width': width}


def sure(position=1e-5, low=-4.0, high=4.0):
    """Return a posterior that is alike everywhere, recorded between two angles of every joint."""
    domain = Domain(UR5.joint_names, (((low, high),),) * 6, (0.02,) * 6, (True,) * 6)
    rest = Discrepancy(position, 1e-6, np.zeros(6), np.zeros(6), 1.0)
    return Posterior(Directions((), 1, ()), np.zeros(0), np.zeros((0, 0)), rest, domain)


def test_a_model_without_a_posterior_promises_nothing_and_finds_nothing_outside():
    plain, motion = model(offset(5e-4)), JointMotion(np.arange(3.0), np.full((3, 6), 2.0))
    assert plain.drawn(None, motion) is None
    assert plain.outside(motion) == plain.postures_outside(motion.q) == []
    assert plain.recorded(motion.q).tolist() == [True] * 3
    learned = model(offset(5e-4), posterior=sure(high=1.4))
    assert learned.outside(motion) and learned.postures_outside(motion.q)
    assert not learned.recorded(motion.q).any()


@settings(max_examples=6, deadline=None)
@given(
    st.sampled_from(list(HOMES)),
    st.lists(st.floats(-1.0, 1.0), min_size=4, max_size=4),
    st.integers(2, 12),
)
def test_the_real_arm_goes_where_the_goal_meant_at_every_point(name, sizes, count):
    robot = load(name)
    data = robot.to_mapping()
    a, b, c, d = sizes
    joints = data['joints']
    joints[1]['theta_offset'] += 4e-4 * a
    joints[2]['a'] += 2e-4 * b
    joints[3]['d'] += 2e-4 * c
    joints[0]['alpha'] += 3e-4 * d
    real, names = Robot.from_mapping(data), robot.joint_names
    found = model(
        offset(4e-4 * a, names[1]),
        {'effect': 'link_length', 'joint': names[2], 'da': 2e-4 * b},
        {'effect': 'link_offset', 'joint': names[3], 'dd': 2e-4 * c},
        {'effect': 'link_twist', 'joint': names[0], 'dalpha': 3e-4 * d},
        robot=robot,
    )
    asked = goal(count, size=0.05)
    asked = asked._replace(q=asked.q - HOME + HOMES[name])
    out = corrected_goal(found, asked)
    assert not isinstance(out, Refusal), out
    meant, got = forward(robot, asked.q), forward(real, out.goal.q)
    assert np.abs(got - meant).max() < 1e-9
    recording = Recording('goal', JointMotion(asked.t, asked.q, asked.qd))
    same = compensate(robot, found.effects, recording)
    assert np.abs(out.goal.q - same.motion.q).max() < 1e-9
    np.testing.assert_array_equal(out.goal.t, asked.t)


def test_velocities_and_accelerations_are_those_of_the_corrected_motion():
    found = model(offset(1e-3), {'effect': 'link_twist', 'joint': 'elbow_joint', 'dalpha': 1e-3})
    out = corrected_goal(found, goal())
    h = 1e-3
    beside = [corrected_goal(found, Goal(goal().t + 1.0, sway(goal().t + s)[0])) for s in (-h, h)]
    low, high = (each.goal.q for each in beside)
    speed, bend = (high - low) / (2 * h), (high - 2 * out.goal.q + low) / h**2
    # What is added changes by 1e-4 a second; without it both would be off by that.
    assert np.abs(out.goal.qd - goal().qd).max() > 1e-5
    np.testing.assert_allclose(out.goal.qd, speed, atol=3e-7)
    np.testing.assert_allclose(out.goal.qdd, bend, atol=3e-6)
    assert np.abs(out.goal.qd[0]).max() < 1e-12
    plain = corrected_goal(found, Goal(goal().t, goal().q)).goal
    assert plain.qd is None
    assert plain.qdd is None


@pytest.mark.parametrize('kinds', [1, 2, 3])
def test_a_controller_goes_straight_cubic_or_quintic(kinds):
    asked = Goal(*goal(6)[: kinds + 1])
    at = np.linspace(0.0, 2.0, 41)
    way = course(asked, at)
    for i in range(6):
        knots = np.stack([values[:, i] for values in asked[1 : kinds + 1]], axis=1)
        curve = BPoly.from_derivatives(asked.t, knots)
        np.testing.assert_allclose(way.q[:, i], curve(at), atol=1e-12)
        inner = ~np.isin(at, asked.t)
        np.testing.assert_allclose(way.qd[inner, i], curve(at, 1)[inner], atol=1e-10)
        np.testing.assert_allclose(way.qdd[inner, i], curve(at, 2)[inner], atol=1e-9)


def through_a_gap(q, width, middle):
    """Return what a joint does behind a gap, one sample after the other."""
    out, at = [], middle
    for value in q:
        at = min(max(at, value - width / 2), value + width / 2)
        out.append(at)
    return np.array(out)


@settings(max_examples=6, deadline=None)
@given(st.floats(2e-4, 1.2e-3), st.sampled_from([-1.0, 0.0, 1.0]))
def test_a_step_of_play_is_spread_over_the_standstill_of_the_turn(width, came):
    t = np.linspace(0.0, 3.0, 376)
    q = np.tile(HOME, (t.size, 1))
    q[:, 0] += 0.2 * np.sin(np.pi * t / 1.5 - 0.5 * np.pi)
    qd = np.zeros_like(q)
    qd[:, 0] = 0.2 * np.pi / 1.5 * np.cos(np.pi * t / 1.5 - 0.5 * np.pi)
    limits = GoalLimits(rate=0.2, turn_rate=1.0)
    stands = q[0] + [came * width / 2, 0, 0, 0, 0, 0]
    start = Start(stands, False, np.array([came, 0, 0, 0, 0, 0]))
    out = corrected_goal(model(play(width)), Goal(t, q, qd), limits, start)
    assert not isinstance(out, Refusal), out
    assert not any('play is not' in note for note in out.notes)
    at = np.linspace(0.0, 3.0, 6001)
    way, meant = course(out.goal.later(-out.waits), at), course(Goal(t, q, qd), at)
    begins = q[0, 0]  # where the arm stood, and what it had left of the gap behind it
    off = np.abs(through_a_gap(way.q[:, 0], width, begins) - meant.q[:, 0])
    plain = np.abs(through_a_gap(meant.q[:, 0], width, q[0, 0] - came * width / 2) - meant.q[:, 0])
    assert plain.max() > 0.45 * width
    assert off.max() < 0.3 * width
    away = np.abs(meant.qd[:, 0]) > 0.15
    assert off[away].max() < 1e-9
    assert np.abs(way.qdd[:, 0]).max() < UR5.max_acceleration[0]
    assert np.abs(np.diff((way.q - meant.q)[:, 0])).max() < 0.2 * width  # no step at all


def test_lag_and_delay_are_told_and_left():
    lag = {'effect': 'servo_lag', 'joint': 'elbow_joint', 'time_constant': 0.02}
    late = {'effect': 'time_delay', 'delay': 0.01}
    out = corrected_goal(model(offset(5e-4), lag, late), goal())
    same = corrected_goal(model(offset(5e-4)), goal())
    np.testing.assert_allclose(out.goal.q, same.goal.q, atol=1e-12)
    assert [note.split()[0] for note in out.notes if 'not corrected' in note] == [
        'servo_lag',
        'time_delay',
    ]
    nothing = corrected_goal(model(lag), goal())
    assert nothing.before == 0.0
    np.testing.assert_array_equal(nothing.goal.q, goal().q)


@pytest.mark.parametrize(
    ('asked', 'found', 'limits', 'reason'),
    [
        (goal(), model(offset(5e-3)), None, 'a point would move by'),
        (goal(), model(offset(5e-4)), GoalLimits(length=1e-4), 'at most 0.1 mm'),
        (goal(), model(offset(5e-4)), GoalLimits(turn=1e-4), 'at most 2 mm'),
        (goal(), model(offset(5e-4)), GoalLimits(rate=1e-6), 'would change by up to'),
        (goal(), model(offset(5e-4)), GoalLimits(acceleration=0.1), 'the goal itself breaks'),
        (goal(), model(play(8e-4)), GoalLimits(acceleration=0.26), 'the corrected goal breaks'),
        (goal(), model(offset(5e-4), posterior=sure(high=1.4)), None, 'outside what was recorded'),
        (goal(), model(offset(5e-4), posterior=sure(1e-3)), None, 'less sure of this goal'),
        (
            Goal(goal().t * 0.01, goal().q),
            model(offset(5e-4)),
            None,
            'breaks the limit of velocity',
        ),
    ],
)
def test_a_goal_is_refused_with_its_reason(asked, found, limits, reason):
    out = corrected_goal(found, asked, limits)
    assert isinstance(out, Refusal)
    assert reason in out.reason


def test_a_goal_at_the_edge_of_a_joint_is_refused_where_the_correction_leaves_it():
    asked = goal()
    edge = UR5.upper.copy()
    edge[2] = asked.q[:, 2].max() + 1e-4
    tight = replace(UR5, upper=edge)
    assert not isinstance(corrected_goal(model(offset(5e-4), robot=tight), asked), Refusal)
    out = corrected_goal(model(offset(-5e-4), robot=tight), asked)
    assert isinstance(out, Refusal)
    assert 'the corrected goal breaks the limit of position of elbow_joint' in out.reason
    assert out.largest is not None


@given(st.floats(1e-5, 4e-4))
@settings(max_examples=4, deadline=None)
def test_the_bound_grows_with_what_the_model_is_not_sure_of(size):
    out = corrected_goal(model(offset(2e-3), posterior=sure(size)), goal(), GoalLimits(0.01, 0.1))
    # Of three coordinates of that size each, nine in ten lie within 2.5 of them.
    assert 2.3 * size < out.bound < 2.8 * size


def test_the_bound_is_of_the_largest_distance_on_the_way():
    """A first joint that may be off by a mrad moves the tool by its distance from that joint's axis."""
    turn = effect_from_mapping(offset(0.0, 'shoulder_pan_joint'))
    rest = Discrepancy(0.0, 0.0, np.zeros(6), np.zeros(6), 1.0)
    found = replace(
        sure(),
        directions=Directions((), 1, (turn,)),
        mean=np.zeros(1),
        covariance=np.array([[1e-6]]),
        discrepancy=rest,
    )
    asked = goal(span=4.0, size=0.5)
    out = corrected_goal(model(offset(2e-3), posterior=found), asked, GoalLimits(0.01, 0.1))
    far = np.hypot(*forward(UR5, course(asked, fine_times(asked)).q)[:, :2, 3].T)
    assert far.max() > 1.2 * np.sqrt((far**2).mean())
    # 92 of 100 normal numbers lie within 1.75, give or take what 400 of them tell.
    assert 1.62 < out.bound / (1e-3 * far.max()) < 1.88


def test_no_bound_is_told_of_what_hangs_on_direction_without_a_law():
    sides = [-2e-4, 2e-4]
    curve = {'effect': 'joint_curve', 'joint': 'elbow_joint', 'values': sides, 'over': 'direction'}
    out = corrected_goal(model(offset(2e-3), curve, posterior=sure()), goal())
    assert out.bound is None
    assert any('no bound is told: what elbow_joint loses by direction' in n for n in out.notes)


def test_what_has_no_error_passes_as_it_came():
    out = corrected_goal(model(posterior=sure()), goal())
    assert (out.before, out.largest) == (0.0, (0.0, 0.0))
    np.testing.assert_array_equal(out.goal.q, goal().q)


def test_a_correction_sets_in_before_an_arm_at_rest_leaves():
    found, asked = model(offset(5e-4)), goal()
    limits = GoalLimits(rate=0.01)
    out = corrected_goal(found, asked, limits, Start(asked.q[0]))
    length = np.linalg.norm(out.added[0, :3])
    assert out.waits >= length / 0.01  # the fastest change of what is added
    np.testing.assert_allclose(out.goal.t, asked.t + out.waits)
    there = corrected_goal(found, asked, limits, Start(out.goal.q[0]))
    assert there.waits == 0.0
    given_time = corrected_goal(found, goal(first=1.0), limits, Start(asked.q[0]))
    assert given_time.waits == 0.0
    # What has just arrived, and is to leave from rest, is not given a step either.
    arrived = corrected_goal(found, asked, limits, Start(asked.q[0], moving=True))
    assert arrived.waits == out.waits
    on = Goal(asked.t, *sway(asked.t + 0.5))
    moving = corrected_goal(found, on, limits, Start(on.q[0], moving=True))
    assert moving.waits == 0.0


@pytest.mark.parametrize('moving', [False, True])
@pytest.mark.parametrize('came', [-1.0, 1.0])
def test_what_play_does_where_a_goal_begins_is_foretold(moving, came):
    """The correction of the zero leads out of the gap or back into it, by where the joint came from."""
    width, zero = 8e-4, -6e-4
    asked = goal(size=0.05)
    found = model(play(width), offset(zero, 'shoulder_pan_joint'))
    start = Start(asked.q[0], moving, np.array([came, 0, 0, 0, 0, 0]))
    out = corrected_goal(found, asked, GoalLimits(rate=0.2), start)
    at = fine_times(asked)
    run, meant = course(out.goal.later(-out.waits), at).q, course(asked, at).q
    way = np.concatenate([asked.q[0, 0] + [-came * 0.1, 0.0], run[:, 0]])
    run[:, 0] = through_a_gap(way, width, way[0])[2:] + zero
    apart = (forward(UR5, run) - forward(UR5, meant))[:, :3, 3]
    assert out.after == pytest.approx(np.sqrt((apart**2).sum(axis=1).mean()), rel=1e-6, abs=1e-9)


@pytest.mark.parametrize('first', [0.0, 1.5])
def test_a_single_point_is_corrected(first):
    asked = Goal(np.array([first]), HOME[None], np.zeros((1, 6)))
    out = corrected_goal(model(offset(5e-4)), asked)
    np.testing.assert_allclose(out.goal.q[0] - HOME, [0, 0, -5e-4, 0, 0, 0], atol=1e-12)
    np.testing.assert_array_equal(out.goal.qd, np.zeros((1, 6)))


@pytest.mark.parametrize(
    ('broken', 'said'),
    [
        (Goal(np.zeros(0), np.zeros((0, 6))), 'no point'),
        (Goal(np.zeros(2), np.zeros((2, 6))), 'must increase'),
        (Goal(np.array([-0.1, 0.2]), np.zeros((2, 6))), 'must not be negative'),
        (Goal(np.arange(2.0), np.full((2, 6), np.nan)), 'positions'),
        (Goal(np.arange(2.0), np.zeros((2, 5))), 'positions'),
    ],
)
def test_what_is_no_goal_is_said(broken, said):
    with pytest.raises(DataError, match=said):
        corrected_goal(model(offset(5e-4)), broken)


def test_a_long_goal_is_looked_at_in_bounds():
    asked = Goal(np.array([0.0, 3600.0]), np.stack([HOME, HOME]))
    assert fine_times(asked).size < 2000
