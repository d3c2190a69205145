# Copyright 2026 weld_twin contributors
# SPDX-License-Identifier: Apache-2.0
"""Experiments in files and by the command that investigates."""

import json
from dataclasses import replace

import numpy as np
import pytest
import yaml
from command_line import done, refused
from measured_cells import asked, moving, recorded, stations
from small_arm import small_arm

import weld_twin_core as wt
from weld_twin_core import DataError, catalog
from weld_twin_core.diagnosis.advice import next_experiment
from weld_twin_core.diagnosis.algebra.problem import Scale
from weld_twin_msgs_py.bags import write_recording
from weld_twin_msgs_py.files.joint_file import write_joint_motion
from weld_twin_msgs_py.robots import write_robot_yaml
from weld_twin_nodes.offline.seam_motion import joint_motion

SPRING = wt.effects.JointCompliance('shoulder_lift_joint', compliance=1.2e-5)
BOX = '-1.2,-1.2,-0.2,1.2,1.2,1.6'


HOME = np.array([0.2, -1.3, 1.5])
ARM = small_arm()


@pytest.fixture
def robot(tmp_path):
    """Return the file of the arm that is asked about."""
    write_robot_yaml(tmp_path / 'arm.yaml', ARM)
    return ('--robot', str(tmp_path / 'arm.yaml'))


def about(width, count=25):
    return HOME + width * np.random.default_rng(1).uniform(-1.0, 1.0, (count, 3))


def measured(place, q, seed, load=0.0):
    arm = replace(ARM, payload_mass=load)
    motion = wt.JointMotion(15.0 * np.arange(len(q)), np.asarray(q), static=True)
    real = wt.Twin(arm, [SPRING]).poses(wt.Recording(place.name, motion))
    noise = np.random.default_rng(seed).normal(0.0, 4e-5, real.position.shape)
    seen = wt.Measurements(motion.t, real.position + noise, real.rotation)
    write_recording(place, wt.Recording(place.name, motion, seen), ARM)
    return str(place)


def test_what_is_asked_for_is_taken_in_and_judged(robot, tmp_path):
    first, place = measured(tmp_path / 'monday', about(0.03), 1), tmp_path / 'cell'
    done(*('investigate', str(place), first, *robot, '--budget', '6', f'--cell-box={BOX}'))
    asked = json.loads((place / 'investigation.json').read_text())['rounds'][0]['asked']
    assert 0.0 < asked['minutes'] <= 6.0 and asked['decided'] is None
    wanted = yaml.safe_load((place / 'round-0' / 'experiment.yaml').read_text())
    tips = wt.forward(ARM, np.array(wanted['q']))[:, :3, 3]
    low, high = np.array([float(v) for v in BOX.split(',')]).reshape(2, 3)
    assert ((tips >= low) & (tips <= high)).all()
    second = measured(tmp_path / 'tuesday', wanted['q'], 2)
    done('investigate', str(place), second)
    state = json.loads((place / 'investigation.json').read_text())
    assert [step['asked'] is None or 'decided' in step['asked'] for step in state['rounds']]
    assert len(state['rounds']) == 2 and state['spent_min'] == asked['minutes']
    assert state['rounds'][0]['asked']['decided'] in (True, False)
    named = {(e['effect'], e['joint']) for e in state['rounds'][1]['believed']['effects']}
    assert ('joint_compliance', 'shoulder_lift_joint') in named


def test_a_larger_budget_goes_on_where_the_first_was_spent(robot, tmp_path):
    first, place = measured(tmp_path / 'monday', about(0.03), 1), str(tmp_path / 'cell')
    assert 'budget spent' in done('investigate', place, first, *robot, '--budget', '0.3')
    assert 'a larger --budget opens it again' in refused('investigate', place, '--live')
    assert 'experiment.yaml' in done('investigate', place, '--budget', '30')
    state = json.loads((tmp_path / 'cell' / 'investigation.json').read_text())
    assert (state['state'], state['spent_min'], len(state['rounds'])) == ('open', 0.0, 1)
    assert state['rounds'][0]['asked']['minutes'] <= 30.0
    done('investigate', place, '--budget', '40')
    assert json.loads((tmp_path / 'cell' / 'investigation.json').read_text())['budget_min'] == 40.0


