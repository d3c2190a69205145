# Copyright 2026 weld_twin contributors
# SPDX-License-Identifier: Apache-2.0
"""The running twin and the twin over a bag say the same of the same messages."""

from dataclasses import dataclass, replace

import numpy as np
import pytest

from weld_twin_core.arm.catalog import load
from weld_twin_core.arm.robot import Robot
from weld_twin_core.arm.rotation import rotation_matrix
from weld_twin_core.effects import REGISTRY, Effect, Parameter, Stage, effect_from_mapping
from weld_twin_core.errors import DataError
from weld_twin_core.recording import Signal
from weld_twin_core.twin.twin import Twin
from weld_twin_msgs_py.assembly import Role
from weld_twin_msgs_py.bags import BagReader, BagWriter, read_recording
from weld_twin_msgs_py.messages.to_messages import bag_messages
from weld_twin_nodes.live.live_diagnosis import Window
from weld_twin_nodes.streams.twin_stream import JointStream

START = 1_700_000_000_123_456_789
MS = 1_000_000
ARM = load('ur5')
NAMES = ARM.joint_names
MAKE = bag_messages()
ELBOW = {'joint': 'elbow_joint'}
TURN = {'xyz': [1e-3, 0.0, 0.0], 'rotvec': [0.0, 1e-3, 0.0]}
EXAMPLES = {
    'friction': {**ELBOW, 'windup': 5e-3, 'asymmetry': 0.3, 'travel': 0.05},
    'loaded_play': {**ELBOW, 'width': 5e-3, 'torque': 2.0},
    'stiffening': {**ELBOW, 'compliance': 1e-4, 'torque': 2.0},
    'bearing_tilt': {**ELBOW, 'lean': [1e-3, 2e-3, -1e-3, 3e-3], 'second': [1e-4, 0, 2e-4, -1e-4]},
    'frame_curve': {'xyz': [1e-3, 0, 0, 2e-3, 0, -1e-3], 'knots': [0.0, 0.8]},
    'gear_ratio_by_direction': {**ELBOW, 'difference': 2e-3, 'travel': 0.05},
    'joint_coupling': {**ELBOW, 'source': 'wrist_1_joint', 'ratio': 1e-3},
    'joint_curve': {**ELBOW, 'values': [1e-3, -2e-3], 'over': 'speed'},
    'hose_pull': {'force': [10.0, -20.0, 30.0], 'stiffness': 40.0},
    'setup_settling': {**TURN, 'time_constant': 0.4},
    **{name: {**TURN, 'time': 0.4} for name in ('setup_step', 'instrument_knock', 'tool_slip')},
    'joint_slip': {**ELBOW, 'offset': 1e-3, 'time': 0.4},
    'link_warm_up': {**ELBOW, 'strain': 1e-3, 'warming_time': 0.4},
    'joint_warm_up': {**ELBOW, 'offset': 1e-3, 'warming_time': 0.4},
    'thermal_growth': {'coefficient': 1.2e-5},
    'transmission_ripple': {**ELBOW, 'amplitude': 1e-3, 'order': 100.0, 'phase': 0.3},
    'tool_sag': {'sag': [1e-4 * k for k in range(9)]},
    'vibration': {**ELBOW, 'frequency': 8.0, 'damping': 0.05, 'gain': 0.3},
}
"""Entries of effects that typical sizes do not do for."""
TABLE = {
    'base': {'xyz': [1.2, 0.3, 0.4]},
    'tool': {'xyz': [0.1, 0.0, 0.2]},
    'joints': [{'name': 'tilt', 'a': 0.1, 'alpha': 1.5}, {'name': 'turn', 'd': 0.2}],
    'links': [{'mass': 60.0, 'com': [0.1, 0, 0]}, {'mass': 30.0, 'com': [0, 0.1, 0]}],
}
OWN = ARM.to_mapping()
TRACK = {'name': 'track', 'type': 'prismatic', 'alpha': -1.57}
ON_IT = {'mass': 90.0, 'com': [0.0, 0.0, 0.1]}
MORE = {'joints': [TRACK, *OWN['joints']], 'links': [ON_IT, *OWN['links']], 'workpiece': TABLE}
CELL = Robot.from_mapping(OWN | MORE)
"""The same arm on a track beside a positioner."""
OF_CELLS = {
    'root_pose': {'xyz': [1e-3, 2e-3, -1e-3], 'rotvec': [1e-3, 0.0, 2e-3]},
    'guide_bend': {'joint': 'track', 'curvature': [1e-3, -2e-3]},
    'guide_tilt': {'joint': 'track', 'rate': [1e-3, 0.0, 2e-3]},
}
SPRING = effect_from_mapping({'effect': 'joint_compliance', **ELBOW, 'compliance': 1e-5})
LAG = effect_from_mapping({'effect': 'servo_lag', **ELBOW, 'time_constant': 0.02})


