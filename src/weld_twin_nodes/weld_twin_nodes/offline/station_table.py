# Copyright 2026 weld_twin contributors
# SPDX-License-Identifier: Apache-2.0
"""Deviations of single stations as a table and a picture."""

from __future__ import annotations

import io
from pathlib import Path

import numpy as np

from weld_twin_core.arrays import Array
from weld_twin_core.metrics.deviation import deviation
from weld_twin_core.recording import Recording
from weld_twin_msgs_py.files.whole_files import write_text

COLUMNS = 't_s,x_m,y_m,z_m,dx_m,dy_m,dz_m,d_m'


def write_table(path: Path | str, recording: Recording, off: Array) -> None:
    """
    Write measured positions and their deviations, shape (M, 3) [m], as CSV.

    Raises
    ------
    DataError
        The file exists or cannot be written.

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
