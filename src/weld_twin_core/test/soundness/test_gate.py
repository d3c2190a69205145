# Copyright 2026 weld_twin contributors
# SPDX-License-Identifier: Apache-2.0
"""Mistakes of data and set-up by kind: named, placed, undone; what gave way is dated."""

from dataclasses import replace

import numpy as np
import pytest
from measured_cells import anywhere, moving, recorded, rejointed, remeasured, stations
from scipy.spatial.transform import Rotation

from weld_twin_core.arm.catalog import load
from weld_twin_core.arm.known_arms import fingerprint
from weld_twin_core.arm.rotation import transform
from weld_twin_core.diagnosis import diagnose
from weld_twin_core.diagnosis.soundness.gate import examine
from weld_twin_core.diagnosis.soundness.mending import Given
from weld_twin_core.effects import REGISTRY, JointCoupling, JointOffset, effects_from_list
from weld_twin_core.effects.dated import of_the_robot
from weld_twin_core.recording import JointMotion


@pytest.fixture
def cell(ur5, rng):
    """Return the robot measured from somewhere else, at stations."""
    real = ur5.with_frames(base=anywhere(rng, 2.0), tool=anywhere(rng, 0.1))
    return recorded(real, stations(ur5, rng), rng)


@pytest.fixture
def run(ur5, rng):
    """Return the same robot in motion, points only, in its own frame."""
    return recorded(ur5, moving(ur5, rng), rng, points=True)


def seen(robot, recording, align=('base', 'tool'), apply=False):
    return examine(Given((recording,), robot, frozenset(align)), apply=apply)


def mended(robot, recording, align=('base', 'tool')):
    """Return what is found and the one mistake in it, and see that it can be undone."""
    found = seen(robot, recording, align, apply=True)
    (item,) = found.unsound
    assert item.applied and found.posed is not None
    assert found.posed[1].mended == (item.sentence,)
    return found, item


def only(robot, recording, align=('base', 'tool')):
    """Return kind and place of the one mistake that is found."""
    _, item = mended(robot, recording, align)
    return item.kind, item.at


def test_one_joint_in_degrees_among_radians(ur5, cell):
    q = cell.joints.q * np.where(np.arange(6) == 3, np.degrees(1.0), 1.0)
    assert only(ur5, rejointed(cell, q)) == ('units', ('wrist_1_joint',))


def test_one_joint_in_degrees_believed_for_all(ur5, cell):
    q = cell.joints.q * np.where(np.arange(6) == 3, 1.0, np.radians(1.0))
    assert only(ur5, rejointed(cell, q)) == ('units', ('wrist_1_joint',))


def test_one_axis_in_millimetres(ur5, cell):
    bad = remeasured(cell, position=cell.measured.position * [1e3, 1, 1])
    assert only(ur5, bad) == ('units', ('instrument',))


def test_joint_3_counted_against_the_ground(ur5, cell):
    q = np.array(cell.joints.q)
    q[:, 2] += q[:, 1]
    assert only(ur5, rejointed(cell, q)) == (
        'coupled_axes',
        ('shoulder_lift_joint', 'elbow_joint'),
    )


def test_a_base_turned_by_half_a_turn_where_it_is_not_fitted(ur5, run):
    bad = remeasured(run, position=run.measured.position * [-1, -1, 1])
    assert only(ur5, bad, align=()) == ('base_turned', ('base',))
    assert not seen(ur5, bad, align=('base',)).unsound


def test_joint_1_off_by_a_turn_is_a_base_that_stands_turned_and_both_are_told(ur5, run):
    bad = rejointed(run, run.joints.q + [np.radians(-90.0), 0, 0, 0, 0, 0])
    _, item = mended(ur5, bad, align=())
    assert (item.kind, item.at) == ('base_turned', ('base',))
    assert item.alike == (('constant_angle', ('shoulder_pan_joint',)),)


def test_a_base_that_stands_turned_axis_onto_axis_is_turned_back(ur5, run):
    turn = Rotation.from_euler('y', -90.0, degrees=True)
    bad = remeasured(run, position=run.measured.position @ turn.as_matrix().T)
    found, item = mended(ur5, bad, align=())
    assert (item.kind, item.at) == ('base_turned', ('base',))
    base = found.given.robot.T_world_base
    np.testing.assert_allclose(base[:3, :3], turn.as_matrix(), atol=1e-12)


