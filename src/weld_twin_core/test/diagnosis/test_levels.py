# Copyright 2026 weld_twin contributors
# SPDX-License-Identifier: Apache-2.0
"""Causes that no effect stands for: where they are, what they depend on, and their curve."""

from types import SimpleNamespace

import numpy as np
import pytest
from small_arm import small_arm

import weld_twin_core as wt
from weld_twin_core.diagnosis.algebra.columns import Columns, Piece
from weld_twin_core.diagnosis.beliefs import Beliefs
from weld_twin_core.diagnosis.evidence import Verdict
from weld_twin_core.diagnosis.levels.curved import no_noise
from weld_twin_core.diagnosis.levels.free_form import Choosing, Member, chosen, worth
from weld_twin_core.diagnosis.unseen.folds import posture_regions, steadiness
from weld_twin_core.diagnosis.unseen.groups import Group
from weld_twin_core.diagnosis.unseen.unseen_stretches import Unseen
from weld_twin_core.effects.curves import JointCurve, basis

NOISE = 2e-5
ELBOW = 2


def motion(seconds: float, seed: int, n: int = 3, step: float = 0.04) -> wt.JointMotion:
    """Return joints that swing at frequencies of their own, within the arm's limits."""
    rng = np.random.default_rng(seed)
    t = np.arange(0.0, seconds, step)
    waves = [
        (rng.uniform(0.3, 0.9), rng.uniform(0.05, 0.3), rng.uniform(0.0, 6.0)) for _ in range(n)
    ]
    centre = np.array([0.3, -1.2, 1.4, -1.0, -1.3, 0.2])
    q = centre[:n] + np.stack([a * np.sin(2 * np.pi * f * t + p) for a, f, p in waves], axis=1)
    return wt.JointMotion(t, q)


def recorded(bend, seed=3, seconds=40.0, robot=None, step=0.04) -> wt.Recording:
    """Return a recording of an arm whose elbow is bent by a function of its angle."""
    robot = robot or small_arm()
    commanded = motion(seconds, seed, robot.n, step)
    q = np.array(commanded.q)
    q[:, ELBOW] += bend(q[:, ELBOW])
    real = wt.Twin(robot).poses(wt.Recording('bent', wt.JointMotion(commanded.t, q)))
    noise = np.random.default_rng(seed + 1).normal(scale=NOISE, size=real.position.shape)
    measured = wt.Measurements(commanded.t, real.position + noise)
    return wt.Recording('bent', commanded, measured=measured)


def bump(angle):
    """Return a dent of one tooth's width in the gear [rad]."""
    return 8e-4 * np.exp(-0.5 * ((angle - 1.5) / 0.12) ** 2)


@pytest.fixture(scope='module')
def dented():
    robot = small_arm()
    exclude = ('transmission_ripple', 'backlash')
    return wt.diagnose(
        recorded(bump), robot, exclude=exclude, holdout=[recorded(bump, seed=9)], experiment=False
    )


def test_a_dent_nobody_has_a_name_for_is_placed(dented):
    assert dented.status == 'unknown'
    cause = dented.causes[0]
    assert cause.place[0][0] == 'elbow_joint'
    assert cause.dependence[0][0] == 'angle'
    assert cause.share > 0.5


def test_by_joint_says_what_the_causes_say(dented):
    shares = dict(dented.where.joints)
    told = {cause.place[0][0]: cause.share for cause in dented.causes}
    elbow = dented.model.robot.joint_names[ELBOW]
    assert dented.where.joints[0][0] == elbow
    assert shares[elbow] == pytest.approx(told[elbow], abs=0.05)
    assert sum(shares.values()) <= sum(cause.share for cause in dented.causes) + 1e-9
    assert dented.where.regimes['static'] > 0.8


