# Copyright 2026 weld_twin contributors
# SPDX-License-Identifier: Apache-2.0
"""Effects that are found have sentences on what to mend; without a name, experiments part places."""

import numpy as np
import pytest
import yaml
from small_arm import small_arm

import weld_twin_core as wt
from weld_twin_core.arm.robot import Robot
from weld_twin_core.diagnosis.advice import Limits, actions
from weld_twin_core.effects import REGISTRY, effects_from_list
from weld_twin_core.effects.curves import JointCurve
from weld_twin_core.effects.wording import number


def said(robot, **entry):
    return actions(effects_from_list([entry], robot), robot)[0]


SAID = yaml.safe_load("""
- - {effect: joint_offset, joint: elbow_joint, offset: 0.00042}
  - ['At reading X elbow_joint stands at X + 0.0241 deg. To mend: ', the reading X becomes X +
    0.0241 deg.]
- - {effect: link_length, joint: shoulder_lift_joint, da: 0.0006}
  - [a = -424.400 mm, in place of -425.000 mm, +0.600 mm]
- [{effect: link_twist, joint: elbow_joint, dalpha: -0.001}, [-0.0573 deg]]
- - {effect: tool_pose, xyz: [0.001, 0.0, -0.002], rotvec: [0.0, 0.01, 0.0]}
  - ['by +1.000 mm along axis x, -2.000 mm along axis z of the flange and +0.5730 deg about axis
    y of the tool;']
- - {effect: base_pose, xyz: [0.0, 0.0002, 0.0], rotvec: [0.0, 0.0, 0.0009]}
  - [by +0.200 mm along axis y of the measuring frame and +0.0516 deg about axis z of the base.
    If it was right when it was measured]
- [{effect: payload, mass: 2.1}, [Enter a payload of 2.10 kg in place of 0.00 kg]]
- - {effect: backlash, joint: shoulder_lift_joint, width: 0.0005}
  - [Service the gear of shoulder_lift_joint, has 0.0286 deg of]
- - {effect: backlash, joint: elbow_joint, width: 0.0005, form: coast}
  - [elbow_joint always from one side, coasts across 0.0286 deg of play, ahead]
- [{effect: time_delay, delay: 0.0123}, [Fix the clock, 12.3 ms late]]
- [{effect: time_delay, delay: -0.0123}, [12.3 ms early]]
- [{effect: clock_rate, rate: -3.0e-05}, [30.0 ppm slow, 0.108 s in an hour]]
- - {effect: joint_compliance, joint: elbow_joint, compliance: 2.0e-05}
  - [+0.115 deg under 100 N m, a stiffness of 50.0 kN m/rad]
- [{effect: drift, xyz_rate: [1.0e-06, 0.0, 0.0]}, ['(+3.60, 0, 0) mm per hour']]
- - {effect: thermal_growth, coefficient: 1.2e-05, links: [elbow_joint]}
  - [+0.0120 mm per m and K for elbow_joint]
- [{effect: thermal_growth, coefficient: 1.2e-05, warmup: 10.0}, [+0.120 mm per m while it warms]]
- - {effect: transmission_ripple, joint: elbow_joint, amplitude: [0.0001, 0.0005], order: [4.0,
    9.0], phase: [0.0, 1.0]}
  - ['0.029 deg at 9 per turn, 0.0057 deg at 4 per turn']
""")
"""Effects, and parts of what is said of them."""


@pytest.mark.parametrize(('entry', 'parts'), SAID)
def test_the_number_and_the_unit_are_those_to_enter(ur5, entry, parts):
    sentence = said(ur5, **entry)
    assert all(part in sentence for part in parts), sentence


@pytest.mark.parametrize('name', ['base_pose', 'instrument_knock'])
def test_a_turn_is_told_about_the_axes_of_a_base_that_is_turned_itself(ur5, name):
    quarter = np.array([[0.0, -1.0, 0.0, 0.5], [1.0, 0.0, 0.0, 0.0], [0.0, 0.0, 1.0, 0.0]])
    turned = ur5.with_frames(base=np.vstack([quarter, [0.0, 0.0, 0.0, 1.0]]))
    sentence = said(turned, effect=name, xyz=[2e-4, 0.0, 0.0], rotvec=[0.0, 9e-4, 0.0])
    assert '+0.200 mm along axis x of the measuring frame' in sentence
    assert '+0.0516 deg about axis x of the base' in sentence


OF_CELLS = ('root_pose', 'guide_bend', 'guide_tilt')


