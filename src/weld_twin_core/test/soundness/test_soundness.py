# Copyright 2026 weld_twin contributors
# SPDX-License-Identifier: Apache-2.0
"""What is refused, what raises no warning, and what gave way; each mistake: test_kept_findings."""

from dataclasses import replace

import numpy as np
import pytest
from measured_cells import anywhere, asked, moving, recorded, rejointed, remeasured, stations

from weld_twin_core.arm import catalog
from weld_twin_core.arm.known_arms import fingerprint
from weld_twin_core.diagnosis import diagnose
from weld_twin_core.diagnosis.soundness.evidence import Case
from weld_twin_core.diagnosis.soundness.gate import CHECKS, examine
from weld_twin_core.diagnosis.soundness.mending import Given
from weld_twin_core.diagnosis.soundness.set_up import setup
from weld_twin_core.diagnosis.soundness.slips import Slip
from weld_twin_core.effects import REGISTRY, JointOffset, ToolPose, effects_from_list
from weld_twin_core.effects.dated import InstrumentKnock, of_the_robot
from weld_twin_core.errors import DataError
from weld_twin_core.recording import JointMotion, Recording
from weld_twin_core.twin.compensation import commandable
from weld_twin_core.twin.twin import Twin


def looked_at(robot, *recordings, align=('base', 'tool'), apply=False):
    return examine(Given(tuple(recordings), robot, frozenset(align)), apply=apply)


def findings(robot, *recordings, align=('base', 'tool')):
    return [c for c in looked_at(robot, *recordings, align=align).checks if c.level != 'ok']


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


@pytest.mark.parametrize(
    ('samples', 'to'), [([500], 0.0), ([300, 420, 900], 1e6), ([100, 700], 0.3)]
)
def test_a_reading_that_strays_by_itself_is_left_out_and_told(ur5, run, samples, to):
    q = np.array(run.joints.q)
    q[samples, 2] += to + 0.5
    strayed = looked_at(ur5, rejointed(run, q), apply=True)
    said = [check.sentence for check in strayed.checks if check.name == 'joint readings']
    assert len(said) == 1 and 'elbow_joint' in said[0] and 'left out' in said[0]
    (kept,) = strayed.given.recordings
    assert kept.joints.t.size == run.joints.t.size - len(samples)
    assert not strayed.unsound


def test_a_joint_that_turns_back_at_full_speed_does_not_stray(ur5, run):
    """Out and back at one speed, and at rest for most of the time: every turn is a corner."""
    t = run.joints.t
    saw = np.clip(np.abs((t % 8.0) - 1.0), 0.0, 1.0)
    sparse = run.joints.q.copy()
    sparse[:, 2] += saw
    motion = replace(run.joints, t=t[::25], q=sparse[::25], qd=None)
    kept = looked_at(ur5, replace(run, joints=motion), apply=True).given.recordings[0]
    assert kept.joints.t.size == motion.t.size


def test_joints_swept_one_after_the_other_show_the_sign_of_each(ur5, rng):
    home = np.array([0.4, -1.2, 1.4, -1.0, -1.3, 0.3])
    q = np.concatenate([home + np.outer(np.linspace(-0.9, 0.9, 9), row) for row in np.eye(6)])
    real = ur5.with_frames(base=anywhere(rng, 2.0), tool=anywhere(rng, 0.1))
    swept = recorded(real, JointMotion(np.arange(float(len(q))), q, static=True), rng)
    assert not looked_at(ur5, swept).unsound
    turned = rejointed(swept, q * [1, 1, 1, 1, 1, -1])
    (found,) = looked_at(ur5, turned).unsound
    assert (found.kind, found.at) == ('sign', ('wrist_3_joint',))


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


@pytest.mark.parametrize(('times', 'named'), [(1.5, True), (2.5, False)])
def test_a_step_larger_than_any_gap_shows_did_not_happen(ur5, run, monkeypatch, times, named):
    off = 5e-4 * np.array([0.5, 0.0, 0.3]) / np.hypot(0.5, 0.3)
    moved = remeasured(run, position=run.measured.position + off)
    case = Case(*asked(ur5, moved, align=()))
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
SHOWN_MOVING = ('backlash', 'ripple', 'spring', 'lag', 'late', 'clock')
"""Those that are tried on a motion; the others are at stations."""


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


