# Copyright 2026 weld_twin contributors
# SPDX-License-Identifier: Apache-2.0
"""The judge of mix-ups, and the pieces of the checks, each held against numbers worked out by hand."""

from dataclasses import replace
from types import SimpleNamespace

import numpy as np
import pytest
from measured_cells import asked, moving, recorded, rejointed, stations

from weld_twin_core import JointMotion, catalog, diagnose
from weld_twin_core.diagnosis.algebra.problem import Change
from weld_twin_core.diagnosis.soundness import mixups as mix_ups
from weld_twin_core.diagnosis.soundness.computed import _rounding, _stations
from weld_twin_core.diagnosis.soundness.evidence import Case, mistake
from weld_twin_core.diagnosis.soundness.gate import examine
from weld_twin_core.diagnosis.soundness.images import _too_large_along
from weld_twin_core.diagnosis.soundness.mending import Given
from weld_twin_core.diagnosis.soundness.mixups import _best, _borne
from weld_twin_core.diagnosis.soundness.set_up import _with_tools, _words, parted, setup
from weld_twin_core.diagnosis.soundness.slips import (
    Slip,
    _of_strays,
    _scale,
    _simplest,
    changes,
    rest_of,
)
from weld_twin_core.diagnosis.soundness.snapshot import Snapshot, of_joints
from weld_twin_core.diagnosis.soundness.stamps import streams
from weld_twin_core.diagnosis.soundness.suspicions import suspicions
from weld_twin_core.effects import JointCompliance, JointOffset
from weld_twin_core.effects.dated import InstrumentKnock, JointSlip
from weld_twin_core.effects.geometry import LinkLength, LinkOffset, LinkTwist, ToolPose


@pytest.fixture
def still(ur5, rng):
    return recorded(ur5, stations(ur5, rng, 40), rng, points=True)


def some(robot, *words):
    """Return the suspicions that say one of these."""
    return [s for s in suspicions(robot) if any(word in s.sentence for word in words)]


# The judge --------------------------------------------------------------------------------------


def test_of_mix_ups_that_do_as_well_the_first_of_the_table_is_named_and_the_others_are_alike(
    ur5, still
):
    """Half a turn of joint 1 is half a turn of the base; its sign, or joint 4, is neither."""
    turned = rejointed(still, still.joints.q + [np.pi, 0, 0, 0, 0, 0])
    shot = Snapshot((turned,), asked(ur5, turned, align=())[1], frozenset())
    arm = shot.arm
    assert arm.bent < 1.0 < arm.displaced
    pan, elbow = some(ur5, "'shoulder_pan_joint' lies +180", "'elbow_joint' lies +180")
    again = pan._replace(sentence='the same in other words', kind='base_turned', at=('base',))
    best = _best(shot, arm, [elbow, pan, again])
    assert best.suspicion is pan and best.alike == (again,) and best.off < 1.0
    assert _best(shot, arm, [elbow]) is None and _best(shot, arm, []) is None
    assert best.undone.remaining < 1e-4 < shot.remaining


def test_a_joint_counted_from_the_ground_is_told_where_one_joint_moves_at_a_time(rng):
    """Its reading stands still while it moves with joint 2, and a swap leaves a tenth of the gap."""
    robot = catalog.load('fanuc_m10ia')
    bases = [(-40, 0), (-40, 5), *((-35, 5 - 5 * k) for k in range(10))]
    postures = [np.array([-35.0, two, three, 2, -56, -33]) for two, three in bases]
    pendant = np.radians([p + step for p in postures for step in [np.zeros(6), *np.eye(6)]])
    turned = pendant + pendant[:, [1]] * np.eye(6)[2]
    motion = JointMotion(np.arange(len(turned), dtype=float), turned, None, True)
    tool = ToolPose([0.2, -0.21, 0.01])
    swept = recorded(robot, motion, rng, (tool,), points=True)
    (told,) = diagnose([rejointed(swept, pendant)], robot, align=('base', 'tool')).unsound
    assert told.kind == 'coupled_axes' and told.at == ('joint_2', 'joint_3')