def test_its_curve_has_the_shape_of_the_dent_and_shrinks_the_gap_of_another_motion(dented):
    assert {effect.name for effect in dented.model.found} == {'joint_curve'}
    assert dented.shrink.held_out == 'bent'
    assert dented.shrink.ratio < 0.6
    (curve,) = [e for e in dented.model.found if e.channel == 'q']
    angle = np.linspace(1.1, 1.9, 50)
    shape = np.asarray(curve.values) @ basis(curve.knots, angle)
    wanted = bump(angle)
    assert np.corrcoef(shape, wanted)[0, 1] > 0.9


def test_friction_that_wanders_is_placed_though_nothing_predicts_it():
    robot, commanded = small_arm(), motion(30.0, 5)
    rng = np.random.default_rng(6)
    size = np.interp(commanded.t, np.arange(0.0, 32.0, 2.0), rng.normal(scale=6e-4, size=16))
    q = np.array(commanded.q)
    q[:, ELBOW] += size * np.tanh(np.gradient(q[:, ELBOW], commanded.t) / 0.01)
    real = wt.Twin(robot).poses(wt.Recording('rubs', wt.JointMotion(commanded.t, q)))
    noise = rng.normal(scale=NOISE, size=real.position.shape)
    measured = wt.Measurements(commanded.t, real.position + noise)
    told = wt.diagnose(wt.Recording('rubs', commanded, measured=measured), robot, experiment=False)
    assert told.status == 'unknown'
    assert told.causes[0].place[0][0] == 'elbow_joint'
    assert told.causes[0].dependence[0][0] in ('direction', 'time')


def choice(target, ways, *groups):
    """Return a choice of groups of columns that are to explain a target, nothing else fitted."""
    none = np.zeros(0)
    empty = np.zeros((0, target.size))
    columns = Columns((Piece(empty),))
    fitted = Unseen(None, None, ways[0], columns, (), target, lambda: empty, none, none)
    told = [Group(str(k), '', (), np.atleast_2d(g), np.ones(1)) for k, g in enumerate(groups)]
    return Choosing(told, [fitted.by(labels) for labels in ways])


def test_parts_left_out_are_judged_by_fits_of_the_others():
    rng = np.random.default_rng(0)
    columns, target = rng.normal(size=(3, 40)), rng.normal(size=40)
    labels = np.repeat(np.arange(4), 10)
    (got,) = choice(target, [labels], columns).errors([Member(0, 0.5)])
    for k in range(4):
        fit, judge = labels != k, labels == k
        a = columns[:, fit]
        x = np.linalg.solve(a @ a.T + 0.5 * np.eye(3), a @ target[fit])
        left = target[judge] - x @ columns[:, judge]
        assert got[k] == pytest.approx(left @ left)


def test_a_steady_fall_counts_more_than_one_lucky_fold():
    before = np.full(8, 2.0)
    steady = before - 0.5 + 0.01 * np.arange(8)
    lucky = before.copy()
    lucky[3] -= 4.0
    assert steadiness(before, steady) > 10.0
    assert steadiness(before, lucky) == pytest.approx(1.0)
    assert steadiness(steady, before) < 0.0


def test_regions_of_posture_hold_as_many_and_lie_apart():
    recording = recorded(bump)
    problem = wt.diagnosis.algebra.problem.Problem((recording,))
    labels = posture_regions(problem)[::3]
    counts = np.bincount(labels)
    assert counts.size == 8
    assert counts.max() - counts.min() <= 3
    q = recording.joints.q
    widest = int(np.argmax(np.ptp(q, axis=0)))
    low, high = q[labels < 4, widest], q[labels >= 4, widest]
    assert low.max() <= high.min() + 1e-9


@pytest.mark.parametrize(
    ('change', 'words'),
    [
        ({'over': 'colour'}, 'over must be one of'),
        ({'knots': [0.0, 0.0, 1.0]}, 'increasing numbers'),
        ({'knots': [0.0, 1.0]}, 'every knot needs its value'),
        ({'channel': 'tau'}, 'channel must be one of'),
    ],
)
def test_a_curve_that_is_none_is_refused_in_a_sentence(change, words):
    values = {'values': [0.0, 1e-4, 0.0], 'knots': [0.0, 1.0, 2.0]} | change
    with pytest.raises(wt.ModelError, match=words):
        wt.Twin(small_arm(), [JointCurve('elbow_joint', **values)])


