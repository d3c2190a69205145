# Copyright 2026 weld_twin contributors
# SPDX-License-Identifier: Apache-2.0
"""An investigation goes on from files: what it asked for is recorded, taken in, and judged."""

import json
from dataclasses import replace

import numpy as np
import pytest
import yaml
from command_line import done, refused
from small_arm import small_arm

import weld_twin_core as wt
from weld_twin_msgs_py.bags import write_recording
from weld_twin_msgs_py.robots import write_robot_yaml

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
