# Copyright 2026 weld_twin contributors
# SPDX-License-Identifier: Apache-2.0
"""Four nodes in four processes over DDS, recorded, against the same run computed in bulk."""

from collections import defaultdict

import numpy as np
import pytest
from recorder_words import heard_of

from weld_twin_core.arm import catalog
from weld_twin_msgs_py.bags import BagReader, bag_info, provenance
from weld_twin_msgs_py.messages import from_messages
from weld_twin_nodes.harness import Cell
from weld_twin_nodes.offline.given_twin import build_twin
from weld_twin_nodes.offline.seam_motion import plan_motion, stamps
from weld_twin_nodes.offline.simulation import Simulation, write_simulation

pytestmark = pytest.mark.cells

EFFECTS = """
- {effect: backlash, joint: elbow_joint, width: 5e-4}
- {effect: servo_lag, joint: shoulder_pan_joint, time_constant: 0.02}
- {effect: joint_compliance, joint: shoulder_lift_joint, compliance: 2e-6}
- {effect: link_length, joint: elbow_joint, da: 3e-4}
- {effect: drift, xyz_rate: [1e-5, 0, -2e-5]}
- {effect: time_delay, delay: 0.013}
- {effect: measurement_noise, sigma: 2e-5}
"""
SENDERS = {
    '/joint_states': 'trajectory_generator',
    '/actual/joint_states': 'error_injector',
    '/measured/tool_pose': 'error_injector',
    '/twin/tool_pose': 'forward_kinematics_twin',
    '/deviation': 'deviation_analyzer',
}
START = 1_700_000_000_000_000_000
RATE = 50.0
EACH = tuple(SENDERS)[:-1]
"""Topics with a message for every sample of the motion."""


def run_cell(folder, plan, effects, seed=7):
    """Run generator, injector, twin and analyzer live; return the recorder's bag and its log."""
    with Cell(folder) as cell:
        sure = {'reliable_inputs': True}
        recorder = cell.start('recorder', out=str(folder / 'live'), **sure)
        analyzing = {'path_length': plan.length, 'metrics_idle': 0.3}
        cell.start('deviation_analyzer', wait_for_subscribers=2, **analyzing, **sure)
        cell.start('forward_kinematics_twin', wait_for_subscribers=2, **sure)
        cell.start('error_injector', effects=effects, seed=seed, wait_for_subscribers=2, **sure)
        metrics = cell.collect('/deviation/metrics')
        cell.meet()  # the motion is over before an analyzer that met this process late tells anything
        moving = {'path': 'line', 'profile': 'aggressive', 'rate': RATE, 'start_stamp_ns': START}
        paced = {'playback': 0.0, 'follow': '/deviation', 'wait_for_subscribers': 3}
        cell.start('trajectory_generator', **moving, **paced, **sure)
        n, delayed = plan.motion.t.size, 1 if 'time_delay' in effects else 0
        _wait_for_all(cell, metrics, n, n - delayed)
        # A node says once a second what it sent; of one that is over sooner nothing would be known.
        heard_of(cell, recorder)
        recorder.interrupt()
        assert recorder.end() == 0
    return folder / 'live', recorder.log


def _wait_for_all(cell, metrics, samples, pairs):
    """Wait until the last metrics are out and the recorder has everything."""
    cell.wait(
        lambda: bool(metrics.messages) and from_messages.metrics(metrics.last)['samples'] >= pairs,
        'the last metrics',
    )
    wanted = dict.fromkeys(EACH, samples)
    cell.wait_recorded({**wanted, '/deviation': pairs, '/deviation/metrics': len(metrics)})


def content(path):
    """Return stamps and numbers of every topic of a bag."""
    read = {
        'sensor_msgs/msg/JointState': lambda m: [*m.position, *m.velocity],
        'geometry_msgs/msg/PoseStamped': lambda m: [
            *from_messages.pose(m)[0],
            *from_messages.pose(m)[1].flat,
        ],
        'geometry_msgs/msg/Vector3Stamped': from_messages.vector3,
        'diagnostic_msgs/msg/DiagnosticArray': lambda m: [
            v for k, v in from_messages.metrics(m).items() if k != 'waiting'
        ],
    }
    rows = defaultdict(list)
    with BagReader(path) as bag:
        for topic, kind, _, message in bag.messages([t for t, (_, n) in bag.topics.items() if n]):
            rows[topic].append((from_messages.stamp_ns(message), read[kind](message)))
    return {
        topic: (np.array([s for s, _ in found]), np.array([v for _, v in found]))
        for topic, found in rows.items()
    }


@pytest.fixture(scope='module')
def live_and_offline(tmp_path_factory):
    folder = tmp_path_factory.mktemp('four')
    robot = catalog.load('ur5')
    plan = plan_motion(robot, 'line', 'aggressive', RATE)
    live, log = run_cell(folder, plan, EFFECTS)
    simulation = Simulation(
        build_twin(robot, effects=EFFECTS),
        build_twin(robot),
        plan.motion,
        stamps(plan.motion.t, START),
        7,
        plan.length,
    )
    write_simulation(folder / 'offline', simulation)
    return live, folder / 'offline', robot, log


def test_the_recorded_bag_holds_what_the_offline_twin_computes(live_and_offline):
    live, offline = (content(path) for path in live_and_offline[:2])
    assert live.keys() == offline.keys()
    assert len(live) == 6
    # A pause of the machine may add a metrics message in between; those due are all there.
    stamp, values = live['/deviation/metrics']
    due = np.isin(stamp, offline['/deviation/metrics'][0])
    live['/deviation/metrics'] = stamp[due], values[due]
    for topic, (stamp, values) in offline.items():
        np.testing.assert_array_equal(live[topic][0], stamp, err_msg=topic)
        np.testing.assert_allclose(live[topic][1], values, rtol=1e-10, atol=1e-12, err_msg=topic)


def test_the_recorded_bag_says_how_it_came_about(live_and_offline):
    live, offline, robot, log = live_and_offline
    made = provenance(live)
    assert made['robot'] == robot.to_mapping()
    assert made['seed'] == 7
    assert made['version']
    assert made['effects'] == provenance(offline)['effects']
    assert made['effects'][0]['effect'] == 'backlash'
    sent = len(content(live)['/joint_states'][0])
    whole = {'sent': sent, 'recorded': sent, 'missing': 0}
    for topic, node in SENDERS.items():
        # A node that a busy computer holds up at the end tells nothing, and is named for it.
        if topic not in made['completeness']:
            assert f'/{node} has not told what it sent' in log, topic
        elif topic in EACH:
            assert made['completeness'][topic] == whole
        else:
            assert made['completeness'][topic]['missing'] == 0
    assert bag_info(live).incomplete == ()
