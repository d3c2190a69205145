# Copyright 2026 weld_twin contributors
# SPDX-License-Identifier: Apache-2.0
"""Deviations of stations and predicted poses as tables for spreadsheets, and as a picture."""

from __future__ import annotations

import io
from pathlib import Path

import numpy as np

from weld_twin_core.arm.rotation import quaternion_from_matrix
from weld_twin_core.arrays import Array
from weld_twin_core.metrics.deviation import deviation
from weld_twin_core.recording import Recording
from weld_twin_msgs_py.files.whole_files import write_text

from .prediction import Predictor

COLUMNS = 't_s,x_m,y_m,z_m,dx_m,dy_m,dz_m,d_m'


def write_table(path: Path | str, recording: Recording, off: Array) -> None:
    """
    Write measured positions and their deviations, shape (M, 3) [m], as CSV.

    Raises DataError: the file exists or cannot be written.
    """
    measured = recording.measured
    assert measured is not None
    text = io.StringIO()
    rows = np.column_stack([measured.t, measured.position, off, deviation(off)])
    np.savetxt(text, rows, delimiter=',', header=COLUMNS, comments='', fmt='%.9g')
    write_text(path, text.getvalue())


def draw(path: Path | str, recording: Recording, off: Array) -> None:
    """Draw where the stations are off and how often by how much."""
    import matplotlib

    matplotlib.use('Agg')
    from matplotlib.figure import Figure

    measured = recording.measured
    assert measured is not None
    size = deviation(off) * 1e3
    figure = Figure(figsize=(10.0, 4.6), layout='constrained', dpi=120)
    left, right = figure.subplots(1, 2, width_ratios=(1.3, 1.0))
    where, vector = measured.position[:, :2] * 1e3, off[:, :2] * 1e3
    arrows = left.quiver(*where.T, *vector.T, size, cmap='viridis', width=0.003)
    figure.colorbar(arrows, ax=left, label='deviation D [mm]', pad=0.01)
    left.set(aspect='equal', xlabel='x [mm]', ylabel='y [mm]')
    left.set_title(f'{recording.name}: measured minus twin, seen from above', loc='left')
    for name, column in zip('xyz', off.T * 1e3, strict=True):
        right.hist(column, bins=40, histtype='step', label=name)
    right.hist(size, bins=40, color='0.8', label='D', zorder=0)
    right.set(xlabel='deviation [mm]', ylabel='stations')
    right.set_title('base and tool frame not fitted', loc='left')
    right.legend(frameon=False)
    figure.savefig(path)


POSE = 't_s,x_m,y_m,z_m,qx,qy,qz,qw'
SIGMA = 'sigma_x_m,sigma_y_m,sigma_z_m,sigma_rx_rad,sigma_ry_rad,sigma_rz_rad,outside'


def write_prediction_table(path: Path | str, model: Predictor, recording: Recording) -> None:
    """
    Write the twin's pose at every joint state as CSV.

    Where the model knows how sure it is, standard deviations along and about the world's axes
    follow, and whether the pose lies outside what was recorded (1) or not (0).

    ``path``: must not exist. Raises DataError: the file exists or cannot be written.
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
