# Copyright 2026 weld_twin contributors
# SPDX-License-Identifier: Apache-2.0
"""Inputs that cannot be used are refused in one sentence; inputs that are used stay untouched."""

import numpy as np
import pytest
import yaml

from weld_twin_core.arm.robot import Robot
from weld_twin_core.arrays import increasing, readonly
from weld_twin_core.effects import REGISTRY, effect_from_mapping, effects_from_list
from weld_twin_core.errors import DataError, ModelError
from weld_twin_core.recording import JointMotion, Measurements, Recording, Signal
from weld_twin_core.twin.twin import Twin

MOTION = JointMotion([0.0, 1.0], np.zeros((2, 6)))

DATA = [
    (lambda: readonly('x', (None,), 'q'), "q must be numbers, got 'x'"),
    (lambda: readonly('x' * 99, (None,), 'q'), f"q must be numbers, got '{'x' * 56}..."),
    (lambda: readonly([[1]], (None,), 'q'), 'q must have shape (any), got (1, 1)'),
    (
        lambda: readonly([1, np.nan, np.inf], (3,), 'q'),
        'q has 2 value(s) that are not finite, the first at index (1,); drop or repair those '
        'samples',
    ),
    (
        lambda: increasing([0, 1, 0.5], 't'),
        't must increase, but sample 2 is 0.5 s before sample 1; sort the samples or drop the '
        'repeated ones',
    ),
    (
        lambda: increasing([0, 1, 1], 't'),
        't must increase, but sample 2 is at the same time as sample 1; sort the samples or drop the '
        'repeated ones',
    ),
    (lambda: JointMotion([], []), 'the joint stream is empty'),
    (
        lambda: JointMotion([0.0], np.zeros((2, 6))),
        'joint positions must have shape (1, any), got (2, 6)',
    ),
    (
        lambda: JointMotion([0.0], np.zeros((1, 6)), np.zeros((1, 5))),
        'joint velocities must have shape (1, 6), got (1, 5)',
    ),
    (
        lambda: Measurements([0.0], [[0, 0, 0]], sigma=[-1.0]),
        'sigma of the measurements is negative at sample 0',
    ),
    (lambda: Signal([], []), 'a signal is empty; leave it out of the recording'),
    (lambda: Signal([0.0], np.zeros((1, 3))), 'signal values must have shape (1, 6), got (1, 3)'),
    (
        lambda: Recording('r', MOTION, wrench_frame='world'),
        "wrench_frame must be one of tool, base, got 'world'",
    ),
    (
        lambda: Recording('r', MOTION, wrench=Signal([0.0], [1.0])),
        "wrench of recording 'r' must have shape (K, 6), got (1,)",
    ),
    (
        lambda: Recording('r', MOTION, temperature=Signal([0.0], np.zeros((1, 6)))),
        "temperature of recording 'r' must have shape (K,), got (1, 6)",
    ),
]

ROBOTS = yaml.safe_load("""
- [[], "a robot file must be a mapping of keys, got list"]
- [{name: r}, "robot 'r' needs a list 'joints' in chain order"]
- [{name: r, joints: [{a: 1}]}, "joint 0 of robot 'r' needs a 'name'"]
- - {name: r, joints: [{name: j0}, {name: j1}, {name: j0}, {name: j1}]}
  - "robot 'r' uses a joint name twice: ('j0', 'j1', 'j0', 'j1')"
- - {name: r, joints: [{name: j0, type: ball}]}
  - "joint 'j0': type must be revolute or prismatic, got 'ball'"
- - {name: r, joints: [{name: j0, a: long}]}
  - "robot 'r': a of robot 'r' must be numbers, got ['long']"
- - {name: r, joints: [{name: j0}, {name: j1}], links: [{mass: 1.0}]}
  - robot 'r' has 1 links for 2 joints; give one per joint
- - {name: r, joints: [{name: j0}, {name: j1}], convention: craig}
  - convention of robot 'r' must be one of standard, modified, got 'craig'
- - {name: r, joints: [{name: j0}, {name: j1}], tool: {quat_xyzw: [0, 0, 0, 0]}}
  - "robot 'r': tool quat_xyzw 0 has length 0, a rotation needs 1; check the order (x y z w) and
    that it is not left at zero"
- - {name: r, joints: [{name: j0, lower: 1.0, upper: -1.0}]}
  - "joint 'j0': lower limit is not below upper"
""")

