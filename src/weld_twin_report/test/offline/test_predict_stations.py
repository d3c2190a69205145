# Copyright 2026 weld_twin contributors
# SPDX-License-Identifier: Apache-2.0
"""`predict` on stations at rest, recorded by others: joint states now and then, and little else."""

import json
import re

import numpy as np
import pytest
import yaml
from command_line import done, refused
from rosbags.rosbag2 import StoragePlugin, Writer
from rosbags.typesys import Stores, get_typestore

from weld_twin_core.arm import catalog
from weld_twin_core.arm.chain import forward
from weld_twin_core.effects import effect_from_mapping
from weld_twin_core.recording import JointMotion, Recording
from weld_twin_core.twin.compensation import compensate
from weld_twin_core.twin.twin import Twin
from weld_twin_msgs_py.bags import BagReader
from weld_twin_nodes.offline.prediction import Compensated, Predictor, farthest_sentence

ARM = catalog.load('kuka_kr6_r900')
RNG = np.random.default_rng(77)
HALF = np.array([1.0, 0.5, 0.6, 1.0, 0.8, 1.2])
CENTRE = np.array([0.0, -1.2, 1.4, 0.0, 0.9, 0.0])
Q = CENTRE + HALF * RNG.uniform(-1.0, 1.0, (36, 6))
ZERO = 1.5e-3
STORE = get_typestore(Stores.ROS2_JAZZY)
STEP = 4.0


def real_points(q):
    """Return where the real tool is: the third joint stands further than it reads."""
    return forward(ARM, q + ZERO * np.eye(6)[2])[:, :3, 3]


def bag(path, q, seen=()):
    """Write joint states some seconds apart, and points 10 ms after those that were measured."""
    kinds = STORE.types
    Time, Header = kinds['builtin_interfaces/msg/Time'], kinds['std_msgs/msg/Header']
    State, Point = kinds['sensor_msgs/msg/JointState'], kinds['geometry_msgs/msg/PointStamped']
    with Writer(path, version=9, storage_plugin=StoragePlugin.MCAP) as writer:
        joints = writer.add_connection('/joint_states', State.__msgtype__, typestore=STORE)
        points = writer.add_connection('/measured/tool_point', Point.__msgtype__, typestore=STORE)
        for k, row in enumerate(q):
            ns = round(1.7e18 + 1e9 * STEP * k)

            def header(at):
                return Header(Time(*divmod(at, 10**9)), 'world')

            none = np.zeros(0)
            state = State(header(ns), list(ARM.joint_names), np.array(row), none, none)
            writer.write(joints, ns, STORE.serialize_cdr(state, State.__msgtype__))
            if k in seen:
                xyz = real_points(row[None])[0] + RNG.normal(0.0, 2e-5, 3)
                point = Point(header(ns + 10**7), kinds['geometry_msgs/msg/Point'](*xyz))
                writer.write(points, ns + 10**7, STORE.serialize_cdr(point, Point.__msgtype__))
    return path


def predicted(path):
    """Return the positions of the twin in a bag that predict wrote, shape (N, 3) [m]."""
    with BagReader(path) as reader:
        told = [m.message.pose.position for m in reader.messages(['/twin/tool_pose'])]
    return np.array([[p.x, p.y, p.z] for p in told])


@pytest.fixture(scope='module')
def diagnosed(tmp_path_factory):
    """Diagnose stations, of which one reading of the instrument is missing."""
    from weld_twin_nodes.cli import main

    folder = tmp_path_factory.mktemp('stations')
    bag(folder / 'rec', Q, set(range(len(Q))) - {11})
    words = ('diagnose', folder / 'rec', '--robot', ARM.name, '--out', folder / 'found')
    assert main([str(word) for word in words]) == 0
    return folder / 'found/diagnosis.json'


def test_stations_without_measurements_are_predicted_as_stations(tmp_path, diagnosed):
    q = CENTRE + 0.8 * HALF * RNG.uniform(-1.0, 1.0, (20, 6))
    result = done('simulate', bag(tmp_path / 'asked', q), '--robot', ARM.name,
                       '--model', diagnosed, '--out', tmp_path / 'told')  # fmt: skip
    sigma = float(re.search(r'within ([\d.e-]+) mm', result)[1])
    assert sigma < 0.15 and 'moves at up to' not in result
    assert json.loads((tmp_path / 'told/prediction.json').read_text()) == {'outside': []}
    assert np.linalg.norm(predicted(tmp_path / 'told') - real_points(q), axis=1).max() < 1.5e-4


@pytest.mark.parametrize('seen', [(), (0, 1, 2, 4, 5, 7, 8, 9)])
def test_a_delay_and_a_lag_do_nothing_at_rest(tmp_path, seen):
    effects = [
        {'effect': 'time_delay', 'delay': 0.02},
        {'effect': 'servo_lag', 'joint': ARM.joint_names[0], 'time_constant': 0.02},
        {'effect': 'joint_offset', 'joint': ARM.joint_names[2], 'offset': ZERO},
    ]
    (tmp_path / 'effects.yaml').write_text(yaml.safe_dump(effects))
    asked = bag(tmp_path / 'asked', Q[:10], set(seen))
    done('simulate', asked, '--robot', ARM.name, '--model', tmp_path / 'effects.yaml',
                       '--out', tmp_path / 'told')  # fmt: skip
    np.testing.assert_allclose(predicted(tmp_path / 'told'), real_points(Q[:10]), atol=1e-9)


def test_a_temperature_that_the_bag_lacks_is_said(tmp_path):
    """All links grow by 12 ppm/K: with the base at the origin, 10 K move the tool by 120 ppm."""
    effects = [{'effect': 'thermal_growth', 'coefficient': 12e-6, 'reference': 20.0}]
    (tmp_path / 'effects.yaml').write_text(yaml.safe_dump(effects))
    asked = bag(tmp_path / 'asked', Q[:6])
    words = ('simulate', asked, '--robot', ARM.name, '--model', tmp_path / 'effects.yaml', '--out')
    assert 'say it with --temperature' in refused(*words, tmp_path / 'cold')
    done(*words, tmp_path / 'warm', '--temperature', 30)
    flange = forward(ARM.with_frames(tool=np.eye(4)), Q[:6])[:, :3, 3]
    moved = predicted(tmp_path / 'warm') - forward(ARM, Q[:6])[:, :3, 3]
    np.testing.assert_allclose(moved, 1.2e-4 * flange, atol=2e-6)


@pytest.mark.parametrize(('wrist', 'near'), [(1e-4, True), (0.9, False)])
def test_a_station_that_cannot_be_corrected_near_a_singularity_is_told(wrist, near):
    q = Q[:5].copy()
    q[3, 4] = wrist
    stations = Recording('stations', JointMotion(STEP * np.arange(5.0), q, static=True))
    twist = effect_from_mapping({'effect': 'link_twist', 'joint': 'joint_a6', 'dalpha': 2e-3})
    result = compensate(ARM, [twist], stations)
    made = Compensated(result, Predictor(Twin(ARM)), [], 1.0, result.motion)
    told = farthest_sentence(made, stations)
    assert ('at 12.00 s' in told and 'near a singularity' in told) == near
    assert near or not told
