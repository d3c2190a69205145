# Copyright 2026 weld_twin contributors
# SPDX-License-Identifier: Apache-2.0
"""Each way to spoil data is found and named; sound data raise no warning."""

from dataclasses import replace

import numpy as np
import pytest
from measured_cells import anywhere, asked, moving, recorded, rejointed, remeasured, stations

from weld_twin_core.arm import catalog
from weld_twin_core.arm.rotation import matrix_from_quaternion, quaternion_from_matrix
from weld_twin_core.diagnosis.frames.alignment import initial_frames
from weld_twin_core.diagnosis.soundness.evidence import Case
from weld_twin_core.diagnosis.soundness.gate import CHECKS, examine
from weld_twin_core.diagnosis.soundness.mending import Given
from weld_twin_core.diagnosis.soundness.set_up import setup
from weld_twin_core.diagnosis.soundness.slips import Slip
from weld_twin_core.effects import effects_from_list
from weld_twin_core.effects.dated import InstrumentKnock
from weld_twin_core.errors import DataError
from weld_twin_core.recording import JointMotion


def looked_at(robot, *recordings, align=('base', 'tool'), apply=False):
    return examine(Given(tuple(recordings), robot, frozenset(align)), apply=apply)


def findings(robot, *recordings, align=('base', 'tool')):
    return [c for c in looked_at(robot, *recordings, align=align).checks if c.level != 'ok']


def wrong(robot, kind, *recordings, align=('base', 'tool')):
    """Return what is said to be wrong, all of it of one kind."""
    found = looked_at(robot, *recordings, align=align)
    assert found.posed is None
    assert {item.kind for item in found.unsound} == {kind}, found.unsound
    assert not any(item.applied for item in found.unsound)
    return ' '.join(item.sentence for item in found.unsound)


def sentence(robot, name, *recordings, align=('base', 'tool'), level='warning'):
    """Return the one sentence a check says at a level."""
    found = findings(robot, *recordings, align=align)
    chosen = [c.sentence for c in found if c.name == name and c.level == level]
    assert len(chosen) == 1, found
    return chosen[0]


@pytest.fixture
def placed(ur5, rng):
    """Return the robot seen from somewhere else, with its stations."""
    real = ur5.with_frames(base=anywhere(rng, 2.0), tool=anywhere(rng, 0.1))
    return recorded(real, stations(ur5, rng), rng)


@pytest.fixture
def run(ur5, rng):
    """Return the same robot in motion, points only."""
    real = ur5.with_frames(base=anywhere(rng, 2.0))
    return recorded(real, moving(ur5, rng), rng, points=True)


# Mix-ups ---------------------------------------------------------------------------------------


def test_degrees_in_radian_fields_are_named(ur5, placed):
    bad = rejointed(placed, np.degrees(placed.joints.q))
    assert 'in degrees where radians belong' in wrong(ur5, 'units', bad)


def test_positions_in_inches_are_named(ur5, placed):
    bad = remeasured(placed, position=placed.measured.position / 0.0254)
    assert 'inches' in wrong(ur5, 'units', bad)


def test_two_joints_that_count_the_other_way_are_both_named(ur5, placed):
    bad = rejointed(placed, placed.joints.q * [1, -1, 1, 1, -1, 1])
    found = wrong(ur5, 'sign', bad)
    assert 'shoulder_lift_joint' in found and 'wrist_2_joint' in found


def test_the_robot_that_fits_better_is_named(placed):
    assert (
        'the robot is a ur5, not a abb_irb120'
        in wrong(catalog.load('abb_irb120'), 'other_robot', placed).lower()
    )


def test_a_left_handed_frame_is_named(ur5, placed):
    bad = remeasured(placed, position=placed.measured.position * [1, 1, -1])
    assert 'left-handed' in wrong(ur5, 'sign', bad)