EFFECTS = yaml.safe_load("""
- [backlash, "an effect must be a mapping with the key 'effect', got 'backlash'"]
- - {effect: joint_offset, joint: j9}
  - robot 'ur5' has no joint 'j9'; its joints are j0, j1, j2, j3, j4, j5
- [{effect: joint_offset, joint: null}, "joint_offset needs a joint"]
- - {effect: joint_offset}
  - "effect 'joint_offset': JointOffset.__init__() missing 1 required positional argument:
    'joint'"
- - {effect: joint_offset, joint: j0, angle: 1.0}
  - effect 'joint_offset' has no parameter 'angle'; it takes joint, offset
- - {effect: joint_offset, joint: j0, offset: big}
  - "effect 'joint_offset': offset must be a number, got 'big'"
- - {effect: joint_offset, joint: j0, offset: true}
  - "effect 'joint_offset': offset must be a number, got True"
- - {effect: joint_offset, joint: j0, offset: [1.0, 2.0]}
  - "effect 'joint_offset': offset must be one number, got [1.0, 2.0]"
- - {effect: joint_offset, joint: j0, offset: .nan}
  - "joint_offset: offset is not finite"
- - {effect: base_pose, xyz: [0.0, 1.0]}
  - "effect 'base_pose': xyz must be 3 numbers, got [0.0, 1.0]"
- - {effect: backlash, joint: j0, width: -0.001}
  - "backlash: width = -0.001 rad is outside [0, inf]"
- - {effect: backlash, joint: j0, form: gap}
  - "backlash: form must be one of ('play', 'reversal', 'coast'), got 'gap'"
- [{effect: joint_coupling, joint: j0}, "joint_coupling needs a source joint"]
- - {effect: joint_coupling, joint: j0, source: j0}
  - "joint_coupling: source and joint are the same; use gear_ratio"
- [{effect: thermal_growth, links: j0}, "thermal_growth: links must be a list, got 'j0'"]
- - {effect: thermal_growth, reference: warm}
  - "thermal_growth: reference must be a number, got 'warm'"
- - {effect: thermal_growth, warmup: [10.0, 0.0]}
  - "thermal_growth: warmup must be the rise in K, or [rise in K, time constant in s above zero], got
    [10.0, 0.0]"
- - {effect: transmission_ripple, joint: j0, amplitude: [1, 2], order: [1, 2, 3]}
  - "transmission_ripple: amplitude, order and phase must be numbers or lists of one length, got
    lengths [2, 3]"
""")


@pytest.mark.parametrize(('call', 'sentence'), DATA)
def test_samples_that_cannot_be_used_are_refused(call, sentence):
    with pytest.raises(DataError) as error:
        call()
    assert str(error.value) == sentence


@pytest.mark.parametrize(('data', 'sentence'), ROBOTS)
def test_robots_that_cannot_be_used_are_refused(data, sentence):
    with pytest.raises(ModelError) as error:
        Robot.from_mapping(data)
    assert str(error.value) == sentence


@pytest.mark.parametrize(('entry', 'sentence'), EFFECTS)
def test_effects_that_cannot_be_used_are_refused_by_their_place_in_the_file(entry, sentence, arm):
    with pytest.raises(ModelError) as error:
        effects_from_list([{'effect': 'base_pose'}, entry], arm)
    assert str(error.value) == f'effect 1: {sentence}'


def test_an_unknown_effect_is_refused_with_the_known_ones():
    with pytest.raises(ModelError, match=r"^unknown effect 'rust'; known effects are axis_comp"):
        effect_from_mapping({'effect': 'rust'})


