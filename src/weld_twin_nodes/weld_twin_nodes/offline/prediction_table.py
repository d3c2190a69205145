# Copyright 2026 weld_twin contributors
# SPDX-License-Identifier: Apache-2.0
"""Predicted poses as a table for spreadsheets, with how sure each is."""

from __future__ import annotations

import io
from pathlib import Path

import numpy as np

from weld_twin_core.arm.rotation import quaternion_from_matrix
from weld_twin_core.recording import Recording
from weld_twin_msgs_py.files.whole_files import write_text

from .prediction import Predictor

POSE = 't_s,x_m,y_m,z_m,qx,qy,qz,qw'
SIGMA = 'sigma_x_m,sigma_y_m,sigma_z_m,sigma_rx_rad,sigma_ry_rad,sigma_rz_rad,outside'


def write_prediction_table(path: Path | str, model: Predictor, recording: Recording) -> None:
    """
    Write the twin's pose at every joint state as CSV.

    Where the model knows how sure it is, standard deviations along and about the world's axes
    follow, and whether the pose lies outside what was recorded (1) or not (0).

    Parameters
    ----------
    path : Path or str
        Must not exist.

    Raises
    ------
    DataError
        The file exists or cannot be written.

    """
    t = recording.joints.t
    poses = model.twin.poses(recording, t)
    columns = [t, poses.position, quaternion_from_matrix(poses.rotation)]
    covariances = model.covariances(recording)
    head = POSE
    if covariances is not None:
        flags = np.zeros(t.size)
        for start, end, _ in model.outside(recording):
            flags[(t - t[0] >= start) & (t - t[0] <= end)] = 1.0
        columns += [np.sqrt(covariances[:, range(6), range(6)]), flags]
        head = f'{POSE},{SIGMA}'
    text = io.StringIO()
    np.savetxt(text, np.column_stack(columns), delimiter=',', header=head, comments='', fmt='%.9g')
    write_text(path, text.getvalue())