def test_what_nearly_as_many_numbers_as_coordinates_leave_of_noise_says_nothing_of_the_links(
    ur5, rng
):
    """Thirty-three numbers leave half of the noise of twelve stations; ten have no more than thirty."""
    every = of_joints(ur5, (JointOffset, LinkTwist, LinkLength, LinkOffset))
    shots = [
        Snapshot((each,), asked(ur5, each)[1], frozenset({'base', 'tool'}))
        for count in (12, 10)
        for each in [recorded(ur5, stations(ur5, rng, count), rng, sigma=2e-3, points=True)]
    ]
    few, fewer = ((shot, shot.bent(every, 100.0, 1e-4)) for shot in shots)
    assert few[0].gap(few[1]) < 2e-3 < 3e-3 < _borne(*few)
    assert _borne(*fewer) == np.inf and mix_ups._other_links(shots[1]) is None


def test_what_is_known_of_joints_stays_with_the_robot_they_are_of(ur5, still):
    model = replace(
        asked(ur5, still)[1],
        known=(JointOffset('elbow_joint', 1e-3),),
        changes=(Change(1, ToolPose()), Change(1, JointOffset('elbow_joint'))),
    )
    shot = Snapshot((still,), model, frozenset({'base'}))
    (sign,) = some(ur5, "'elbow_joint' counts the other way round")
    same = shot.mended(sign.mend)
    assert same.model.known == model.known and same.model.changes == model.changes
    assert same.align == {'base'}
    (other,) = (s for s in suspicions(ur5) if 'abb_irb120' in s.sentence)
    moved = shot.mended(other.mend)
    assert moved.model.known == () and [type(c.effect) for c in moved.model.changes] == [ToolPose]


def test_a_base_that_is_turned_back_is_that_of_every_recording(ur5, still):
    shot = Snapshot((still,), asked(ur5, still)[1])
    base = np.diag([-1.0, -1.0, 1.0, 1.0])
    turned = shot.mended(lambda given: replace(given, robot=ur5.with_frames(base=base)))
    np.testing.assert_array_equal(turned.model.bases[0], base)


def test_lengths_of_links_count_together_and_the_gap_by_its_limit(ur5, still):
    arm = Snapshot((still,), asked(ur5, still)[1]).arm
    strain = np.zeros(arm.strain.size)
    lengths = [
        k for k, e in enumerate(arm.model.found) if e.name in ('link_length', 'link_offset')
    ]
    strain[lengths[:4]] = 0.4
    assert arm._replace(strain=strain, gap=0.0).bent == pytest.approx(0.8)
    assert arm._replace(strain=strain, gap=3e-3).bent == pytest.approx(3.0)
    strain[0] = 0.9
    assert arm._replace(strain=strain, gap=0.0, displaced=0.95).off == pytest.approx(0.95)


@pytest.mark.parametrize(
    ('gap', 'off', 'still_other', 'told'),
    [
        (5e-3, 0.5, None, 'abb'),
        (5e-3, 1.5, None, 'links'),
        (5e-3, 0.5, 'links', 'links'),
        (3e-3, 0.5, None, None),
    ],
)
def test_another_bundled_robot_is_told_where_its_links_leave_nothing_to_explain(
    monkeypatch, ur5, gap, off, still_other, told
):
    other, robot = (mistake(name, 'other_robot', ('robot',), '') for name in ('links', 'abb'))
    shot, undone = (SimpleNamespace(robot=ur5, align=(), remaining=r) for r in (1.0, 2.0))
    arm = SimpleNamespace(off=off)
    found = {id(shot): other, id(undone): still_other and other}
    monkeypatch.setattr(mix_ups, '_other_links', lambda asked: found[id(asked)])
    tried = mix_ups._Tried(robot, undone, arm)
    monkeypatch.setattr(mix_ups, '_best', lambda *_: tried)
    result = mix_ups._links(SimpleNamespace(gap=gap), shot, arm)
    assert [each.sentence.rstrip('.').lower() for each in result] == ([told] if told else [])


