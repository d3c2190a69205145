# Copyright 2026 weld_twin contributors
# SPDX-License-Identifier: Apache-2.0
"""An investigation goes on from files: what it asked for is recorded, taken in, and judged."""

import json

import numpy as np
import yaml

import weld_twin_core as wt
from weld_twin_msgs_py.bags import write_recording
from weld_twin_nodes.cli.in_process import weld_twin

SPRING = wt.effects.JointCompliance('shoulder_lift_joint', compliance=1.2e-5)
BOX = '-1.2,-1.2,-0.2,1.2,1.2,1.6'


def measured(robot, place, q, seed):
    motion = wt.JointMotion(15.0 * np.arange(len(q)), np.asarray(q), static=True)
    real = wt.Twin(robot, [SPRING]).poses(wt.Recording(place.name, motion))
    noise = np.random.default_rng(seed).normal(0.0, 4e-5, real.position.shape)
    seen = wt.Measurements(motion.t, real.position + noise, real.rotation)
    write_recording(place, wt.Recording(place.name, motion, seen), robot)
    return str(place)


def test_what_is_asked_for_is_taken_in_and_judged(ur5, tmp_path):
    rng = np.random.default_rng(1)
    near = np.array([0.2, -1.3, 1.5, -1.8, -1.5, 0.1]) + 0.05 * rng.uniform(-1, 1, (25, 6))
    first = measured(ur5, tmp_path / 'monday', near, 1)
    place = tmp_path / 'cell'
    said = weld_twin(
        *('investigate', str(place), first, '--robot', 'ur5', '--budget', '6', f'--cell-box={BOX}')
    )
    assert said.code == 0, said.err
    asked = json.loads((place / 'investigation.json').read_text())['rounds'][0]['asked']
    assert 0.0 < asked['minutes'] <= 6.0 and asked['decided'] is None
    wanted = yaml.safe_load((place / 'round-0' / 'experiment.yaml').read_text())
    tips = wt.forward(ur5, np.array(wanted['q']))[:, :3, 3]
    low, high = np.array([float(v) for v in BOX.split(',')]).reshape(2, 3)
    assert ((tips >= low) & (tips <= high)).all()
    second = measured(ur5, tmp_path / 'tuesday', wanted['q'], 2)
    said = weld_twin('investigate', str(place), second)
    assert said.code == 0, said.err
    state = json.loads((place / 'investigation.json').read_text())
    assert [step['asked'] is None or 'decided' in step['asked'] for step in state['rounds']]
    assert len(state['rounds']) == 2 and state['spent_min'] == asked['minutes']
    assert state['rounds'][0]['asked']['decided'] in (True, False)
    named = {(e['effect'], e['joint']) for e in state['rounds'][1]['believed']['effects']}
    assert ('joint_compliance', 'shoulder_lift_joint') in named