@dataclass(frozen=True, eq=False)
class Damper(Effect):
    """An effect that sees the velocity, as one of a user's own may."""

    joint: str
    time: float = 0.0

    name = 'damper'
    of = 'joint'
    stage = Stage.JOINT
    parameters = (Parameter('time', 's'),)

    def displace(self, view):
        i = view.robot.index(self.joint)
        return {('q', i): -self.time * view.qd[..., i]}


COUNT = 120
"""Samples of the arm: about a second."""
SECOND = 1_000 * MS


def motion(count=COUNT):
    """Return stamps [ns] on an uneven beat of about 125 Hz, positions and velocities."""
    rng = np.random.default_rng(5)
    ns = START + np.cumsum(rng.integers(6 * MS, 10 * MS, count))
    t = (ns - START) * 1e-9
    phase = np.arange(6)
    q = 0.5 * np.sin(np.outer(t, 1.0 + 0.31 * phase) + phase) + [0, -1.2, 1.4, -1, -1.5, 0]
    return ns.tolist(), q, rng.normal(size=q.shape)


def joints(qd=True):
    """Yield (stamp, topic, message) of whole joint states."""
    for k, (ns, q, rate) in enumerate(zip(*motion(), strict=True)):
        told = rate if qd is True or (qd == 'some' and k % 3) else None
        yield ns, '/joint_states', MAKE.joint_state(ns, NAMES, q, told)


def sides(frame='tool0', first=0):
    """Yield a wrench at 100 Hz and a temperature at 7 Hz, on clocks of their own."""
    rng = np.random.default_rng(6)
    for ns in range(START + first, START + SECOND, 10 * MS):
        yield ns, '/tool_wrench', MAKE.wrench(ns, 40.0 * rng.normal(size=6), frame)
    for ns in range(START + 5 * MS, START + SECOND, 150 * MS):
        yield ns, '/temperature', MAKE.temperature(ns, float(rng.uniform(20.0, 60.0)))


def in_order(*streams):
    """Return entries as a recorder would write them, the sensors' before the arm's."""
    return sorted((entry for stream in streams for entry in stream), key=lambda entry: entry[0])


def logged(path, entries, robot=ARM):
    """Write a bag; return the recording that is read from it, its messages, and the robot."""
    with BagWriter(path) as bag:
        for log, (_, topic, message) in enumerate(entries):
            bag.write(topic, message, START + log)
    with BagReader(path) as bag:
        messages = [(topic, message) for topic, _, _, message in bag.messages(TAKEN)]
    return read_recording(path, robot), messages, robot