def test_tools_that_sit_elsewhere_are_listed_and_the_farthest_is_measured():
    far = {
        1: ToolPose((2e-3, 0.0, 0.0)),
        2: ToolPose((0.0, 0.0, 0.0), (0.0, 0.0, 0.06)),
        3: ToolPose((1e-4, 0.0, 0.0)),
    }
    model = SimpleNamespace(changes=[Change(k, effect) for k, effect in far.items()])
    case = SimpleNamespace(recordings=[SimpleNamespace(name=name) for name in 'abcd'])
    words = _words(case, SimpleNamespace(model=model))
    assert 'of b and c sits elsewhere than that of a, c most' in words
    assert words.endswith('away and turned by 3.44 degrees')
    alone = SimpleNamespace(changes=model.changes[:1])
    words = _words(case, SimpleNamespace(model=alone))
    assert words.endswith('of b sits elsewhere than that of a: 2 mm away')


def test_tools_of_recordings_are_found_each_by_itself_and_told_against_the_first(ur5, rng):
    steps = ([0.0, 0.0, 0.0], [3e-3, 0.0, -1e-3], [0.0, 2e-3, 0.0])
    runs = []
    for k, step in enumerate(steps):
        tool = np.array(ur5.T_flange_tool)
        tool[:3, 3] += step
        made = ur5.with_frames(tool=tool)
        runs.append(recorded(made, stations(ur5, rng, 20), rng, name=f'{k}'))
    problem, model = asked(ur5, *runs)
    for change, count in ((JointOffset('elbow_joint'), 1), (ToolPose(), 0)):  # that one is told
        assert len(parted(Case(problem, replace(model, changes=(Change(1, change),))))) == count
    own = _with_tools(Snapshot(tuple(runs), model)).model
    assert [change.recording for change in own.changes] == [1, 2]
    for change, step in zip(own.changes, steps[1:], strict=True):
        assert change.effect.fit.coordinates()[:3] == pytest.approx(step, abs=1e-4)


def test_what_can_be_undone_is_undone_only_where_that_is_asked_for(ur5, rng):
    motion = moving(ur5, rng)
    bad = recorded(ur5, JointMotion(motion.t, motion.q, np.zeros_like(motion.q)), rng, points=True)
    asked_for = examine(Given((bad,), ur5), apply=True)
    (told,) = asked_for.unsound
    assert told.kind == 'zero_velocities' and told.applied and asked_for.posed is not None
    assert asked_for.given.recordings[0].joints.qd is None
    assert asked_for.posed[1].mends == ({'do': 'velocities', 'k': 0},)
    assert asked_for.posed[1].mended == (told.sentence,)
    assert len(asked_for.mistakes) == 1 and len(asked_for.checks) > 10
    left = examine(Given((bad,), ur5))
    assert left.posed is None and not left.unsound[0].applied and not left.mistakes
    assert left.given.recordings[0] is bad and len(left.checks) == 1
    refused = diagnose([bad], ur5).as_dict()
    assert refused['verdict']['status'] == 'unsound' and len(refused['unsound']) == 1
    empty = ('gap', 'where', 'candidates', 'shrink', 'unexplained', 'model', 'posterior')
    assert all(refused[key] is None for key in empty)


# Pieces -----------------------------------------------------------------------------------------