@pytest.mark.parametrize(
    ('name', 'moves', 'motion'),
    [('abb_irb120', True, moving), ('franka_panda', False, stations)],
)
def test_ordinary_effects_raise_no_warning(name, moves, motion):
    rng = np.random.default_rng(11)
    robot = catalog.load(name)
    motion = motion(robot, rng, 10.0) if moves else motion(robot, rng, 60)
    for label, entries in ORDINARY.items():
        if moves != (label in SHOWN_MOVING):
            continue
        align = ('base', 'tool') if label in ('nothing', 'lag', 'spring', 'ripple') else ()
        seen = recorded(robot, motion, rng, on_all_joints(robot, entries))
        found = findings(robot, seen, align=align)
        loud = [c for c in found if c.name not in ('motion', 'source of the joints')]
        assert not loud, (label, loud)


def test_every_check_says_something(ur5, placed):
    said = looked_at(ur5, placed).checks
    assert {c.name for c in said} == set(CHECKS)
    assert all(c.level in ('ok', 'note', 'warning') and c.sentence.endswith('.') for c in said)


def test_an_arm_is_known_by_its_lengths_and_twists_and_no_turn_of_a_zero(ur5):
    sibling = replace(ur5, a=ur5.a * [1, 1.04, 1.0, 1, 1, 1], d=ur5.d * [1, 1, 1, 1.1, 1, 1])
    assert fingerprint(sibling) != fingerprint(ur5)
    assert fingerprint(replace(ur5, theta=ur5.theta + 2 * np.pi)) == fingerprint(ur5)


# What gave way ---------------------------------------------------------------------------------

SLIPS = {
    'joint_slipped': {'effect': 'joint_slip', 'joint': 'elbow_joint', 'offset': 1.5e-3},
    'reflector_jumped': {'effect': 'tool_slip', 'xyz': [1e-3, -5e-4, 0.0]},
    'instrument_knocked': {'effect': 'instrument_knock', 'xyz': [1e-3, 5e-4, 8e-4]},
}


STILL = ('constant', 'time')
MOVING = [name for name, kind in REGISTRY.items() if kind.traits.depends_on not in STILL]
"""What is not tried where it is about what gave way."""


@pytest.mark.parametrize('kind', SLIPS)
def test_what_gave_way_is_dated_and_named_as_a_cause(ur5, rng, kind):
    entry = SLIPS[kind]
    effects = effects_from_list([{**entry, 'time': 60.5}], ur5)
    robot = ur5.with_frames(tool=anywhere(rng, 0.1))
    bad = recorded(robot, stations(ur5, rng), rng, effects)
    (slip,) = looked_at(robot, bad).slips
    assert slip.kind == kind and slip.time(bad) == 60.5
    found = diagnose([bad], robot, align='base,tool', exclude=MOVING, experiment=False)
    assert [(u.kind, u.applied) for u in found.unsound] == [(kind, True)]
    named = {(f.effect.name, f.effect.site) for f in found.effects}
    assert (entry['effect'], entry.get('joint')) in named
    assert found.shrink.rms_after_m < 0.2 * found.shrink.rms_before_m


@pytest.mark.parametrize(
    ('seed', 'entry'),
    [
        (1, {'effect': 'tool_slip', 'xyz': [2e-4, 1e-4, 5e-5]}),
        (3, {'effect': 'instrument_knock', 'xyz': [2e-4, 1e-4, 0.0], 'rotvec': [0.0, 1e-4, 1e-4]}),
        (0, {'effect': 'joint_slip', 'joint': 'elbow_joint', 'offset': 3e-4}),
    ],
)
def test_what_looks_alike_on_a_short_motion_is_weighed_by_all_that_was_measured(ur5, seed, entry):
    rng = np.random.default_rng(seed)
    effects = effects_from_list([{**entry, 'time': 10.5}], ur5)
    motion = moving(ur5, rng, size=0.25)
    bad = recorded(ur5, motion, rng, effects, sigma=4e-5, points=True)
    assert examine(Given((bad,), ur5)).slips[0].others
    found = diagnose([bad], ur5, exclude=MOVING, experiment=False)
    (named,) = [each.effect for each in found.effects]
    assert (named.name, named.site) == (entry['effect'], entry.get('joint'))
    (told,) = found.unsound
    assert told.applied and not told.alike and 'would look the same' not in told.sentence