def test_a_weight_that_was_hung_for_one_recording_is_told(robot, tmp_path):
    near = about(0.4, 40)
    first = measured(tmp_path / 'first', near[:25], 1)
    heavy = measured(tmp_path / 'heavy', near[25:], 2, load=5.0)
    words = ('diagnose', first, heavy, *robot, '--out', str(tmp_path / 'out'))
    said = done(*words, '--changed', heavy, 'load=5')
    effect = json.loads((tmp_path / 'out' / 'diagnosis.json').read_text())['verdict']['effects'][0]
    assert (effect['effect'], effect['joint']) == ('joint_compliance', 'shoulder_lift_joint')
    assert abs(effect['parameters']['compliance'] / 1.2e-5 - 1.0) < 0.05
    said = refused(*words, '--changed', 'another', 'load=5')
    assert "'another' is none of the recordings" in said


def test_a_live_investigation_begins_with_a_recording(tmp_path):
    assert 'begin one with recordings' in refused('investigate', str(tmp_path / 'cell'), '--live')


@pytest.fixture(params=[(moving, 'path'), (stations, 'bidirectional')], ids=['path', 'stations'])
def proposal(request, ur5, tmp_path):
    kind, wanted = request.param
    rng = np.random.default_rng(3)
    problem, model = asked(ur5, recorded(ur5, kind(ur5, rng), rng))
    scale = Scale(2e-5, 4e-5, tuple(np.ones(m) for m in problem.samples))
    found = next_experiment(problem, model, [()], scale)
    assert found['kind'] == wanted
    path = tmp_path / 'next_experiment.yaml'
    write_joint_motion(path, found['motion'], found['sentence'])
    return found['motion'], path


def test_the_motion_passes_every_point_within_the_limits_of_the_robot(ur5, proposal):
    wanted, path = proposal
    motion = joint_motion(ur5, str(path))
    nearest = [np.abs(motion.q - q).max(axis=1).min() for q in np.array(wanted['q'])]
    # A path is sampled anew: half a step of it lies between.
    step = np.abs(np.diff(motion.q, axis=0)).max()
    assert max(nearest) < (1e-9 if wanted['static'] else 0.5 * step + 1e-3)
    rates = np.abs(np.diff(motion.q, axis=0)) / np.diff(motion.t)[:, None]
    assert (rates <= ur5.max_velocity).all()
    slopes = (motion.q[2:] - motion.q[:-2]) / (motion.t[2:] - motion.t[:-2])[:, None]
    np.testing.assert_allclose(motion.velocity[1:-1], slopes, atol=0.02)


def test_the_arm_rests_at_every_station_when_it_is_to_be_measured(ur5, tmp_path):
    q = np.array([[0.0] * 6, [0.4] * 6, [0.4] * 6, [-0.5] * 6])
    t = [0.0, 15.0, 30.0, 31.0]
    path = tmp_path / 'stations.yaml'
    names = list(ur5.joint_names)
    write_joint_motion(path, {'static': True, 'joint_names': names, 't': t, 'q': q}, 'four')
    motion = joint_motion(ur5, str(path))
    for k in range(3):
        near = np.abs(motion.t - t[k]) <= 0.9
        np.testing.assert_allclose(motion.q[near], np.tile(q[k], (near.sum(), 1)), atol=1e-12)
        assert (motion.velocity[near] == 0.0).all()
    last = motion.t > motion.t[-1] - 1.9
    np.testing.assert_allclose(motion.q[last], np.tile(q[3], (last.sum(), 1)), atol=1e-12)
    speed, hardest = (
        np.abs(motion.velocity),
        np.abs(np.gradient(motion.velocity, motion.t, axis=0)),
    )
    assert (speed <= ur5.max_velocity).all() and (hardest <= ur5.max_acceleration).all()


def test_joints_in_another_order_are_put_in_that_of_the_robot(ur5, tmp_path):
    rows = [[0.1, 0.2, 0.3, 0.4, 0.5, 0.6], [0.2, 0.3, 0.4, 0.5, 0.6, 0.7]]
    path = tmp_path / 'turned.yaml'
    names = list(reversed(ur5.joint_names))
    write_joint_motion(
        path, {'static': False, 'joint_names': names, 't': [0.0, 5.0], 'q': rows}, 'turned'
    )
    np.testing.assert_allclose(joint_motion(ur5, str(path)).q[0], rows[0][::-1])


def test_a_motion_of_another_robot_is_refused_in_a_sentence(proposal):
    with pytest.raises(DataError, match='moves shoulder_pan_joint'):
        joint_motion(catalog.load('abb_irb120'), str(proposal[1]))