def test_nine_samples_in_ten_tell_the_scale_that_keeps_both_sides_of_a_step():
    part = np.concatenate([np.full((3, 50), 1e-3), np.full((3, 50), 4e-3)])
    scale = _scale([part])
    assert scale.position == pytest.approx(1e-3 / 1.64485, rel=1e-4)
    assert scale.orientation == pytest.approx(4e-3 / 1.64485, rel=1e-4)
    np.testing.assert_array_equal(scale.weights[0], 1.0)
    part[:3, 7] *= 10.0
    weights = _scale([part]).weights[0]
    assert weights[7] == pytest.approx((3.0 / 16.4485) ** 2, rel=1e-4)
    assert (np.delete(weights, 7) == 1.0).all()


def test_a_stray_weighs_as_much_as_three_of_the_usual_size():
    residual = np.tile([0.6, 0.8, 0.0], (21, 1))
    residual[4] *= 12.0
    # Of a recording of points beside it the rows of turns are empty.
    weights = _of_strays(np.concatenate([residual, np.zeros((40, 3))]))
    assert weights[4] == pytest.approx((3.0 / 12.0) ** 2)
    assert (np.delete(weights, 4) == 1.0).all()


@pytest.mark.parametrize(('at', 'found'), [(2, False), (8, True), (71, True), (78, False)])
def test_a_step_is_looked_for_all_but_at_the_very_ends(ur5, rng, at, found):
    run = recorded(ur5, stations(ur5, rng, 80), rng, points=True)
    problem, model = asked(ur5, run, align=())
    part = problem.residuals(model)[0]
    part[:, at:] += np.array([[2e-3], [-2e-3], [1e-3]])
    steps = changes(problem, rest_of([part], problem, model), ur5.joint_names, 0.01)
    times = [step.effect.time for step in steps if isinstance(step, Slip)]
    assert (times == [at - 0.5]) is found


def trial(gain, sure, numbers, effect, whole=100.0):
    """Return a step of a sum of squares, its evidence, and how many numbers it has."""
    rest = SimpleNamespace(residual=np.array([np.sqrt(whole)]))
    change = SimpleNamespace(rest=rest, columns=np.zeros((1, 1, numbers)))
    out = SimpleNamespace(gain=gain, sure=sure, change=change, effect=effect)
    out._replace = lambda others: SimpleNamespace(effect=effect, others=others)
    return out


@pytest.mark.parametrize(
    ('most', 'least', 'named', 'alike'),
    [
        (60.0, 55.0, 'elbow_joint', 1),  # nine tenths of what six numbers explain
        (60.0, 53.0, 'instrument', 0),
        (98.0, 97.0, 'elbow_joint', 1),  # hardly anything is left: twice as much may be
        (98.0, 95.0, 'instrument', 0),
    ],
)
def test_fewer_numbers_that_explain_nearly_as_much_are_simpler(most, least, named, alike):
    knock = trial(most, 40.0, 6, InstrumentKnock())
    slip = trial(least, 30.0, 1, JointSlip('elbow_joint'))
    best = _simplest([knock, slip])
    assert best.effect.at == named and len(best.others) == alike
    assert _simplest([]) is None and _simplest([trial(0.0, 0.0, 6, None)]) is None


@pytest.mark.parametrize(('count', 'enough'), [(8, False), (9, True)])
def test_twice_as_many_numbers_as_are_fitted_tell_that_poses_were_computed(
    ur5, rng, count, enough
):
    """Two frames have twelve numbers; a posture has three."""
    few = recorded(ur5, stations(ur5, rng, count), rng, points=True)
    assert (_stations(few, asked(ur5, few)[1]) is not None) is enough


def test_a_number_that_is_rounded_is_off_by_a_step_over_the_root_of_twelve(ur5, still):
    for digits, step in ((5, 1e-5), (6, 1e-6), (9, 0.0)):
        seen = replace(still.measured, position=still.measured.position.round(digits))
        problem, model = asked(ur5, still.with_measured(seen))
        assert _rounding(problem, model) == pytest.approx(step * np.sqrt(3.0 / 12.0) / 0.7)


def test_stations_have_no_lag(ur5, still):
    case = Case(*asked(ur5, still))
    assert case._lags(case.model, wide=False) == [None] and case.lags == [None]


