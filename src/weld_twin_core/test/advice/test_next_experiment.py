# Copyright 2026 weld_twin contributors
# SPDX-License-Identifier: Apache-2.0
"""The next measurement separates what the data at hand do not, and says when none can."""

import json
from dataclasses import replace
from itertools import pairwise

import numpy as np
import pytest
from measured_cells import asked, moving, recorded, stations

import weld_twin_core as wt
from weld_twin_core import DataError, JointMotion, Recording, Signal, catalog, effects_from_list
from weld_twin_core.arm.clearance import Space
from weld_twin_core.diagnosis.advice import Limits, chosen_pieces, experiment, next_experiment
from weld_twin_core.diagnosis.advice.candidates import candidates
from weld_twin_core.diagnosis.algebra.fit import fit
from weld_twin_core.diagnosis.algebra.problem import Problem, Scale

NOISE = 2e-5


def known_scale(problem):
    return Scale(NOISE, 2.0 * NOISE, tuple(np.ones(m) for m in problem.samples))


def at_hand(robot, kind=stations, align=('base', 'tool'), **options):
    rng = np.random.default_rng(3)
    return asked(robot, recorded(robot, kind(robot, rng, **options), rng), align=align)


def proposed(robot, problem, model, *alternatives, **limits):
    made = [effects_from_list([entry], robot) for entry in alternatives]
    more = (Limits(**limits),) if limits else ()
    return next_experiment(problem, model, made, known_scale(problem), *more)


SPRING = {'effect': 'joint_compliance', 'joint': 'shoulder_lift_joint', 'compliance': 1e-5}
OFFSET = {'effect': 'joint_offset', 'joint': 'shoulder_lift_joint', 'offset': 5e-4}
FIRST = {'effect': 'joint_offset', 'joint': 'shoulder_pan_joint', 'offset': 1e-3}
BASE = {'effect': 'base_pose', 'rotvec': [0.0, 0.0, 1e-3]}


@pytest.mark.parametrize(
    ('one', 'other', 'words'),
    [
        (FIRST, BASE, 'where the base stands'),
        (
            {'effect': 'joint_offset', 'joint': 'wrist_3_joint', 'offset': 1e-3},
            {'effect': 'tool_pose', 'rotvec': [0.0, 0.0, 1e-3]},
            'measure the tool by itself',
        ),
        (
            {'effect': 'link_offset', 'joint': 'shoulder_lift_joint', 'dd': 1e-3},
            {'effect': 'link_offset', 'joint': 'elbow_joint', 'dd': 1e-3},
            'mends both',
        ),
    ],
)
@pytest.mark.parametrize('kind', [stations, moving])
def test_what_no_motion_tells_apart_is_said_with_what_would(ur5, kind, one, other, words):
    found = proposed(ur5, *at_hand(ur5, kind, align=()), one, other)
    assert found['kind'] == 'outside' and found['motion'] is None
    assert found['sentence'].startswith('No motion tells') and words in found['sentence']


def test_spring_against_offset_asks_for_a_measurement_that_tells_them_apart(ur5):
    # Stations within a few degrees: the load torque hardly changes, a spring looks like an offset.
    problem, model = at_hand(ur5, size=0.05)
    found = proposed(ur5, problem, model, SPRING, OFFSET)
    assert found['expected_separation_sigma'] > 3.0
    after, before = (
        left_by_the_wrong_one(ur5, p, m) for p, m in (with_motion(ur5, found), (problem, model))
    )
    assert after > 3.0 > before


def with_motion(robot, found):
    """Return the proposed measurement made on an arm that has the spring."""
    rng = np.random.default_rng(4)
    motion = found['motion']
    joints = JointMotion(np.array(motion['t']), np.array(motion['q']), static=motion['static'])
    if found['kind'] == 'payload_swap':
        robot = replace(robot, payload_mass=robot.payload_mass + 5.0)
    return asked(robot, Recording('next', joints, recorded(robot, joints, rng).measured))


def left_by_the_wrong_one(robot, problem, model, there=SPRING, wrong=OFFSET):
    """Return how much worse the wrong effect fits than the one that is there, in deviations."""
    rng = np.random.default_rng(5)
    truth = effects_from_list([there], robot)
    made = tuple(
        recorded(model.robot, r.joints, rng, truth)
        if r.joints.static
        else replace(r, measured=recorded(model.robot, r.joints, rng, truth).measured)
        for r in problem.recordings
    )
    real = Problem(made, problem.align)
    scale = known_scale(real)
    costs = [
        fit(real, model.with_found(effects_from_list([entry], robot)), scale).rss
        for entry in (wrong, there)
    ]
    return float(np.sqrt(max(costs[0] - costs[1], 0.0)))


