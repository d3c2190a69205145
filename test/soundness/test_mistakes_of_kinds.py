# Copyright 2026 weld_twin contributors
# SPDX-License-Identifier: Apache-2.0
"""Mistakes that end in a sentence and a remedy: of an arm whose chain is not the twin's."""

import json
from dataclasses import replace

import numpy as np
import pytest
from command_line import done
from diagnosis_cells import all_but
from own_arm import Arm, frame, measured, model, motion, stations
from scipy.spatial.transform import Rotation

import weld_twin_core as wt
from weld_twin_core.diagnosis.soundness.gate import examine
from weld_twin_core.diagnosis.soundness.mending import Given
from weld_twin_msgs_py.bags import write_recording
from weld_twin_msgs_py.robots import write_robot_yaml
from weld_twin_nodes.cli import main

TABLE = frame([1.6, -0.9, 0.4], [0.2, -0.3, 1.1])
TOOL = frame([0.02, -0.03, 0.14], [0.3, 0.1, -0.6])


@pytest.fixture
def rng():
    return np.random.default_rng(11)


def looked(*recordings, align=('base', 'tool'), apply=False):
    return examine(Given(recordings, model(), frozenset(align)), apply=apply)


def kinds(*recordings, align=('base', 'tool')):
    return [(item.kind, item.at) for item in looked(*recordings, align=align).unsound]


OTHERS = all_but('joint_offset', 'link_offset', 'tool_pose')


def diagnosed(*recordings, **options):
    """Return what is said of recordings, frames fitted."""
    words = {'align': 'base,tool', 'exclude': OTHERS, 'experiment': False, **options}
    return wt.diagnose(list(recordings), model(), **words).as_dict()


# Tools -----------------------------------------------------------------------------------------

REAL = Arm(base=TABLE, tool=TOOL).off(theta=[0, 0, 4e-3, 0, 0, 0])


def turned(degrees, way=(0.006, -0.01, 0.003)):
    """Return the same arm whose tool was turned about an axis of its own, and moved."""
    axis = np.array([0.3, -0.5, 0.8]) / np.linalg.norm([0.3, -0.5, 0.8])
    return replace(REAL, tool=TOOL @ frame(way, np.radians(degrees) * axis))


def pair(rng, second, **how):
    first = measured(REAL, 5.0 * np.arange(40), stations(rng), rng, name='before', **how)
    other = replace(second, base=frame([0.3, 0.1, -0.2], [0, 0, 0.4]) @ TABLE)
    return first, measured(other, 5.0 * np.arange(40), stations(rng), rng, name='after', **how)


def test_a_tool_that_may_change_and_did_by_millimetres_is_fitted(rng):
    found = diagnosed(*pair(rng, turned(24.0)), may_change='tool_pose')
    (zero,) = found['verdict']['effects']
    assert (zero['effect'], zero['joint']) == ('joint_offset', 'u')
    assert zero['parameters']['offset'] == pytest.approx(4e-3, abs=1e-4)
    (changed,) = found['changed']
    turn = np.linalg.norm(changed['value']['rotvec'])
    assert changed['recording'] == 1 and turn == pytest.approx(np.radians(24.0), abs=2e-3)


def test_a_tool_that_was_changed_without_a_word_is_told_and_fitted(rng):
    found = looked(*pair(rng, turned(8.0), turns=False), apply=True)
    assert found.given.may_change == ('tool_pose',) and found.posed is not None
    (item,) = found.unsound
    assert (item.kind, item.at) == ('reflector_jumped', ('tool',))
    assert 'after' in item.sentence and '--may-change tool_pose' in item.remedy


def test_a_marker_that_only_turned_is_seen_in_its_orientation(rng):
    spun = replace(REAL, tool=TOOL @ frame([0, 0, 0], [0.0, 0.3, 0.1]))
    assert kinds(*pair(rng, spun)) == [('reflector_jumped', ('tool',))]


def test_the_same_tool_on_two_days_is_sound(rng):
    found = looked(*pair(rng, REAL))
    assert not found.unsound
    assert not [check for check in found.checks if check.name == 'tools' and check.level != 'ok']


# Poses that were computed ----------------------------------------------------------------------


def run_of(arm, rng, *, noise=0.0, encoder=2e-5, digits=None, kind=np.float64, **how):
    """Return a motion whose joints an encoder read, and poses of an arm at what was read."""
    t, q = motion()
    q = q + encoder * rng.standard_normal(q.shape)
    made = measured(arm, t, q, rng, noise=noise, at_rest=False, **how)
    seen = made.measured
    position = seen.position.astype(kind).astype(float)
    if digits is not None:
        position = np.round(position, digits)
    return made.with_measured(replace(seen, position=position))


CALIBRATED = Arm().off(
    theta=[1e-3, -2e-3, 1.5e-3, 2e-3, -1e-3, 0.0], a=[2e-4, -6e-4, 3e-4, 0, 0, 0], alpha=[4e-4] * 6
)