def test_what_is_seen_too_far_is_so_along_the_sight_of_one_camera_that_stands():
    stands, rides = SimpleNamespace(mount='world'), SimpleNamespace(mount='flange')
    one, other, both = (
        SimpleNamespace(cameras=each) for each in ((stands,), (rides,), (stands, stands))
    )
    np.testing.assert_array_equal(_too_large_along([one])['intrinsics'], [0.0, 0.0, 1.0])
    np.testing.assert_array_equal(_too_large_along([both])['target_scale'], np.ones(3))
    assert all('intrinsics' not in _too_large_along([each]) for each in (other, both))
    assert not _too_large_along([one, None])


@pytest.mark.parametrize(('share', 'mended'), [(0.83, True), (0.77, False)])
def test_streams_nearly_as_long_as_each_other_were_started_together(ur5, rng, share, mended):
    run = recorded(ur5, moving(ur5, rng), rng, points=True)
    t = run.joints.t
    part = run.measured.take(run.measured.t <= t[0] + share * np.ptp(t))
    far = run.with_measured(replace(part, t=part.t + 900.0))
    (found,) = streams(Given((far,), ur5))
    assert found.kind == 'clock' and (found.mend is not None) is mended
    if mended:
        assert found.mend.keywords['late'] == pytest.approx(900.0 + part.t[0] - t[0])
    inside = run.with_measured(replace(part, t=part.t + (t[-1] - part.t[0])))
    assert not streams(Given((inside,), ur5))


def test_a_small_step_of_the_set_up_is_warned_of_and_one_of_a_joint_is_not(ur5, still):
    case = Case(*asked(ur5, still))
    knock = Slip(InstrumentKnock(time=11.5), 0, 2e-4, 90.0, dated=False)
    slip = Slip(JointSlip('elbow_joint', time=11.5), 0, 2e-4, 90.0, dated=False)
    vars(case).update(changes=[knock, slip], largest=1e-3)
    (found,) = setup(case)
    assert found.level == 'warning' and 'were knocked at station 12 of 40' in found.sentence
    assert 'base aligned' in found.sentence
    before = Slip(InstrumentKnock(time=float(still.seen.t[0])), 0, 2e-4, 90.0, dated=False)
    vars(case).update(changes=[before])
    (found,) = setup(case)
    assert found.sentence.startswith('The set-up moved by 0.2 mm before run')


SPRUNG = JointCompliance('shoulder_lift_joint', 4e-5)
HIT = ToolPose((4e-4, 0.0, 0.0), (0.0, 0.0, 0.0))


def of_days(**days):
    """Return what is told of a UR5 with a spring, of 40 stations a day; days say what it has besides."""
    robot, rng = catalog.load('ur5'), np.random.default_rng(3)
    runs = [
        recorded(robot, stations(robot, rng, 40), rng, [SPRUNG, *more], name=name)
        for name, more in days.items()
    ]
    told = diagnose(runs, robot, align='base,tool', experiment=False)
    assert told.effects[0].effect.key == SPRUNG.key
    return told, [one for one in told.checks if one.name == 'tools']


def test_a_tool_that_was_hit_between_two_days_is_a_cause_beside_a_spring():
    told, checks = of_days(one=[], two=[HIT])
    slip = told.effects[1].effect
    assert slip.name == 'tool_slip' and not checks
    np.testing.assert_allclose(slip.xyz, HIT.xyz, atol=3e-5)
    assert told.unsound[0].sentence.endswith('before two: the tool is 0.392 mm off then.')


def test_a_tool_that_was_another_on_one_day_shows_beside_a_spring_once_that_is_found():
    told, (check,) = of_days(one=[], two=[HIT], three=[])
    assert len(told.effects) == 1 and check.level == 'warning'
    assert 'of two sits elsewhere than that of one: 0.39' in check.sentence
