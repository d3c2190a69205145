# Copyright 2026 weld_twin contributors
# SPDX-License-Identifier: Apache-2.0
"""What an investigation asks for is run and recorded in the cell that is up, over DDS."""

import numpy as np
import pytest

import weld_twin_core as wt
from weld_twin_core.errors import DataError, TwinError
from weld_twin_msgs_py.bags import read_recording
from weld_twin_msgs_py.files.joint_file import write_joint_motion
from weld_twin_nodes.harness import Cell
from weld_twin_nodes.harness.recorded_experiment import recorded_experiment

pytestmark = pytest.mark.cells

OFFSET = '[{effect: joint_offset, joint: elbow_joint, offset: 0.01}]'


@pytest.fixture
def asked(tmp_path):
    """A motion of two seconds as an experiment is written, and its joints."""
    robot = wt.load('ur5')
    t = np.linspace(0.0, 2.0, 21)
    q = np.array([0.2, -1.3, 1.5, -1.8, -1.5, 0.1]) + 0.2 * np.sin(np.pi * t / 2.0)[:, None] ** 2
    names = list(robot.joint_names)
    motion = {'static': False, 'joint_names': names, 't': t.tolist(), 'q': q.tolist()}
    write_joint_motion(tmp_path / 'experiment.yaml', motion, 'Run the path.')
    return tmp_path / 'experiment.yaml', robot


def test_the_recording_holds_the_motion_and_what_the_cell_measured(asked, tmp_path):
    experiment, robot = asked
    with Cell(tmp_path / 'cell') as cell:
        # The motion waits for recorder and injector, and the injector's first pose for the recorder.
        injector = {'robot': 'ur5', 'effects': OFFSET, 'wait_for_subscribers': 1}
        cell.start('error_injector', reliable_inputs=True, **injector)
        moving = {'rate': 25.0, 'wait_for_subscribers': 2}
        bag = recorded_experiment(experiment, 'ur5', 2.0, tmp_path / 'bag', **moving)
        with pytest.raises(DataError, match='exists already'):
            recorded_experiment(experiment, 'ur5', 2.0, tmp_path / 'bag')
    recording = read_recording(bag, robot)
    assert recording.joints.t.size == 51 and recording.measured.t.size >= 50
    bent = wt.Twin(robot, [wt.effects.JointOffset('elbow_joint', offset=0.01)])
    seen = bent.poses(recording, recording.measured.t)
    assert np.allclose(recording.measured.position, seen.position, atol=1e-6)


def test_a_generator_that_cannot_run_it_is_heard(tmp_path):
    with Cell(tmp_path / 'cell'), pytest.raises(TwinError, match=r'the generator failed.*nothing'):
        recorded_experiment(tmp_path / 'nothing.yaml', 'ur5', 2.0, tmp_path / 'bag')