@pytest.mark.parametrize('arm', [Arm(), CALIBRATED])
@pytest.mark.parametrize('how', [{}, {'kind': np.float32}, {'digits': 5}, {'turns': False}])
def test_what_a_controller_computes_is_no_measurement(rng, arm, how):
    assert kinds(run_of(arm, rng, **how), align=()) == [('computed', ('instrument',))]


def test_few_postures_tell_that_the_nominal_arm_computed_them_and_nothing_of_another(rng):
    few = [
        measured(arm, 5.0 * np.arange(14), stations(rng, 14), rng, noise=0.0, turns=False)
        for arm in (Arm(), CALIBRATED)
    ]
    assert kinds(few[0]) == [('computed', ('instrument',))]
    assert not kinds(few[1])


def test_computed_poses_with_stamps_of_their_own_belong_to_the_last_joint_state(rng):
    made = run_of(Arm(), rng)
    late = replace(made.measured, t=made.measured.t + 3e-3)
    assert kinds(made.with_measured(late), align=()) == [('computed', ('instrument',))]


@pytest.mark.parametrize('noise', [8e-6, 1e-4])
def test_what_the_best_instrument_measures_is_a_measurement(rng, noise):
    assert not kinds(run_of(CALIBRATED, rng, noise=noise), align=())
    assert not kinds(run_of(CALIBRATED, rng, noise=noise, digits=5), align=())


def test_a_tracker_that_repeats_itself_at_rest_is_a_measurement(rng):
    q = np.repeat(stations(rng, 12), 40, axis=0)
    t = 0.02 * np.arange(len(q))
    made = measured(REAL, t, q, rng, noise=2e-5, at_rest=False)
    held = np.repeat(np.arange(0, len(q), 40), 40)
    still = replace(
        made.measured, position=made.measured.position[held], rotation=made.measured.rotation[held]
    )
    assert not kinds(made.with_measured(still))


def test_a_simulation_without_noise_says_what_it_is(tmp_path):
    (tmp_path / 'e.yaml').write_text('- {effect: joint_offset, joint: elbow_joint, offset: 1e-3}')
    bag, out = str(tmp_path / 'bag'), tmp_path / 'out'
    words = ['--robot', 'ur5', '--effects', str(tmp_path / 'e.yaml'), '--rate', '20']
    assert main(['simulate', *words, '--path', 'line', '--out', bag]) == 0
    assert main(['diagnose', bag, '--robot', 'ur5', '--out', str(out)]) == 0
    found = json.loads((out / 'diagnosis.json').read_text())
    assert found['verdict']['effects'][0]['joint'] == 'elbow_joint'


# Stamps in bursts ------------------------------------------------------------------------------