def test_few_stations_of_a_coupled_wrist_in_frames_that_are_right_are_sound():
    tool = transform(np.eye(3), np.array([0.02, 0.01, 0.15]))
    robot, rng = load('franka_panda').with_frames(tool=tool), np.random.default_rng(4)
    cause = [JointCoupling('panda_joint5', source='panda_joint4', ratio=-0.01)]
    home = np.clip(rng.uniform(-1.5, 1.5, robot.n), robot.lower + 1, robot.upper - 1)
    one = np.tile(home, (20, 1))
    one[:, -1] += np.linspace(-1.0, 1.0, 20)
    few = home + rng.uniform(-1.0, 1.0, (8, robot.n))
    made = []
    for name, q in (('one joint', one), ('few', few)):
        motion = JointMotion(15.0 * np.arange(len(q)), q, static=True)
        made.append(recorded(robot, motion, rng, cause, sigma=3e-5, points=True, name=name))
    assert not examine(Given(tuple(made), robot)).unsound


def test_a_sibling_that_is_not_bundled_is_another_robot(ur5, cell):
    sibling = replace(ur5, a=ur5.a * [1, 1.04, 1.0, 1, 1, 1], d=ur5.d * [1, 1, 1, 1.1, 1, 1])
    found = seen(sibling, cell, apply=True)
    assert [item.kind for item in found.unsound] == ['other_robot'] and found.posed is None
    assert fingerprint(sibling) != fingerprint(ur5)
    assert fingerprint(replace(ur5, theta=ur5.theta + 2 * np.pi)) == fingerprint(ur5)


def test_velocities_of_one_joint_that_are_zero_while_it_moves(ur5, rng):
    motion = moving(ur5, rng)
    qd = np.gradient(motion.q, motion.t, axis=0)
    qd[:, 4] = 0.0
    bad = recorded(ur5, JointMotion(motion.t, motion.q, qd), rng)
    assert only(ur5, bad) == ('zero_velocities', ('wrist_2_joint',))


def test_measurements_of_another_epoch_are_brought_back(ur5, run):
    late = remeasured(run, t=run.measured.t + 5000.0)
    found = seen(ur5, late, align=(), apply=True)
    assert {item.kind for item in found.unsound} == {'clock'}
    assert found.posed is not None
    both = found.given.recordings[0]
    # The arm's stamps are brought onto the clock of the measurements.
    assert np.abs(both.measured.t - both.joints.t[0] - run.measured.t).max() < 0.02


@pytest.mark.parametrize('which', [[3], [0, 1, 2, 3, 4, 5]])
@pytest.mark.parametrize('kind', [moving, stations])
def test_readings_that_stand_still_while_the_tool_moves(ur5, rng, which, kind):
    good = recorded(ur5, kind(ur5, rng), rng)
    q = np.array(good.joints.q)
    start, end = int(0.4 * len(q)), int(0.6 * len(q))
    q[start:end, which] = q[start, which]
    (item,) = seen(ur5, rejointed(good, q)).unsound
    assert item.kind == 'joints_stuck'
    assert item.at == (('wrist_1_joint',) if len(which) == 1 else ())


def test_a_reading_that_stands_still_in_a_third_of_the_stations_pulls_no_frame_along(ur5, rng):
    real = ur5.with_frames(base=anywhere(rng, 2.0), tool=anywhere(rng, 0.1))
    narrow = stations(ur5, rng)
    q = np.array(narrow.q[:60])
    held = recorded(real, JointMotion(narrow.t[:60], q, None, True), rng)
    q[20:38, 3] = q[20, 3]
    (item,) = seen(ur5, rejointed(held, q)).unsound
    assert (item.kind, item.at) == ('joints_stuck', ('wrist_1_joint',))


def test_a_joint_that_rests_is_not_stuck(ur5, rng):
    motion = moving(ur5, rng)
    q = np.insert(motion.q, 900, np.tile(motion.q[900], (400, 1)), axis=0)
    q[:, 3] = q[0, 3]
    held = recorded(ur5, JointMotion(np.arange(len(q)) / 125.0, q), rng)
    assert not seen(ur5, held).unsound


def test_a_stray_reading_while_the_arm_stands_is_no_stuck_stream(ur5, rng):
    motion = moving(ur5, rng)
    q = np.insert(motion.q, 900, np.tile(motion.q[900], (250, 1)), axis=0)
    held = recorded(ur5, JointMotion(np.arange(len(q)) / 125.0, q), rng)
    position = np.array(held.measured.position)
    standing = np.flatnonzero((held.measured.t > 1000 / 125.0) & (held.measured.t < 1100 / 125.0))
    position[standing[3]] += [0.0, 5e-3, 0.0]
    assert not seen(ur5, held.with_measured(replace(held.measured, position=position))).unsound