def test_effects_of_speed_ask_stations_for_motion_and_creeping_for_time(ur5):
    late = {'effect': 'time_delay', 'delay': 5e-3}
    lag = {'effect': 'servo_lag', 'joint': 'shoulder_lift_joint', 'time_constant': 5e-3}
    found = proposed(ur5, *at_hand(ur5), late, lag)
    assert found['kind'] == 'path' and not found['motion']['static']
    creep = {'effect': 'drift', 'xyz_rate': [2e-8, 0.0, 0.0]}
    found = proposed(ur5, *at_hand(ur5), creep, BASE)
    assert found['kind'] == 'warm_up'


def test_what_comes_with_time_is_foreseen_for_the_stations_as_they_are_run(ur5):
    wear = {'effect': 'wear', 'rate': 4e-7}
    drift = {'effect': 'drift', 'xyz_rate': [0.0, 0.0, 1e-8]}
    problem, model = at_hand(ur5, align=())
    found = proposed(ur5, problem, model, wear, drift, minutes=5.0, set_up=False)
    # Stations of another place in the row would be foreseen with the time of that place.
    assert found['motion']['static'] and found['stations'] > 5
    parted = left_by_the_wrong_one(ur5, *with_motion(ur5, found), wear, drift)
    assert 0.5 < parted / found['expected_separation_sigma'] < 2.0


@pytest.mark.parametrize(('kind', 'wanted'), [(stations, 'bidirectional'), (moving, 'path')])
def test_an_unknown_cause_asks_for_more_than_was_seen(ur5, kind, wanted):
    problem, model = at_hand(ur5, kind)
    found = next_experiment(problem, model, [()], known_scale(problem))
    assert found['kind'] == wanted and found['expected_separation_sigma'] is None


@pytest.mark.parametrize('kind', [stations, moving])
def test_what_needs_temperature_and_wrench_is_foreseen_with_those_recorded(ur5, kind):
    problem, model = at_hand(ur5, kind)
    t = problem.recordings[0].joints.t
    sides = {
        'temperature': Signal(t, np.linspace(25.0, 31.0, t.size)),
        'wrench': Signal(t, np.tile([0.0, 0.0, -40.0, 0.0, 0.0, 0.0], (t.size, 1))),
    }
    problem = replace(problem, recordings=(replace(problem.recordings[0], **sides),))
    found = proposed(
        ur5,
        problem,
        model,
        {'effect': 'thermal_growth', 'coefficient': 1e-5},
        {'effect': 'cartesian_compliance', 'compliance': [1e-6, 1e-6, 1e-6]},
    )
    assert found['motion'] is not None and 'skipped' not in found


def test_a_measurement_that_cannot_be_foreseen_is_skipped_with_the_reason(ur5, monkeypatch):
    def planned(*given):
        if given[5].kind == 'path':
            raise DataError('nothing is known of it')
        return chosen_pieces.planned(*given)

    monkeypatch.setattr(experiment, 'planned', planned)
    late = {'effect': 'time_delay', 'delay': 5e-3}
    found = proposed(ur5, *at_hand(ur5, moving), late, OFFSET)
    assert found['kind'] != 'path'
    assert found['skipped'] == ['path: nothing is known of it']


@pytest.mark.parametrize('name', ['ur5', 'abb_irb120', 'franka_panda'])
def test_motions_are_plain_numbers_within_the_limits_of_the_robot(name):
    robot = catalog.load(name)
    joint = robot.joint_names[1]
    pairs = (
        ({**SPRING, 'joint': joint}, {**OFFSET, 'joint': joint}),
        ({'effect': 'time_delay', 'delay': 5e-3}, {**OFFSET, 'joint': joint}),
    )
    for one, other in pairs:
        found = proposed(robot, *at_hand(robot), one, other)
        motion = json.loads(json.dumps(found))['motion']
        q = np.array(motion['q'])
        assert q.shape == (len(motion['t']), robot.n) and len(q) <= 9000
        assert motion['joint_names'] == list(robot.joint_names)
        robot.check_positions(q)
        if not motion['static']:
            rates = np.abs(np.diff(q, axis=0) / np.diff(motion['t'])[:, None])
            assert (rates <= robot.max_velocity).all()


def test_minutes_and_a_box_are_kept(ur5):
    problem, model = at_hand(ur5)
    low, high = np.array([-0.6, -0.9, 0.05]), np.array([0.9, 0.9, 1.1])
    limits = {'minutes': 2.0, 'set_up': False, 'box': np.array([low, high])}
    found = proposed(ur5, problem, model, SPRING, OFFSET, **limits)
    assert found['robot_minutes'] <= 2.0 and found['cost'] == found['robot_minutes']
    tips = wt.forward(ur5, np.array(found['motion']['q']))[:, :3, 3]
    assert ((tips > low) & (tips < high)).all()