def test_two_mix_ups_at_once_are_both_named(ur5, placed):
    bad = rejointed(placed, placed.joints.q * [1, 1, -1, 1, 1, 1])
    bad = remeasured(bad, position=bad.measured.position * 1e3)
    found = looked_at(ur5, bad).unsound
    assert {item.kind for item in found} == {'units', 'sign'}
    assert any('millimetres where metres' in item.sentence for item in found)
    (sign,) = (item for item in found if item.kind == 'sign')
    assert sign.at == ('elbow_joint',) and 'counts the other way' in sign.sentence


def test_an_instrument_frame_nobody_asked_to_align_is_named(ur5, rng):
    seen = recorded(ur5.with_frames(base=anywhere(rng, 2.0)), stations(ur5, rng), rng)
    mended = looked_at(ur5, seen, align=(), apply=True)
    (item,) = mended.unsound
    assert (item.kind, item.at) == ('other', ('base',))
    assert 'with the base fitted' in item.sentence
    assert mended.posed is not None and mended.posed[0].align == {'base'}


def test_a_gap_that_nothing_explains_says_so(ur5, placed, rng):
    bad = rejointed(placed, placed.joints.q[rng.permutation(len(placed.joints.q))])
    assert 'no mix-up' in wrong(ur5, 'other', bad)


@pytest.mark.parametrize(
    ('change', 'words'),
    [
        (lambda turn: np.swapaxes(turn, -1, -2), 'inverted'),
        (
            lambda turn: matrix_from_quaternion(np.roll(quaternion_from_matrix(turn), 1, axis=-1)),
            'w first and read x first',
        ),
    ],
)
def test_orientations_in_another_convention_are_named(ur5, placed, change, words):
    bad = remeasured(placed, rotation=change(placed.measured.rotation))
    assert words in wrong(ur5, 'other', bad)


# Clocks and streams ----------------------------------------------------------------------------


@pytest.mark.parametrize(('late', 'words'), [(0.3, 'late'), (-0.25, 'early')])
def test_clocks_that_are_not_synchronised_are_named_with_the_lag(ur5, run, late, words):
    bad = remeasured(run, t=run.measured.t + late)
    found = wrong(ur5, 'clock', bad)
    said = float(found.split(' ms')[0].split()[-1])
    assert words in found and said == pytest.approx(abs(late) * 1e3, abs=8.0)


@pytest.mark.parametrize(('joint', 'sweep', 'back'), [(1, -0.08, 2.4), (2, 0.07, 2.1)])
def test_play_on_a_way_out_and_back_is_no_clock(ur5, rng, joint, sweep, back):
    """The arm trails behind by half the play both ways: later where it is slower."""
    t = np.arange(0.0, 2.2 + back, 0.008)
    s = np.interp(t, [0.0, 1.2, 2.2, 2.2 + back], [0.0, 1.0, 1.0, 0.0])
    q = np.tile([0.24, -1.05, 1.23, -1.07, -1.27, 0.38], (t.size, 1))
    q[:, joint] += sweep * s**3 * (10.0 - 15.0 * s + 6.0 * s * s)
    real, arm = q.copy(), q[0, joint]
    for k, commanded in enumerate(q[:, joint]):
        arm = float(np.clip(arm, commanded - 1e-3, commanded + 1e-3))
        real[k, joint] = arm
    seen = recorded(ur5, JointMotion(t, real), rng, points=True)
    assert looked_at(ur5, replace(seen, joints=JointMotion(t, q)), align=()).unsound == ()


def test_clocks_that_run_apart_are_named(ur5, run):
    bad = remeasured(run, t=run.measured.t * 1.005)
    assert 'run apart' in wrong(ur5, 'clock', bad)


def test_gaps_jitter_and_rounding_of_stamps_are_noted(ur5, run, rng):
    t = run.measured.t
    gap = run.with_measured(run.measured.take((t < 5.0) | (t > 7.0)))
    assert 'gap(s), the longest 2' in sentence(ur5, 'stamps', gap, level='note')
    jitter = remeasured(run, t=np.sort(t + rng.uniform(-0.008, 0.008, t.size)))
    assert 'irregularly' in sentence(ur5, 'stamps', jitter, level='note')
    rounded = remeasured(run, t=np.round(t, 2))
    assert 'in whole 10 ms' in sentence(ur5, 'stamps', rounded, level='note')