@pytest.mark.parametrize(
    ('gain', 'steady', 'status'), [(0.16, 2.1, 'unknown'), (0.14, 9.0, 'none'), (0.9, 1.9, 'none')]
)
def test_a_gap_that_something_predicts_is_no_noise(gain, steady, status):
    part = SimpleNamespace(group='tool, depending on load')
    alternative = SimpleNamespace(form=SimpleNamespace(parts=(part,), gain=gain, steady=steady))
    nothing = Verdict('none')
    verdict = no_noise(nothing, alternative, Beliefs())
    assert verdict.status == status
    assert (verdict == nothing) or 'tool, depending on load' in verdict.reasons[0]


def test_what_groups_are_worth_adds_up():
    rng = np.random.default_rng(4)
    columns = rng.standard_normal((2, 600))
    target = 2.0 * columns[0] + columns[1] + 0.5 * rng.standard_normal(600)
    work = choice(target, [np.arange(600) % 10], *columns)
    shares, gain, _ = worth(work, [Member(0, 1e-3), Member(1, 1e-3)])
    assert sum(shares) == pytest.approx(gain)
    assert gain == pytest.approx(5.0 / 5.25, abs=0.02)
    assert shares[0] / shares[1] == pytest.approx(4.0, rel=0.3)


def picked(target, ways, *groups):
    """Return which of some groups of columns are chosen."""
    work = choice(target, ways, *groups)
    return sorted(member.group for member in chosen(work, Beliefs()))


def test_what_carries_over_in_time_alone_is_not_chosen():
    rng = np.random.default_rng(8)
    regions, minutes = np.repeat(np.arange(6), 500), np.arange(3000) % 10
    bent, small = rng.standard_normal((2, 3000))
    # One shape a region: known from the minutes before and after, and of no use elsewhere.
    shapes = np.where(regions == np.arange(6)[:, None], bent, 0.0)
    target = bent + 0.2 * small + 0.1 * rng.standard_normal(3000)
    both = np.concatenate([shapes, small[None]])
    assert picked(target, [minutes], both) == [0]
    assert picked(target, [minutes, regions], both) == []
    assert picked(target, [minutes, regions], bent) == [0]


def test_what_stood_in_for_two_goes_once_both_are_there():
    rng = np.random.default_rng(9)
    one, other, noise = rng.standard_normal((3, 600))
    stand_in = one + other + 0.5 * noise
    target = one + other + 0.05 * rng.standard_normal(600)
    ways = [np.arange(600) % 10, np.repeat(np.arange(6), 100)]
    assert picked(target, ways, stand_in) == [0]
    assert picked(target, ways, stand_in, one, other) == [1, 2]


def test_a_wrong_unit_that_no_effect_stands_for_is_placed_at_the_instrument():
    robot = wt.load('ur5')  # three joints can do what the instrument does
    recording = recorded(lambda angle: 0.0 * angle, seconds=8.0, robot=robot, step=0.02)
    measured = recording.measured
    stretched = wt.Measurements(measured.t[::2], 1.0004 * measured.position[::2])
    told = wt.diagnose(
        recording.with_measured(stretched), robot, exclude=['measurement_scale'], experiment=False
    )
    assert told.status == 'unknown'
    assert (told.causes[0].place[0][0], told.causes[0].dependence[0][0]) == ('instrument', 'place')
    assert told.unexplained.structure[0] == 'place at instrument'
    assert sum(share for _, share in told.where.joints) < 0.5 * told.causes[0].share


def at_stations(name, seed, places, *, count=60, noise=3e-5):
    """Return the diagnosis of stations of an arm; a function tells where its tool really is."""
    robot, rng = wt.load(name), np.random.default_rng(seed)
    t = 20.0 * np.arange(count)
    q = rng.uniform(-1.5, 1.5, (t.size, robot.n))
    commanded = wt.Recording('stations', wt.JointMotion(t, q, static=True))
    there = places(robot, commanded) + [2.1, -1.3, 0.4]
    seen = wt.Measurements(t, there + rng.normal(scale=noise, size=there.shape))
    return wt.diagnose(commanded.with_measured(seen), robot, align='base,tool', experiment=False)


