# Copyright 2026 weld_twin contributors
# SPDX-License-Identifier: Apache-2.0
"""The live page beside running nodes: what they publish on /diagnosis is on it."""

import subprocess
import sys
import time
import urllib.request

import pytest

from weld_twin_msgs_py.messages.topics import DIAGNOSIS
from weld_twin_nodes.harness.process import own_domain

for needed in ('rclpy', 'fastapi', 'uvicorn'):
    pytest.importorskip(needed, reason='the live page needs ROS 2 and the server')

pytestmark = pytest.mark.cells
SENTENCE = 'The gap of 0.127 mm comes from <backlash> of elbow_joint.'


def test_the_last_verdict_of_the_nodes_is_shown(tmp_path):
    import rclpy
    from diagnostic_msgs.msg import DiagnosticArray, DiagnosticStatus, KeyValue

    words = ['serve', '--port', '0', '--live', '--dir', str(tmp_path)]
    with own_domain():
        process = subprocess.Popen(
            [sys.executable, '-m', 'weld_twin_nodes', *words], stdout=subprocess.PIPE, text=True
        )
        context = rclpy.Context()
        rclpy.init(context=context)
        try:
            address = process.stdout.readline().removeprefix('open ').strip() + 'live'
            assert 'No verdict yet' in read(address)
            node = rclpy.create_node('somebody', context=context)
            publisher = node.create_publisher(DiagnosticArray, DIAGNOSIS.name, 10)
            status = DiagnosticStatus(
                message=SENTENCE, values=[KeyValue(key='status', value='identified')]
            )
            until = time.monotonic() + 60.0
            text = ''
            while 'elbow_joint' not in text and time.monotonic() < until:
                publisher.publish(DiagnosticArray(status=[status]))
                time.sleep(0.2)
                text = read(address)
            assert '&lt;backlash&gt; of elbow_joint' in text
            node.destroy_node()
        finally:
            rclpy.try_shutdown(context=context)
            process.kill()
            process.wait()
            process.stdout.close()


def read(address):
    with urllib.request.urlopen(address, timeout=60) as answer:
        return answer.read().decode()