def test_errors_of_a_cell_have_sentences_in_mm_and_degrees(ur5):
    track = {'name': 'track', 'type': 'prismatic', 'alpha': 1.5}
    data = ur5.to_mapping()
    joints, links = [track, *data['joints']], [{'mass': 9.0}, *data.get('links', [])]
    more = {'links': links} if 'links' in data else {}
    foot = {'base': {'xyz': [1.5, 0.0, 0.5]}, 'joints': [{'name': 'tilt', 'alpha': 1.5}]}
    cell = Robot.from_mapping(data | {'joints': joints, 'workpiece': foot} | more)
    root = said(cell, effect='root_pose', xyz=[2e-3, 0.0, 0.0], rotvec=[0.0, 0.0, 0.0])
    assert 'x, y, z = (1502.000, 0.000, 500.000) mm' in root
    assert 'in place of x, y, z = (1500.000, 0.000, 500.000) mm' in root
    bend = said(cell, effect='guide_bend', joint='track', curvature=[8e-4, 0.0])
    assert 'over a metre it is bent by 0.100 mm along x' in bend
    tilt = said(cell, effect='guide_tilt', joint='track', rate=[1e-3, 0.0, 0.0])
    assert '(+0.0573, 0, 0) deg about x, y, z' in tilt
    assert '0.300 mm of play' in said(cell, effect='backlash', joint='track', width=3e-4)


def test_every_effect_of_the_library_has_a_sentence_of_its_own_without_exponents_but_noise(ur5):
    for name, kind in REGISTRY.items():
        if name in OF_CELLS or not kind.__module__.startswith('weld_twin_core'):
            continue
        where = {'joint': 'elbow_joint'} if kind.of in ('joint', 'link') else {}
        more = {'source': 'wrist_1_joint'} if name == 'joint_coupling' else {}
        sizes = {
            # `second`, a wave that may be left out, takes four
            p.name: p.typical if p.size == 1 else [p.typical] * (p.size or 4)
            for p in kind.parameters
        }
        for values in ({}, {} if name.endswith(('curve', 'noise')) else sizes):
            sentence = said(ur5, effect=name, **where, **more, **values)
            assert sentence.endswith('.') and sentence[0].isupper()
            assert not where or 'elbow_joint' in sentence
            assert name == 'measurement_noise' or not sentence.startswith('Put '), name
            assert 'mrad' not in sentence and 'e-0' not in sentence and 'e+0' not in sentence


@pytest.mark.parametrize(
    ('value', 'text'),
    [(0.42, '+0.420'), (-12.34, '-12.3'), (1234.0, '+1234'), (0.0, '0'), (1e-4, '+0.000100')],
)
def test_numbers_keep_three_digits_and_no_exponent(value, text):
    assert number(value) == text


BENT = JointCurve('elbow_joint', (1e-3, -4e-4, 0.0, -4e-4, 1e-3), (-1, -0.5, 0, 0.5, 1), 'speed')
"""Nothing in the library depends on speed like this; at half of it four waves leave the noise alone."""


@pytest.fixture(scope='module')
def found():
    robot, rng = small_arm(), np.random.default_rng(8)
    middle = np.array([0.2, -1.3, 1.2])
    t = np.arange(0.0, 30.0, 0.04)
    rates = 2.0 * np.pi * np.array([0.13, 0.17, 0.19])
    start = (1.0 - np.exp(-(t**3)))[:, None]
    motion = wt.JointMotion(t, middle + 0.5 * start * np.sin(rates * t[:, None] + np.arange(3)))
    bare = wt.Recording('free', motion)
    real = wt.Twin(robot, [BENT]).poses(bare).position
    seen = wt.Measurements(t, real + rng.normal(0.0, 2e-5, real.shape))
    limits = Limits(minutes=5.0, set_up=False)
    return wt.diagnose(bare.with_measured(seen), robot, limits=limits)


def test_what_is_held_apart_are_places_and_what_they_depend_on(found):
    assert found.status == 'unknown'
    asked = found.next_experiment
    assert asked['between'] is not None and asked['motion'] is not None
    items = [item for side in asked['between'] for item in side]
    curves = [item for item in items if item['effect'] == 'joint_curve']
    assert curves and all(set(item) == {'effect', 'joint', 'at', 'on'} for item in items)
    assert any(item['at'] == 'elbow_joint' and item['on'] == 'speed' for item in curves)
    assert 'something at elbow_joint that depends on speed' in asked['reason']


def test_no_more_than_an_even_chance_is_promised_without_a_name(found):
    assert 0.0 <= found.next_experiment['promise'] <= 0.5