def test_thermal_growth_without_any_temperature_is_refused(arm):
    twin = Twin(arm, (effect_from_mapping({'effect': 'thermal_growth', 'coefficient': 1e-5}),))
    with pytest.raises(DataError, match=r'^thermal_growth needs a temperature: '):
        twin.poses(Recording('r', MOTION))


def test_positions_in_degrees_are_recognised():
    robot = Robot.from_mapping(
        {'name': 'r', 'joints': [{'name': 'j0', 'lower': -3.0, 'upper': 3.0}]}
    )
    robot.check_positions(np.array([[3.0], [-3.0]]))
    with pytest.raises(DataError) as error:
        robot.check_positions(np.array([[0.0], [90.0]]))
    assert str(error.value) == (
        "joint 'j0' is at 90 in sample 1, outside its limits [-3, 3]; this looks like degrees in "
        'a radian field'
    )


def test_a_robot_survives_its_file(robot):
    again = Robot.from_mapping(yaml.safe_load(yaml.safe_dump(robot.to_mapping())))
    assert again.joint_names == robot.joint_names
    assert again.convention == robot.convention
    for key in ('a', 'alpha', 'd', 'theta', 'beta', 'prismatic', 'mass', 'com', 'payload_com'):
        np.testing.assert_array_equal(getattr(again, key), getattr(robot, key))
    for key in ('T_world_base', 'T_flange_tool', 'T_root_base'):
        np.testing.assert_allclose(getattr(again, key), getattr(robot, key), atol=1e-15)
    assert again.to_mapping().keys() == robot.to_mapping().keys()


@pytest.mark.parametrize('name', sorted(REGISTRY))
def test_an_effect_survives_its_file(name, arm, positioner):
    of_cell = name in ('root_pose', 'guide_bend', 'guide_tilt')
    robot = positioner if of_cell else arm
    given = {
        'joint': 'j2' if of_cell else 'j1',
        'source': 'j2',
        'links': ['j0'],
        'warmup': 1.0,
        'form': 'reversal',
    }
    kind = REGISTRY[name]
    fields = set(kind.__dataclass_fields__)
    entry = {'effect': name} | {key: value for key, value in given.items() if key in fields}
    for parameter in kind.parameters:
        size = parameter.size or (4 if parameter.name == 'second' else 0)
        values = [0.1 * (k + 1) for k in range(size)] if size > 2 else [0.5, 0.6]
        entry[parameter.name] = values if parameter.size != 1 else 0.25
        if name == 'frame_curve':  # two knots for each of three axes
            entry[parameter.name] = [0.1, 0.2, 0.3, 0.4, 0.5, 0.6]
    (first,) = effects_from_list([entry], robot)
    text = yaml.safe_dump([first.to_mapping()])
    (again,) = effects_from_list(yaml.safe_load(text), robot)
    assert again.to_mapping() == first.to_mapping()
    assert first.to_mapping() == entry


def test_nobody_can_change_a_model_or_a_recording_afterwards(arm):
    mine = np.zeros((3, 6))
    motion = JointMotion([0.0, 1.0, 2.0], mine)
    xyz = np.zeros(3)
    base = effect_from_mapping({'effect': 'base_pose', 'xyz': xyz})
    mine[:] = xyz[:] = 1.0
    assert not motion.q.any()
    assert not base.xyz.any()
    for array in (
        motion.q,
        motion.t,
        motion.velocity,
        base.xyz,
        arm.a,
        arm.T_world_base,
        arm.com,
        arm.prismatic,
        Signal([0.0], [1.0]).value,
        Measurements([0.0], [[0, 0, 0]]).position,
    ):
        with pytest.raises(ValueError, match='read-only'):
            array[...] = 1.0
    with pytest.raises(AttributeError):
        motion.q = mine


def test_running_the_twin_leaves_its_inputs_alone(arm, make_recording):
    recording = make_recording(arm)
    at = np.array(recording.joints.t)
    entries = [
        {'effect': 'backlash', 'joint': 'j1', 'width': 0.1},
        {'effect': 'time_delay', 'delay': 0.1},
    ]
    Twin(arm, effects_from_list(entries, arm)).linearise(recording, at)
    np.testing.assert_array_equal(at, recording.joints.t)