def compare(kept, effects, at_least=COUNT // 2):
    """Assert equal poses of the live twin and the twin over the bag; return the recording."""
    recording, messages, robot = kept
    twin = Twin(robot, effects)
    offline = twin.poses(recording)
    stamps = [recording.epoch_ns + round(t * 1e9) for t in recording.joints.t.tolist()]
    place = {stamp: k for k, stamp in enumerate(stamps)}
    live = played(messages, twin)
    assert at_least <= len(live) <= len(stamps)
    rows = [place[sample.stamp] for sample in live]
    for name in ('position', 'rotation'):
        own = np.array([getattr(sample.poses, name) for sample in live])
        np.testing.assert_allclose(own, getattr(offline, name)[rows], rtol=0.0, atol=1e-12)
    late = [round(float(twin.late(recording.joints.t[k])) * 1e9) for k in rows]
    assert [s.pose_stamp - s.stamp for s in live] == late
    return recording, {sample.stamp for sample in live} - set(stamps)


TAKEN = ('/joint_states', '/tool_wrench', '/temperature')


def played(messages, twin):
    """Return what a running twin gives, message by message; what it refuses, it leaves out."""
    stream, out = JointStream(twin), []
    takers = (stream.step, stream.take_wrench, stream.take_temperature)
    take = dict(zip(TAKEN, takers, strict=True))
    for topic, message in messages:
        try:
            sample = take[topic](message)
        except DataError:
            continue
        if sample is not None:
            out.append(sample)
    return out


@pytest.fixture(scope='module')
def keep(tmp_path_factory):
    """Return what logs entries in a folder of their own."""
    return lambda *entries: logged(tmp_path_factory.mktemp('kept') / 'bag', *entries)


@pytest.fixture(scope='module')
def half(keep):
    """Half a second, in which all that has a date happens."""
    return keep([one for one in in_order(sides(), joints()) if one[0] < START + SECOND // 2])


@pytest.fixture(scope='module')
def some_velocities(keep):
    return keep(in_order(sides(), joints('some')))


@pytest.fixture(scope='module')
def cell(keep):
    return keep(in_order(sides(), in_a_cell()), CELL)


def example(name, **more):
    """Return an effect as it is listed, else with typical sizes."""
    kind = REGISTRY[name]
    usual = {p.name: p.typical if p.size < 2 else [p.typical] * p.size for p in kind.parameters}
    usual |= ELBOW if kind.of in ('joint', 'link') else {}
    return effect_from_mapping({'effect': name, **EXAMPLES.get(name, usual), **more})


def in_a_cell():
    """Yield joint states of two drivers: the robot on its track, and the positioner."""
    for ns, q, rate in zip(*motion(), strict=True):
        more = q[:3] * [0.3, 1.0, 2.0], rate[:3]
        arm = np.append(more[0][0], q), np.append(more[1][0], rate)
        yield ns, '/joint_states', MAKE.joint_state(ns, ('track', *NAMES), *arm)
        yield ns, '/joint_states', MAKE.joint_state(ns, ('tilt', 'turn'), more[0][1:], more[1][1:])


@pytest.mark.parametrize('name', ['', *OF_CELLS, 'joint_compliance', 'backlash', 'pedestal_tilt'])
def test_a_cell_of_two_drivers_is_the_same_live_and_offline(cell, name):
    own = {'joint': 'tilt'} if name in ('joint_compliance', 'backlash') else {}
    compare(cell, (example(name, **OF_CELLS.get(name, own)), SPRING) if name else ())


@pytest.mark.parametrize('name', sorted(set(REGISTRY) - set(OF_CELLS)))
def test_every_effect_is_the_same_live_and_offline(half, name):
    compare(half, (example(name), SPRING), at_least=COUNT // 3)


@pytest.mark.parametrize('qd', [True, 'some', False])
def test_velocities_are_those_told_else_the_step_since_the_sample_before(tmp_path, qd):
    effects = (Damper('elbow_joint', 0.05), LAG)
    recording, _ = compare(logged(tmp_path / 'bag', in_order(sides(), joints(qd))), effects)
    nothing = Twin(ARM, (LAG,)).poses(recording).position
    assert np.abs(nothing - Twin(ARM, effects).poses(recording).position).max() > 1e-3


@pytest.mark.parametrize('over', ['angle', 'direction', 'speed', 'load', 'temperature', 'time'])
def test_curves_without_a_formula_are_the_same_over_every_quantity(some_velocities, over):
    knots = {'load': [-50.0, 50.0], 'temperature': [20.0, 60.0]}.get(over, [-1.0, 1.0])
    entry = {**EXAMPLES['joint_curve'], 'effect': 'joint_curve', 'over': over, 'knots': knots}
    compare(some_velocities, (LAG, effect_from_mapping(entry)))


UNSURE = ('force_sensor_database', 'ft_frame')
MEANINGS = dict.fromkeys(('', 'tool0', 'left/tool0', *UNSURE), 'tool')
MEANINGS |= dict.fromkeys(('base', '/base_link', 'world', 'map'), 'base')


@pytest.mark.parametrize(('frame', 'meaning'), MEANINGS.items())
def test_a_wrench_frame_means_the_same_live_and_offline(tmp_path, frame, meaning):
    entries = in_order(sides(frame), joints())[:60]
    effects = (example('cartesian_compliance'), SPRING)
    recording, _ = compare(logged(tmp_path / 'bag', entries), effects, at_least=20)
    assert recording.wrench_frame == meaning
    told = [note for note in recording.notes if 'taken for the tool frame' in note]
    assert bool(told) == (frame in UNSURE)


@pytest.mark.parametrize('frame', ['gripper_base', 'torch_base_link'])
def test_a_frame_that_may_be_base_or_tool_is_refused_live_and_offline(tmp_path, frame):
    with BagWriter(tmp_path / 'bag') as bag:
        for ns, topic, message in in_order(sides(frame), joints()):
            bag.write(topic, message, ns)
    with pytest.raises(DataError, match="may be the robot's base or part of the tool") as offline:
        read_recording(tmp_path / 'bag', ARM)
    with pytest.raises(DataError) as live:
        JointStream(Twin(ARM)).take_wrench(MAKE.wrench(START, np.ones(6), frame))
    assert str(live.value) in str(offline.value)


def test_world_is_not_base_where_the_base_is_turned(tmp_path):
    pose = np.eye(4)
    pose[:3, :3] = rotation_matrix(np.array([0.0, 0.0, 0.3]))
    turned = replace(ARM, T_world_base=pose)
    with pytest.raises(DataError, match='turned against the base'):
        logged(tmp_path / 'bag', in_order(sides('world'), joints()), turned)
    with pytest.raises(DataError, match='turned against the base'):
        JointStream(Twin(turned)).take_wrench(MAKE.wrench(START, np.ones(6), 'map'))


def test_a_wrench_that_changes_its_frame_is_left_out_from_there(tmp_path):
    wrench, other = list(sides('tool0')), list(sides('base'))
    mixed = [b if k % 5 == 4 else a for k, (a, b) in enumerate(zip(wrench, other, strict=True))]
    recording, _ = compare(logged(tmp_path / 'bag', in_order(mixed, joints())), (SPRING,))
    assert recording.wrench_frame == 'tool'
    assert any("left out, as message 4 of '/tool_wrench'" in note for note in recording.notes)


def test_a_signal_that_begins_late_is_unknown_before(tmp_path):
    compare(logged(tmp_path / 'bag', in_order(sides(first=300 * MS), joints())), (SPRING,))
    effects = (example('thermal_growth'), LAG)
    warm = [entry for entry in sides() if entry[1] == '/temperature'][1:]
    recording, messages, _ = logged(tmp_path / 'warm', in_order(warm, joints()))
    live, offline = played(messages, Twin(ARM, effects)), Twin(ARM, effects).poses(recording)
    first = next(k for k, ns in enumerate(motion()[0]) if ns >= warm[0][0])
    assert len(live) == recording.joints.t.size - first
    own = np.array([sample.poses.position for sample in live])
    np.testing.assert_allclose(own, offline.position[first:], rtol=0.0, atol=1e-12)


def spread():
    """Yield joint states of two controllers, which now and then come in another order."""
    for k, (ns, q, qd) in enumerate(zip(*motion(), strict=True)):
        parts = [
            MAKE.joint_state(ns, NAMES[part], q[part], qd[part])
            for part in (slice(0, 2), slice(2, 6))
        ]
        for part in parts if k % 3 else parts[::-1]:
            yield ns, '/joint_states', part
        if k % 7 == 0:
            yield ns, '/joint_states', MAKE.joint_state(ns, ('finger',), [0.1])


def test_joints_spread_over_publishers_make_the_same_arm(tmp_path):
    recording, _ = compare(logged(tmp_path / 'bag', in_order(sides(), spread())), (LAG, SPRING))
    assert recording.joints.t.size == COUNT


def test_joints_that_never_meet_are_left_out_alike(tmp_path):
    entries = [entry for k, entry in enumerate(spread()) if k % 41 != 20]
    recording, _ = compare(logged(tmp_path / 'bag', in_order(sides(), entries)), (LAG, SPRING))
    assert recording.joints.t.size < COUNT
    assert any('never came with the stamp' in note for note in recording.notes)


def test_repeated_and_backward_stamps_are_left_out_alike(tmp_path):
    entries = list(joints())
    for k in (20, 50, 51, 90):
        entries.insert(k + 3, entries[k])
    entries.insert(70, entries[69])
    sensors = sorted(sides(), key=lambda entry: entry[0])
    sensors.insert(40, sensors[37])
    mixed = merged_as_logged(sensors, entries)
    recording, other = compare(
        logged(tmp_path / 'bag', mixed), (LAG, SPRING, example('thermal_growth'))
    )
    assert not other
    assert recording.joints.t.size == COUNT
    assert any("4 messages of '/joint_states' with a stamp before" in n for n in recording.notes)


def merged_as_logged(sensors, arm):
    """Return both in the order in which they came, which is not that of their stamps."""
    out, sensors = [], list(sensors)
    latest = 0
    for entry in arm:
        latest = max(latest, entry[0])
        while sensors and sensors[0][0] <= latest:
            out.append(sensors.pop(0))
        out.append(entry)
    return out


def test_a_clock_that_was_set_back_ends_a_recording_and_begins_a_run():
    stream = JointStream(Twin(ARM, (LAG,)))
    entries = list(joints())
    for _, _, message in entries:
        stream.step(message)
    again = []
    for _, _, message in entries:
        try:
            again.append(stream.step(message))
        except DataError as error:
            assert 'not after the last one' in str(error)
    assert len(again) == COUNT - 9


def test_a_bag_of_two_runs_is_refused(tmp_path):
    with BagWriter(tmp_path / 'bag') as bag:
        for k, (_, topic, message) in enumerate([*joints(), *list(joints())[100:]]):
            bag.write(topic, message, START + k)
    with pytest.raises(DataError, match=r"'/joint_states' jump back by 0\.\d+ s at message"):
        read_recording(tmp_path / 'bag', ARM)


def test_the_window_of_the_live_diagnosis_is_the_recording_of_the_bag(tmp_path):
    entries = in_order(sides('map'), spread(), measured())
    with BagWriter(tmp_path / 'bag') as bag:
        for k, (_, topic, message) in enumerate(entries):
            bag.write(topic, message, START + k)
    roles = {'/joint_states': Role.JOINTS, '/tool_wrench': Role.WRENCH}
    roles |= {'/temperature': Role.TEMPERATURE, '/measured/tool_pose': Role.POSE}
    window = Window(ARM, 60.0)
    for _, topic, message in entries:
        try:
            window.take(roles[topic], message)
        except DataError:
            assert topic == '/joint_states'
    live, bag = window.recording(0.5), read_recording(tmp_path / 'bag', ARM)
    assert (live.epoch_ns, live.wrench_frame) == (bag.epoch_ns, 'base')
    for name in ('t', 'q', 'qd'):
        np.testing.assert_array_equal(getattr(live.joints, name), getattr(bag.joints, name))
    inside = bag.measured.t >= 0.0
    np.testing.assert_array_equal(live.measured.rotation, bag.measured.rotation[inside])
    for signal in ('wrench', 'temperature'):
        ours, theirs = getattr(live, signal), getattr(bag, signal)
        np.testing.assert_array_equal(ours.value, theirs.value)
        assert ours.held and isinstance(theirs, Signal)


def measured():
    """Yield measured poses at 60 Hz."""
    rng = np.random.default_rng(8)
    for ns in range(START, START + SECOND, 16_666_667):
        rotation = rotation_matrix(rng.normal(size=3))
        yield ns, '/measured/tool_pose', MAKE.pose(ns, rng.normal(size=3), rotation)
