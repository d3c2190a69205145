# Copyright 2026 weld_twin contributors
# SPDX-License-Identifier: Apache-2.0
"""One twin in its own process beside a controller that does what controllers do."""

import time

import numpy as np
import pytest
import yaml
from rclpy.parameter import Parameter, parameter_value_to_python
from rclpy.parameter_client import AsyncParameterClient
from rclpy.qos import ReliabilityPolicy

from weld_twin_core.errors import DataError
from weld_twin_msgs_py.messages.topics import JOINT_STATES, TOOL_WRENCH
from weld_twin_nodes.harness import Cell
from weld_twin_nodes.harness.cell import HealthListener
from weld_twin_nodes.live.contact_marker import ContactMarker

pytestmark = pytest.mark.cells

S = 1_000_000_000
Q = np.array([0.1, -1.2, 1.5, -1.8, -1.5, 0.3])
TWIN = 'forward_kinematics_twin'
OVERRIDE = 'qos_overrides./joint_states.subscription.reliability'


class Bench:
    """A twin with parameters of all kinds, and a controller that also drives a track."""

    def __init__(self, cell, robot):
        self.cell, self.robot = cell, robot
        self.parameters = {
            'joints_beside': 'gripper',
            'T_measuring_base': [0.1, 0.0, 0.0, 0.0, 0.0, 0.0],
            'qos_overrides': {'/joint_states': {'subscription': {'reliability': 'reliable'}}},
        }
        self.twin = cell.start(TWIN, **self.parameters)
        self.health = HealthListener(cell.node)
        self.out = cell.publisher(JOINT_STATES)
        self.stamp, self.beside = S, {}

    def run(self, seconds):
        """Send joint states at 100 Hz."""
        end = time.monotonic() + seconds

        def over():
            self.stamp += S // 100
            names = (*self.beside, *self.robot.joint_names)
            q = np.array([*self.beside.values(), *Q])
            self.out.publish(self.cell.messages.joint_state(self.stamp, names, q))
            time.sleep(0.01)
            return time.monotonic() > end

        self.cell.wait(over, 'some time')

    def load(self, force):
        """Tell a force at the tool three times."""
        wrench = self.cell.publisher(TOOL_WRENCH)
        message = TOOL_WRENCH.message_class()()
        message.header.frame_id = 'tool'
        message.wrench.force.x = force
        for k in range(1, 4):
            message.header.stamp.sec = k
            wrench.publish(message)

    def wait_warned(self, sentence):
        def warned():
            self.run(0.05)
            return any(
                sentence in text and level == 'warn'
                for level, text in self.health.told[f'/{TWIN}']
            )

        self.cell.wait(warned, f'{sentence!r} to be told')

    def dump(self, node):
        """Return what `ros2 param dump` writes: all that is listed, in one question."""
        client = AsyncParameterClient(self.cell.node, node)
        self.cell.wait(client.services_are_ready, f'the parameters of {node}')
        names = sorted(self.cell.ask(client.list_parameters, 'the list').result.names)
        told = self.cell.ask(lambda: client.get_parameters(names), 'the values').values
        assert len(told) == len(names)
        values = [parameter_value_to_python(value) for value in told]
        return {
            name: list(value) if isinstance(value, list) or hasattr(value, 'typecode') else value
            for name, value in zip(names, values, strict=True)
        }


@pytest.fixture(scope='module')
def bench(tmp_path_factory, robot):
    with Cell(tmp_path_factory.mktemp('told')) as cell:
        yield Bench(cell, robot)


def test_joints_beside_the_robot_are_named_once_and_told_when_one_moves(bench):
    right = {f'right_{name}': 0.3 for name in bench.robot.joint_names}
    bench.beside = {'gripper': 0.0, 'rail/track': 1.0, **right}
    bench.run(0.3)
    bench.beside |= {'gripper': 0.5, 'right_elbow_joint': 0.9}
    bench.cell.wait(lambda: 'are left out: gripper, rail/track' in bench.twin.log, 'their names')
    bench.run(0.3)
    assert 'moved and' not in bench.twin.log  # what grips, and another arm, carry nothing
    bench.beside['rail/track'] = 1.003
    bench.wait_warned('rail/track moved and is none of the joints of robot')
    assert bench.twin.log.count('are left out') == 1


def test_stamps_that_jump_forwards_and_that_begin_anew_are_told(bench):
    bench.run(0.4)
    bench.stamp += 1000 * S
    # By how much is told less the time that passed meanwhile, which may be seconds on a busy machine.
    bench.wait_warned('the stamps jumped forwards by ')
    bench.stamp -= 900 * S
    bench.wait_warned('the stamps begin anew, ')
    assert bench.health.values[f'/{TWIN}: /joint_states']['lost'] == '0'


def test_a_load_that_was_refused_is_no_value_that_counts(bench):
    bench.load(float('inf'))
    values = bench.health.values
    refused = lambda: values.get(f'/{TWIN}: /tool_wrench', {}).get('refused') == '3'  # noqa: E731
    bench.cell.wait(refused, 'the refusals')
    bench.run(4.0)
    assert not any('that counts' in text for _, text in bench.health.told[f'/{TWIN}'])


def test_a_load_that_nobody_tells_any_more_is_told_with_its_age(bench):
    bench.load(0.0)
    bench.wait_warned('/tool_wrench: the value that counts is ')


def test_what_is_dumped_is_whole_and_makes_the_same_node_again(bench, tmp_path):
    dumped = bench.dump(f'/{TWIN}')
    assert dumped['T_measuring_base'] == bench.parameters['T_measuring_base']
    assert dumped[OVERRIDE] == 'reliable'
    assert dumped['effects'] == ''
    file = tmp_path / 'dumped.yaml'
    file.write_text(yaml.safe_dump({'/other/twin': {'ros__parameters': dumped}}))
    module = f'weld_twin_nodes.live.{TWIN}'
    names = ['-r', '__node:=twin', '-r', '__ns:=/other', '-r', 'joint_states:=/joint_states']
    command = ['python', '-m', module, '--ros-args', '--params-file', str(file), *names]
    again = bench.cell.start(command)
    assert bench.dump('/other/twin') == dumped
    asked = bench.cell.node.get_subscriptions_info_by_topic('/joint_states')
    assert {info.qos_profile.reliability for info in asked} == {ReliabilityPolicy.RELIABLE}
    assert again.stop() == 0


def test_a_quality_of_service_that_cannot_be_had_is_refused(cell):
    for key, value, sentence in (
        (
            '/joint_state.subscription.depth',
            10,
            "no node has a topic '/joint_state'; did you mean",
        ),
        (
            '/joint_states.subscription.lifespan',
            1,
            'the policies reliability, durability and depth',
        ),
        ('/joint_states.subscription.reliability', 'no', 'must be reliable or best_effort'),
    ):
        override = [Parameter(f'qos_overrides.{key}', value=value)]
        with pytest.raises(DataError, match=sentence):
            ContactMarker(context=cell.node.context, parameter_overrides=override)