SLIPS = {
    'joint_slipped': ({'effect': 'joint_slip', 'joint': 'elbow_joint', 'offset': 1.5e-3}, 4e-4),
    'reflector_jumped': ({'effect': 'tool_slip', 'xyz': [1e-3, -5e-4, 0.0]}, 4e-4),
    'instrument_knocked': ({'effect': 'instrument_knock', 'xyz': [1e-3, 5e-4, 8e-4]}, 4e-4),
}


STILL = ('constant', 'time')
MOVING = [name for name, kind in REGISTRY.items() if kind.traits.depends_on not in STILL]
"""What is not tried where it is about what gave way."""


@pytest.mark.parametrize('kind', SLIPS)
def test_what_gave_way_is_dated_and_named_as_a_cause(ur5, rng, kind):
    entry, _ = SLIPS[kind]
    effects = effects_from_list([{**entry, 'time': 60.5}], ur5)
    robot = ur5.with_frames(tool=anywhere(rng, 0.1))
    bad = recorded(robot, stations(ur5, rng), rng, effects)
    (slip,) = seen(robot, bad).slips
    assert slip.kind == kind and slip.time == 60.5
    found = diagnose([bad], robot, align='base,tool', exclude=MOVING, experiment=False)
    assert [(u.kind, u.applied) for u in found.unsound] == [(kind, True)]
    named = {(f.effect.name, f.effect.site) for f in found.effects}
    assert (entry['effect'], entry.get('joint')) in named
    assert found.shrink.rms_after_m < 0.2 * found.shrink.rms_before_m


def test_what_gave_way_in_one_of_several_recordings_is_told_where_nothing_explains_it(ur5, rng):
    entry = {**SLIPS['joint_slipped'][0], 'time': 60.5}
    plain = recorded(ur5, stations(ur5, rng), rng, name='plain')
    bad = recorded(ur5, stations(ur5, rng), rng, effects_from_list([entry], ur5), name='bad')
    found = examine(Given((plain, bad), ur5, frozenset()))
    assert found.posed is not None and not found.unsound
    problem, model = found.posed
    (item,) = found.refusing_slips(problem, model).unsound
    assert (item.kind, item.at, item.applied) == ('joint_slipped', ('elbow_joint',), False)
    # A model that leaves no step, as where play that the load turns over only looked like one.
    explained = replace(problem, recordings=(plain, replace(plain, name='bad')))
    assert found.refusing_slips(explained, model) is found


def test_where_the_tool_never_turns_a_knock_and_a_jump_are_told_as_alike(ur5, rng):
    q = np.array(stations(ur5, rng).q)
    q[:, [0, 4, 5]] = [0.3, -1.5, 0.2]
    q[:, 3] = -1.0 - q[:, 1] - q[:, 2]
    run = recorded(ur5, JointMotion(np.arange(float(len(q))), q, static=True), rng, points=True)
    step = np.where(run.measured.t[:, None] > 60.0, [2e-3, -1e-3, 1e-3], 0.0)
    (slip,) = seen(ur5, remeasured(run, position=run.measured.position + step), ()).slips
    assert slip.time == 60.5
    kinds = {slip.kind, *(kind for kind, _ in slip.alike)}
    assert {'instrument_knocked', 'reflector_jumped'} <= kinds
    assert 'would look the same' in slip.sentence(run)


def test_links_of_a_sibling_are_told_from_frames_that_are_off(ur5, rng):
    """Six millimetres either way: of an arm's length, and of where it stands."""
    run = recorded(ur5, stations(ur5, rng), rng, points=True)
    told = replace(ur5, a=ur5.a * [1, 1.014, 1.0, 1, 1, 1], name='sibling')
    (item,) = seen(told, run, ()).unsound
    assert item.kind == 'other_robot'
    base = np.array(ur5.T_world_base)
    base[:3, 3] += [6e-3, 0.0, 0.0]
    assert not seen(ur5.with_frames(base=base), run, ()).unsound


def test_sound_recordings_have_nothing_that_gave_way(ur5, cell, run):
    for recording, align in ((cell, ('base', 'tool')), (run, ())):
        found = seen(ur5, recording, align)
        assert found.posed is not None and not found.slips and not found.unsound


def test_a_slip_stays_with_the_robot_and_a_knock_with_its_set_up(ur5):
    entries = [{**entry, 'time': 5.0} for entry, _ in SLIPS.values()]
    left = of_the_robot(effects_from_list(entries, ur5))
    assert [type(effect) for effect in left] == [JointOffset]
    assert left[0].offset == 1.5e-3