@pytest.mark.parametrize(
    ('epoch', 'backwards'),
    [(0, False), (1_790_000_000 * 10**9, False), (1_790_000_000 * 10**9, True)],
)
def test_of_several_recordings_those_after_it_have_what_gave_way(ur5, rng, epoch, backwards):
    """The torch is hit in the first of two; in the second it stands so all the time."""
    entry = {**SLIPS['reflector_jumped'], 'time': 60.5}
    day = 86_400 * 10**9
    hit = recorded(ur5, stations(ur5, rng), rng, effects_from_list([entry], ur5), name='hit')
    after = recorded(
        ur5,
        stations(ur5, rng),
        rng,
        effects_from_list([{**entry, 'time': -1.0}], ur5),
        name='after',
    )
    runs = [replace(hit, epoch_ns=epoch), replace(after, epoch_ns=epoch and epoch + day)]
    runs = runs[::-1] if backwards else runs
    found = diagnose(runs, ur5, align='base,tool', exclude=MOVING, experiment=False)
    (named,) = [each.effect for each in found.effects if each.effect.name == 'tool_slip']
    first = found.recordings[0]
    assert first.clock_ns == runs[0].epoch_ns
    assert named.time * 1e9 + first.clock_ns == pytest.approx(epoch + 60.5e9, abs=1e3)
    assert [(u.kind, u.applied) for u in found.unsound] == [('reflector_jumped', True)]
    np.testing.assert_allclose(named.xyz, entry['xyz'], atol=1e-4)


@pytest.mark.parametrize(
    ('kind', 'words'),
    [
        ('joint_slipped', "Joint 'elbow_joint' slipped before later: "),
        (
            'reflector_jumped',
            'The reflector jumped in its nest, or the tool in its holder before ',
        ),
    ],
)
def test_what_gave_way_between_two_recordings_is_told_with_the_later_one(ur5, rng, kind, words):
    slipped = effects_from_list([{**SLIPS[kind], 'time': -1.0}], ur5)
    runs = [
        recorded(ur5, stations(ur5, rng), rng, effects, name=name)
        for name, effects in (('before', ()), ('later', slipped))
    ]
    found = examine(Given(tuple(runs), ur5, frozenset({'base', 'tool'})))
    (slip,), (before, later) = found.slips, found.given.recordings
    assert (slip.kind, slip.effect.name) == (kind, SLIPS[kind]['effect'])
    assert slip.sentence(later).startswith(words)
    assert before.joints.t[-1] <= slip.effect.time <= later.joints.t[0] + later.later


def test_what_slipped_stays_so_and_no_program_is_moved_by_a_knock(ur5, rng):
    entries = [{**entry, 'time': 5.0} for entry in SLIPS.values()]
    slips = effects_from_list(entries, ur5)
    lasting = of_the_robot(slips)
    assert {type(effect) for effect in lasting} == {JointOffset, ToolPose, InstrumentKnock}
    assert [commandable(e) for e in lasting] == [e.name != 'instrument_knock' for e in lasting]
    late = stations(ur5, rng, count=4)
    later = Recording('later', JointMotion(late.t + 5.0, late.q, static=True))
    one, other = (Twin(ur5, effects).poses(later) for effects in (slips, lasting))
    np.testing.assert_allclose(other.position, one.position, atol=1e-12)
    again = effects_from_list([effect.to_mapping() for effect in lasting], ur5)
    first = Recording('first', late)
    np.testing.assert_array_equal(
        Twin(ur5, again).poses(first).position, Twin(ur5, lasting).poses(first).position
    )
