# Copyright 2026 weld_twin contributors
# SPDX-License-Identifier: Apache-2.0
"""A recording as a user has it: written as a bag or as a table, and read again."""

from __future__ import annotations

import csv
from pathlib import Path

import numpy as np

from weld_twin_core.arm.robot import Robot
from weld_twin_core.arm.rotation import quaternion_from_matrix
from weld_twin_core.recording import Recording
from weld_twin_msgs_py.bags import read_recording, write_recording
from weld_twin_msgs_py.tables import read_table


def as_bag(recording: Recording, robot: Robot, folder: Path) -> Recording:
    """Return the recording after it was a bag in the folder."""
    write_recording(folder / 'bag', recording, robot)
    return read_recording(folder / 'bag', robot, one_clock=False)


def as_table(recording: Recording, robot: Robot, folder: Path) -> Recording:
    """Return the stations of a recording after they were a table, read without any option."""
    seen = recording.measured
    assert seen is not None
    q = recording.joints.at(seen.t)[0]
    heads = [*robot.joint_names, 'x', 'y', 'z']
    rows = np.concatenate([q, seen.position], axis=1)
    if seen.rotation is not None:
        heads += ['qx', 'qy', 'qz', 'qw']
        rows = np.concatenate([rows, quaternion_from_matrix(seen.rotation)], axis=1)
    path = folder / 'table.csv'
    with path.open('w', newline='', encoding='utf-8') as file:
        writer = csv.writer(file)
        writer.writerow(heads)
        writer.writerows([f'{value:.9f}' for value in row] for row in rows)
    return read_table(path, robot).recording