def test_a_recording_given_twice_is_named(ur5, placed):
    again = replace(placed, name='again')
    assert 'run and again hold the same' in sentence(ur5, 'repeats', placed, again)


def test_a_frozen_instrument_is_named(ur5, rng):
    run = recorded(ur5, moving(ur5, rng, size=0.04), rng, points=True)
    held = (np.arange(run.measured.t.size) // 3) * 3
    bad = remeasured(run, position=run.measured.position[held])
    found = [c.sentence for c in findings(ur5, bad) if c.name == 'repeats']
    assert found and 'repeat the one before' in found[0]


def test_smooth_joint_positions_are_noted_as_commanded_and_encoder_counts_are_not(ur5, run):
    assert 'as smooth as a command' in sentence(ur5, 'source of the joints', run, level='note')
    counts = rejointed(run, np.round(run.joints.q / 1e-5) * 1e-5)
    assert not [c for c in findings(ur5, counts) if c.name == 'source of the joints']


# Quantity, motion, outliers --------------------------------------------------------------------


def test_what_cannot_be_worked_with_is_refused_with_the_reason(ur5, placed, run):
    few = placed.with_measured(placed.measured.take(np.arange(2)))
    with pytest.raises(DataError, match='2 measurements give 12 numbers'):
        findings(ur5, few)
    still = rejointed(run, np.tile(run.joints.q[:1], (run.joints.t.size, 1)))
    with pytest.raises(DataError, match='these are not its joint states'):
        findings(ur5, still)
    stuck = remeasured(run, position=np.tile(run.measured.position[:1], (run.measured.t.size, 1)))
    with pytest.raises(DataError, match='the measured tool never does'):
        findings(ur5, stuck)


def test_joints_that_hardly_move_or_never_turn_back_are_named(ur5, rng):
    motion = moving(ur5, rng)
    q = motion.q.copy()
    q[:, 3] = q[0, 3]
    q[:, 4] = np.linspace(0.0, 1.0, len(q))
    seen = recorded(ur5, JointMotion(motion.t, q), rng)
    found = [c.sentence for c in findings(ur5, seen) if c.name == 'motion']
    assert any("'wrist_1_joint'" in s and 'hardly moves' in s for s in found)
    assert any("'wrist_2_joint'" in s and 'never reverses' in s for s in found)


def test_frames_that_the_motion_leaves_open_are_counted(ur5, rng):
    seen = recorded(ur5, moving(ur5, rng, size=0.003), rng)
    found = [c.sentence for c in findings(ur5, seen) if c.name == 'motion']
    assert any('directions of the aligned frames open' in s for s in found)


@pytest.mark.parametrize('kind', [moving, stations])
def test_gross_outliers_are_counted_and_the_worst_is_located(ur5, rng, kind):
    seen = recorded(ur5, kind(ur5, rng), rng)
    position = seen.measured.position.copy()
    bad = [10, 50, 90]
    position[bad] += np.array([[0.01], [0.05], [0.02]])
    found = sentence(ur5, 'outliers', remeasured(seen, position=position), level='note')
    where = 'station 50' if kind is stations else f't = {seen.measured.t[50]:.3f} s'
    assert found.startswith('3 of') and where in found


# The set-up ------------------------------------------------------------------------------------


def spoilt(recording, change):
    """Return the recording with its points moved by (M,) lengths [m] along a fixed direction."""
    along = np.array([0.5, 0.0, 0.3]) / np.hypot(0.5, 0.3)
    return remeasured(recording, position=recording.measured.position + change[:, None] * along)


@pytest.mark.parametrize('kind', ['run', 'placed'])
def test_a_step_of_the_base_is_found_where_it_happened(ur5, request, kind):
    recording = request.getfixturevalue(kind)
    t = recording.measured.t
    when = t[int(0.6 * t.size)]
    bad = spoilt(recording, 5e-4 * (t >= when))
    problem, model = asked(ur5, bad)
    model = initial_frames(problem, model)
    (step,) = Case(problem, model).changes
    assert step.kind == 'instrument_knocked'
    assert step.time == pytest.approx(when, abs=0.02 * t[-1])
    assert step.size == pytest.approx(5e-4, rel=0.1)
    (slip,) = looked_at(ur5, bad).slips
    assert slip.kind == 'instrument_knocked' and slip.time == pytest.approx(when, abs=1.0)
    assert slip.size == pytest.approx(5e-4, rel=0.1)


@pytest.mark.parametrize(('times', 'named'), [(1.5, True), (2.5, False)])
def test_a_step_larger_than_any_gap_shows_did_not_happen(ur5, run, monkeypatch, times, named):
    case = Case(*asked(ur5, spoilt(run, np.full(run.measured.t.size, 5e-4)), align=()))
    largest = float(np.linalg.norm(case.residuals[0][:3], axis=0).max())
    step = Slip(InstrumentKnock(time=5.0), 0, times * largest, 500.0, dated=False)
    monkeypatch.setattr(Case, 'changes', [step])
    assert bool(setup(case)) is named


# No false alarms -------------------------------------------------------------------------------

ORDINARY = {
    'nothing': [],
    'offset': [{'effect': 'joint_offset', 'offset': 0.01}],
    'backlash': [{'effect': 'backlash', 'width': 1e-3}],
    'ripple': [{'effect': 'transmission_ripple', 'amplitude': 3e-4, 'order': 9.0, 'phase': 1.0}],
    'spring': [{'effect': 'joint_compliance', 'compliance': 2e-5}],
    'lag': [{'effect': 'servo_lag', 'time_constant': 0.02}],
    'late': [{'effect': 'time_delay', 'delay': 0.015}],
    'clock': [{'effect': 'clock_rate', 'rate': 9e-5}],
    'drift': [{'effect': 'drift', 'xyz_rate': [2e-5, 0.0, 1e-5]}],
    'base': [{'effect': 'base_pose', 'xyz': [2e-3, 0.0, 1e-3], 'rotvec': [0.0, 3e-3, 0.0]}],
    'tool': [{'effect': 'tool_pose', 'xyz': [2e-3, 0.0, 1e-3], 'rotvec': [0.0, 3e-3, 0.0]}],
}


def on_all_joints(robot, entries):
    """Return the effects, those of a joint on the second and third."""
    whole = ('time_delay', 'clock_rate', 'drift', 'base_pose', 'tool_pose')
    out = []
    for entry in entries:
        sites = (
            [{}]
            if entry['effect'] in whole
            else [{'joint': name} for name in robot.joint_names[1:3]]
        )
        out += [{**entry, **site} for site in sites]
    return effects_from_list(out, robot)


@pytest.mark.parametrize(('name', 'kind'), [('abb_irb120', moving), ('franka_panda', stations)])
def test_ordinary_effects_raise_no_warning(name, kind):
    rng = np.random.default_rng(11)
    robot = catalog.load(name)
    motion = kind(robot, rng)
    for label, entries in ORDINARY.items():
        align = ('base', 'tool') if label in ('nothing', 'lag', 'spring', 'ripple') else ()
        seen = recorded(robot, motion, rng, on_all_joints(robot, entries))
        found = findings(robot, seen, align=align)
        loud = [c for c in found if c.name not in ('motion', 'source of the joints')]
        assert not loud, (label, loud)


def test_every_check_says_something(ur5, placed):
    said = looked_at(ur5, placed).checks
    assert {c.name for c in said} == set(CHECKS)
    assert all(c.level in ('ok', 'note', 'warning') and c.sentence.endswith('.') for c in said)
