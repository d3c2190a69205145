# Copyright 2026 weld_twin contributors
# SPDX-License-Identifier: Apache-2.0
"""Recorder and live diagnosis as managed nodes, driven by the standard services."""

import signal
import time

import pytest
from recorder_words import numbers

pytest.importorskip('rclpy', reason='needs ROS 2')

import numpy as np
from lifecycle_msgs.msg import Transition
from lifecycle_msgs.srv import ChangeState, GetState

from weld_twin_core.arm.catalog import load
from weld_twin_msgs_py.messages.topics import JOINT_STATES
from weld_twin_nodes.harness.cell import HealthListener

pytestmark = pytest.mark.cells

ROBOT = load('ur5')
S = 1_000_000_000


class Managed:
    """A node as a life-cycle manager sees it."""

    def __init__(self, cell, name):
        self.cell, self.name = cell, name
        node = cell.node
        self._change = node.create_client(ChangeState, f'/{name}/change_state')
        self._state = node.create_client(GetState, f'/{name}/get_state')
        for client in (self._change, self._state):
            cell.wait(client.service_is_ready, f'the services of {name}')
        self.cell.meet()

    def _call(self, client, request):
        answer = client.call_async(request)
        self.cell.wait(answer.done, f'{self.name} to answer')
        return answer.result()

    def begin(self, name):
        """Ask for a transition; return what will have the answer."""
        number = getattr(Transition, f'TRANSITION_{name.upper()}')
        request = ChangeState.Request(transition=Transition(id=number))
        return self._change.call_async(request)

    def change(self, name):
        answer = self.begin(name)
        self.cell.wait(answer.done, f'{self.name} to answer')
        return answer.result().success

    @property
    def state(self):
        return self._call(self._state, GetState.Request()).current_state.label


def send(cell, publisher, numbers):
    """Publish joint states whose stamps are their numbers, to a listener that is there."""
    cell.wait(lambda: publisher.get_subscription_count() > 0, 'the recorder to listen')
    for number in numbers:
        stamp = S + number
        publisher.publish(cell.messages.joint_state(stamp, ROBOT.joint_names, np.zeros(6)))


def test_a_managed_recorder_records_between_two_transitions_and_again(cell, tmp_path):
    first, second = tmp_path / 'first', tmp_path / 'second'
    publisher = cell.node.create_publisher(
        JOINT_STATES.message_class(), JOINT_STATES.name, JOINT_STATES.offered.to_rclpy()
    )
    cell.start('recorder', managed=True, out=str(first), topics=['joint_states'])
    recorder = Managed(cell, 'recorder')
    assert recorder.state == 'unconfigured'
    assert not recorder.change('activate')  # not the way of a managed node, and no end of it
    assert recorder.change('configure')
    assert recorder.state == 'inactive'
    assert cell.node.count_subscribers('/joint_states') == 0
    assert recorder.change('activate')
    send(cell, publisher, range(50))
    answer = cell.set_parameter('recorder', 'out', str(second))
    assert not answer.successful
    assert 'is being recorded; a bag keeps its name' in answer.reason
    assert recorder.change('deactivate')
    assert numbers(first) == list(range(50))
    assert not recorder.change('activate')  # the bag is there
    assert recorder.state == 'inactive'
    assert cell.set_parameter('recorder', 'out', str(second)).successful
    assert recorder.change('activate')
    send(cell, publisher, range(100, 130))
    assert recorder.change('active_shutdown')
    assert recorder.state == 'finalized'
    assert numbers(second) == list(range(100, 130))
    assert cell.processes[0].stop() == 0
    assert 'exists already; a recorder replaces nothing' in cell.processes[0].log


def test_a_managed_live_diagnosis_listens_while_it_is_active(cell):
    cell.start('live_diagnosis', managed=True)
    health = HealthListener(cell.node)
    diagnosis = Managed(cell, 'live_diagnosis')
    listening = lambda: cell.node.count_subscribers('/joint_states')  # noqa: E731
    assert diagnosis.change('configure')
    assert listening() == 0
    cell.wait(lambda: ('ok', 'inactive') in health.told['/live_diagnosis'], 'its state')
    assert diagnosis.change('activate')
    cell.wait(lambda: listening() == 1, 'it to listen')
    assert diagnosis.change('deactivate')
    cell.wait(lambda: listening() == 0, 'it to listen no more')
    assert diagnosis.change('cleanup')
    assert diagnosis.state == 'unconfigured'


def test_a_recorder_serves_all_else_while_it_waits_for_a_node_that_stands_still(cell, tmp_path):
    twin = cell.start('forward_kinematics_twin')
    cell.start('recorder', managed=True, out=str(tmp_path / 'bag'), topics=['twin/tool_pose'])
    recorder = Managed(cell, 'recorder')
    assert recorder.change('configure')
    assert recorder.change('activate')
    health = HealthListener(cell.node)
    met = lambda: health.values.get('/recorder: /twin/tool_pose', {}).get('publishers')  # noqa: E731
    cell.wait(lambda: met() == '1', 'the recorder to see the twin')
    twin.signal(signal.SIGSTOP)
    try:
        answer = recorder.begin('deactivate')
        begun, served = time.monotonic(), 0
        while not answer.done():
            state = recorder.state
            if state != 'deactivating':  # the answer to the transition is under way
                cell.wait(answer.done, 'the answer')
                break
            served += 1
            assert not recorder.change('activate')  # and once it is over, the bag is there
            time.sleep(0.3)
    finally:
        twin.signal(signal.SIGCONT)
    assert answer.result().success
    assert time.monotonic() - begun > 2.0
    assert served > 0  # who serves nothing meanwhile answers when it is over
    assert recorder.state == 'inactive'
    assert 'activate is refused: the node is deactivating' in cell.processes[1].log


def test_without_a_manager_nothing_waits(cell, tmp_path):
    cell.start('recorder', out=str(tmp_path / 'bag'), topics=['joint_states'])
    cell.wait(lambda: cell.node.count_subscribers('/joint_states') == 1, 'the recorder')
    names = {name for name, _ in cell.node.get_service_names_and_types()}
    assert '/recorder/change_state' not in names