def buffered(rng, size=6, waited=0.07, without=()):
    """Return 20 Hz points that were sent by sixes, some lost, and the stamps they should have."""
    t, q = motion()
    taken = np.delete(np.arange(0.5, 15.0, 0.05), without)
    whole = np.array([np.interp(taken, t, column) for column in q.T]).T
    seen = measured(REAL, taken, whole, rng, turns=False, at_rest=False).measured
    last = np.minimum((np.arange(taken.size) // size + 1) * size - 1, taken.size - 1)
    sent = taken[last] + waited + 1e-4 * (np.arange(taken.size) % size)
    return wt.Recording('sent', wt.JointMotion(t, q), replace(seen, t=sent)), taken


def test_points_that_waited_in_a_buffer_are_stamped_anew(rng):
    made, taken = buffered(rng)
    found = looked(made, apply=True)
    (item,) = found.unsound
    assert (item.kind, item.at, item.applied) == ('stamps_in_bursts', ('clock',), True)
    assert '20.00 Hz underneath' in item.sentence
    assert np.abs(found.given.recordings[0].measured.t - taken).max() < 2e-3


def test_points_that_were_lost_before_they_waited_are_counted(rng):
    made, taken = buffered(rng, without=[60, 61, 150, 220])
    found = looked(made, apply=True)
    (item,) = found.unsound
    assert item.kind == 'stamps_in_bursts' and '4 were lost' in item.sentence
    off = np.abs(found.given.recordings[0].measured.t - taken)
    assert np.median(off) < 2e-3 and (off < 5e-3).mean() > 0.9


def test_info_tells_the_rate_underneath(rng, tmp_path, capsys):
    write_recording(tmp_path / 'sent', buffered(rng)[0], model())
    assert main(['bag', str(tmp_path / 'sent')]) == 0
    told = capsys.readouterr().out
    (row,) = [line.split() for line in told.splitlines() if line.startswith('/measured')]
    assert float(row[4]) == pytest.approx(20.0, abs=0.2)
    assert 'is stamped in 49 bursts' in told.replace('\n', ' ')


def test_points_that_were_measured_in_bursts_keep_their_stamps(rng):
    t, q = motion(rate=1000.0)
    taken = (np.arange(30)[:, None] * 0.5 + 0.5 + np.arange(8) * 2e-3).ravel()
    whole = np.array([np.interp(taken, t, column) for column in q.T]).T
    seen = measured(REAL, taken, whole, rng, turns=False, at_rest=False).measured
    assert not kinds(wt.Recording('gated', wt.JointMotion(t, q), seen))


# A camera on the arm ---------------------------------------------------------------------------


def on_the_arm(rng, noise=5e-5):
    """Return a board on the table as a camera on the flange sees it."""
    t, q = motion(rate=20.0, seconds=12.0)
    camera = np.linalg.inv(REAL.reaches(q)) @ frame([0.4, 0.1, 0.0], [np.pi, 0.1, 0.0])
    turn = Rotation.from_rotvec(3e-4 * rng.standard_normal((len(q), 3))).as_matrix()
    position = camera[:, :3, 3] + noise * rng.standard_normal((len(q), 3))
    seen = wt.Measurements(t, position, turn @ camera[:, :3, :3])
    return wt.Recording('board', wt.JointMotion(t, q), seen)


def test_a_board_seen_from_the_arm_is_told_and_inverted(rng, tmp_path):
    board = on_the_arm(rng)
    seen = looked(board, apply=True)
    (item,) = seen.unsound
    assert (item.kind, item.at) == ('camera_inverted', ('instrument',)) and seen.posed is not None
    write_robot_yaml(tmp_path / 'own.yaml', model())
    write_recording(tmp_path / 'board', board, model())
    robot = ('--robot', tmp_path / 'own.yaml', '--exclude-effect', *OTHERS)
    words = ('diagnose', tmp_path / 'board', *robot, '--align', 'base,tool', '--measured-inverse')
    done(*words, '--out', tmp_path / 'out')
    found = json.loads((tmp_path / 'out' / 'diagnosis.json').read_text())
    assert not found['unsound']
    assert 'u' in {effect['joint'] for effect in found['verdict']['effects']}


# What changed, and what did not ----------------------------------------------------------------


def test_a_slip_between_recordings_is_seen_beside_a_gross_reading(rng):
    slipped = REAL.off(theta=[0, 0, 0, 0, 5e-4, 0], d=[0, 0, 0, 9e-4, 0, 0])
    common = REAL.off(d=[0, 0, 0, 9e-4, 0, 0])
    first, second = (
        measured(arm, 5.0 * np.arange(35), stations(rng, 35), rng, turns=False, name=name)
        for arm, name in ((common, 'before'), (slipped, 'after'))
    )
    position = first.measured.position.copy()
    position[12] += [0.006, 0.007, -0.002]
    first = first.with_measured(replace(first.measured, position=position))
    (changed,) = diagnosed(first, second, may_change='joint_offset,tool_pose')['changed']
    assert (changed['recording'], changed['effect'], changed['joint']) == (1, 'joint_offset', 'b')
    assert changed['value'] == pytest.approx(5e-4, abs=1e-4)


@pytest.mark.parametrize('seed', [1, 2, 3])
def test_links_that_grow_with_the_recorded_temperature_are_no_set_up_that_moved(seed):
    rng, count = np.random.default_rng(seed), 34
    q, t = stations(rng, count, 0.9), 60.0 * np.arange(count)
    warm = 20.0 + 14.0 * -np.expm1(-np.arange(count) / 10.0)
    lengths = 1.0 + 1.4e-5 * (warm - 20.0)
    reached = [
        replace(REAL, a=REAL.a * s, d=REAL.d * s).reaches(q[k : k + 1])[0, :3, 3]
        for k, s in enumerate(lengths)
    ]
    seen = wt.Measurements(t, np.array(reached) + 2e-5 * rng.standard_normal((count, 3)))
    warmed = wt.Recording(
        'warm', wt.JointMotion(t, q, static=True), seen, temperature=wt.Signal(t, warm)
    )
    found = looked(warmed)
    assert not found.unsound and not found.slips
    assert not [check for check in found.checks if check.name == 'set-up' and check.level != 'ok']


def test_a_set_up_that_moved_is_told_by_its_station_and_not_by_its_second(rng):
    made = measured(REAL, 4.8 * np.arange(50), stations(rng, 50), rng, turns=True)
    position = made.measured.position.copy()
    position[30:] += [0.001, 0.002, -0.001]
    (slip,) = looked(made.with_measured(replace(made.measured, position=position))).slips
    assert 'station 30 of 50' in slip.sentence(made)


def test_a_chain_of_two_arms_is_said_to_be_one(rng):
    one = model().to_mapping()
    rows = [{**row, 'name': f'{side}{row["name"]}'} for side in 'lr' for row in one['joints']]
    both = wt.Robot.from_mapping({'name': 'both', 'joints': rows})
    q = np.hstack([stations(rng), stations(rng)])
    t = 5.0 * np.arange(len(q))
    quiet = wt.Recording('q', wt.JointMotion(t, q, static=True))
    seen = wt.Twin(both).poses(quiet, t)
    noisy = seen.position + 2e-5 * rng.standard_normal((len(q), 3))
    found = examine(Given((quiet.with_measured(wt.Measurements(t, noisy)),), both, frozenset()))
    assert any('as two arms together have' in check.sentence for check in found.checks)