def test_what_is_set_up_counts_among_the_minutes(ur5):
    for minutes in (4.0, 22.0):
        found = proposed(ur5, *at_hand(ur5), SPRING, OFFSET, minutes=minutes)
        assert found['robot_minutes'] <= found['cost'] <= minutes


def test_the_way_from_station_to_station_is_free_too(ur5):
    problem, model = at_hand(ur5)
    box = np.array([[-0.7, -0.9, 0.02], [0.9, 0.9, 1.1]])
    limits = {'minutes': 5.0, 'set_up': False, 'box': box}
    found = proposed(ur5, problem, model, SPRING, OFFSET, **limits)
    q = np.array(found['motion']['q'])
    assert found['motion']['static'] and len(q) == found['stations']
    share = np.linspace(0.0, 1.0, 9)[:, None]
    ways = np.concatenate([a + share * (b - a) for a, b in pairwise(q)])
    seen = problem.recordings[0].joints.q
    assert Space(ur5, seen, box).free(ways).all()


def test_a_seam_that_was_recorded_may_be_run_backward_and_slower(ur5):
    problem, model = at_hand(ur5, moving)
    path = next(c for c in candidates(problem, model, Limits()) if c.kind == 'path')
    seam = problem.recordings[0].joints
    begin, end = seam.q[0], seam.at(np.array([19.9]))[0][0]
    found = [
        (int(np.abs(r.joints.q - end).sum(axis=1).argmin()), r.joints)
        for r in path.recordings[-2:]
    ]
    for k, joints in found:
        # Continuous, from home and back to it, within the joints' speed.
        assert np.abs(joints.q[k] - end).max() < 0.02
        assert np.abs(joints.q - begin).sum(axis=1).min() < 0.02
        assert np.allclose(joints.q[0], joints.q[-1])
        rates = np.abs(np.diff(joints.q, axis=0) / np.diff(joints.t)[:, None])
        assert (rates <= ur5.max_velocity).all()


def test_a_longer_experiment_says_no_less(ur5):
    problem, model = at_hand(ur5, size=0.05)
    told = [
        proposed(ur5, problem, model, SPRING, OFFSET, minutes=minutes, set_up=False)
        for minutes in (0.5, 1.0, 4.0)
    ]
    sigmas = [found['expected_separation_sigma'] for found in told]
    assert sigmas == sorted(sigmas)


def test_nothing_is_asked_without_minutes():
    with pytest.raises(DataError, match='needs minutes'):
        Limits(minutes=0.0)
    with pytest.raises(DataError, match='two corners'):
        Limits(box=np.zeros((2, 3)))


def test_a_box_without_room_for_the_arm_is_told(ur5):
    problem, model = at_hand(ur5)
    far = np.array([[5.0, 5.0, 0.0], [6.0, 6.0, 1.0]])
    with pytest.raises(DataError, match='holds no posture near those recorded'):
        proposed(ur5, problem, model, SPRING, box=far)


def test_of_causes_that_fit_alike_the_next_measurement_parts_two(ur5):
    rng = np.random.default_rng(4)
    spring = effects_from_list([SPRING], ur5)
    # Within a few degrees the load torque hardly changes: a spring looks like an offset.
    told = wt.diagnose([recorded(ur5, stations(ur5, rng, size=0.08), rng, spring)], ur5)
    alike = {(site.effect, site.joint) for group in told.indistinguishable for site in group
             if len(group) > 1}  # fmt: skip
    assert told.status == 'ambiguous' and ('joint_compliance', SPRING['joint']) in alike
    sides = told.next_experiment['between']
    assert all({(e['effect'], e['joint']) for e in side} & alike for side in sides)


def test_what_is_sure_while_a_joint_hardly_moved_is_confirmed_where_that_is_asked():
    robot, noise = wt.load('ur5'), np.random.default_rng(3)
    t = np.arange(0.0, 60.0, 0.02)
    q = np.array([0.1, -1.2, 1.5, -1.0, -1.4, 0.3]) + 0.4 * np.sin(
        np.outer(t, [0.6, 0.5, 0.7, 0.4, 0.9, 0])
    )
    run = wt.Recording('still wrist', wt.JointMotion(t, q))
    seen = wt.Twin(robot, [wt.effects.JointCompliance('elbow_joint', compliance=2e-4)]).poses(run)
    position = seen.position + noise.normal(scale=2e-5, size=seen.position.shape)
    recording = run.with_measured(wt.Measurements(t, position))
    sure = wt.diagnose(recording, robot, limits=Limits(confirm=True))
    assert sure.status == 'identified' and sure.sure and sure.confidence > 0.9
    asked = sure.next_experiment
    assert asked['confirms'] == ['wrist_3_joint'] and 'wrist_3_joint' in asked['reason']
    assert np.ptp(np.array(asked['motion']['q'])[:, 5]) > 0.5
