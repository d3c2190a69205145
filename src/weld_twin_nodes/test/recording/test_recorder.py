# Copyright 2026 weld_twin contributors
# SPDX-License-Identifier: Apache-2.0
"""The recorder as a program: killed, split, and on a disk that fills up."""

import json
import shutil
import signal
import sys

import numpy as np
import pytest
from recorder_words import numbers

pytest.importorskip('rclpy', reason='needs ROS 2')

from weld_twin_core import DataError, JointMotion, catalog
from weld_twin_msgs_py.bags import recover

pytestmark = pytest.mark.cells

ROBOT = catalog.load('ur5')
NUMBERED = 1_000_000_000
BLOCKS = 100
"""Half a kilobyte or a kilobyte each, as the shell has it; some hundred messages."""


def flushed(folder):
    """Return how many messages a copy of the growing bag would be recovered with."""
    for name in ('copy', 'copy.unfinished'):
        shutil.rmtree(folder / name, ignore_errors=True)
    shutil.copytree(folder / 'bag.unfinished', folder / 'copy.unfinished')
    try:
        recover(folder / 'copy')
    except DataError:  # nothing whole yet
        return 0
    return len(numbers(folder / 'copy'))


def motion(samples):
    """Return a motion whose stamps are the numbers of its samples [ns]."""
    return JointMotion(np.arange(samples) * 1e-9, np.zeros((samples, ROBOT.n)))


def test_a_recorder_on_a_full_disk_ends_with_a_sentence_and_loses_nothing_flushed(cell, tmp_path):
    parameters = {'out': tmp_path / 'bag', 'flush_every': 0.05, 'reliable_inputs': 'true'}
    words = [f'-p {name}:={value}' for name, value in parameters.items()]
    # What it compiles would be cut off, too, and stay: -B.
    command = f'{sys.executable} -B -m weld_twin_nodes.live.recorder --ros-args {" ".join(words)}'
    recorder = cell.start(['sh', '-c', f'ulimit -f {BLOCKS}; exec {command}'])
    publisher = cell.publisher()
    cell.trigger('/recorder/counts')

    def publish(stamps):
        for number in stamps:
            publisher.publish(
                cell.messages.joint_state(NUMBERED + number, ROBOT.joint_names, np.zeros(ROBOT.n))
            )

    publish(range(150))
    cell.wait_recorded({'/joint_states': 150})
    cell.wait(lambda: flushed(tmp_path) >= 120, 'these to be flushed')
    publish(range(150, 900))  # fewer than the queues hold, more than the file may
    assert recorder.end() == 2
    cell.processes.remove(recorder)
    assert 'cannot be written' in recorder.log
    assert f"'weld-twin bag recover {tmp_path}/bag'" in recorder.log
    assert 'Traceback' not in recorder.log
    recover(tmp_path / 'bag')
    found = numbers(tmp_path / 'bag')
    assert found == list(range(len(found)))
    assert len(found) > 100


def test_a_recorder_splits_its_bag_and_tells_what_it_holds(cell, tmp_path):
    recorder = cell.start(
        'recorder',
        out=str(tmp_path / 'bag'),
        storage='sqlite3',  # the others record as they do unless told
        split_size=0.02,
        reliable_inputs=True,
    )
    cell.feed(motion(300), ROBOT.joint_names, start_ns=NUMBERED)
    cell.wait_recorded({'/joint_states': 300})
    told = json.loads(cell.trigger('/recorder/counts').message)
    assert told['/joint_states'] == 300
    assert told['dropped'] == {}
    recorder.signal(signal.SIGINT)
    assert recorder.end() == 0
    assert len(list((tmp_path / 'bag').iterdir())) > 3
    assert numbers(tmp_path / 'bag') == list(range(300))