def test_how_a_set_up_moved_is_no_cause_of_its_own():
    """An instrument whose scale comes and goes is placed over time; nothing moved at an instant."""

    def stretched(robot, commanded):
        still = wt.Twin(robot).poses(commanded).position
        share = 1.2e-4 * np.sin(2.0 * np.pi * commanded.joints.t / 900.0)[:, None]
        return still + share * (still + [2.1, -1.3, 0.4])

    found = at_stations('kuka_iiwa14', 2, stretched, count=50)
    assert any(effect.traits.of_setup and not effect.traits.bends for effect in found.model.found)
    cause, *others = found.causes
    assert cause.place[0][0] == 'base' and cause.dependence[0][0] == 'time'
    assert [site.effect for site, _ in cause.name] == ['frame_curve']
    assert not any(other.name for other in others)


def test_a_set_up_that_hardly_moved_is_told_of_no_gap():
    """A zero swings as the hall does; a step of the base takes up a little of what its curve misses."""

    def swinging(robot, commanded):
        q = np.array(commanded.joints.q)
        q[:, 2] += 6e-4 * np.sin(2.0 * np.pi * commanded.joints.t / 1200.0)
        there = wt.JointMotion(commanded.joints.t, q, static=True)
        return wt.Twin(robot).poses(wt.Recording('real', there)).position

    found = at_stations('ur5', 4, swinging)
    assert any(effect.traits.of_setup for effect in found.model.found)
    (cause,) = found.causes
    assert cause.place[0][0] == 'elbow_joint' and cause.dependence[0][0] == 'time'


def test_a_base_that_leans_to_one_side_alone_is_no_instrument():
    def leaning(robot, commanded):
        # About x the base gives only where the arm pulls it to its left.
        still = wt.Twin(robot).poses(commanded).position
        gives = wt.effects.PedestalTilt(compliance=(8e-6, 0.0))
        leans = wt.Twin(robot, [gives]).poses(commanded).position - still
        return still + leans * (still[:, 1:2] > 0.0)

    found = at_stations('kuka_iiwa14', 3, leaning, noise=2e-5)
    large = [cause for cause in found.causes if cause.share > 0.1]
    assert {cause.place[0][0] for cause in large} == {'base'}
    assert {cause.dependence[0][0] for cause in large} == {'load'}


def test_a_loose_tool_that_falls_to_its_lower_side_is_no_noise():
    def fallen(robot, commanded):
        poses = wt.Twin(robot).poses(commanded)
        side = poses.rotation[:, :, 0]
        return poses.position - 2.5e-4 * side * np.sign(side[:, 2:])

    found = at_stations('ur5', 4, fallen)
    assert found.status == 'unknown' and 'load at tool' in found.unexplained.structure
    places = {(cause.place[0][0], cause.dependence[0][0]) for cause in found.causes}
    assert places == {('tool', 'load')}
    # One that sags takes most of it, and is no name to be sure of.
    assert not any(cause.sure for cause in found.causes if cause.name)


def test_what_is_far_wider_than_noise_is_told_as_above_it():
    """A dent at one angle of a joint, seen at stations where nothing shows the noise by itself."""

    def dented(robot, commanded):
        q = np.array(commanded.joints.q)
        q[:, 1] += 1.2e-3 * np.exp(-0.5 * ((q[:, 1] - 0.4) / 0.15) ** 2)
        there = wt.JointMotion(commanded.joints.t, q, static=True)
        return wt.Twin(robot).poses(wt.Recording('real', there)).position

    found = at_stations('kuka_iiwa14', 6, dented)
    assert found.status == 'unknown' and found.unexplained.above_noise
    (cause,) = found.causes
    joint = found.model.robot.joint_names[1]
    assert (cause.place[0][0], cause.dependence[0][0]) == (joint, 'angle')
