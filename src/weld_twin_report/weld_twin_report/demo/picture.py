# Copyright 2026 weld_twin contributors
# SPDX-License-Identifier: Apache-2.0
"""The seam from above with the deviation magnified, and the deviation over the way."""

from __future__ import annotations

from typing import Any

import numpy as np

from weld_twin_core.arrays import Array
from weld_twin_core.metrics.deviation import deviation

from .hand_over import Job

SHOWN = 0.1
"""Part of the seam's extent that the largest magnified deviation takes."""
COLOURS = {'along': '#1b7837', 'across': '#762a83', 'normal': '#e08214'}


def draw(job: Job, _: object) -> None:
    """Write ``seam.png``."""
    import matplotlib

    matplotlib.use('Agg')
    from matplotlib.figure import Figure

    figure = Figure(figsize=(9.0, 7.6), layout='constrained', dpi=120)
    top, bottom = figure.subplots(2, 1, height_ratios=(1.5, 1.0))
    _seam(top, job)
    _course(bottom, job)
    figure.savefig(job.folder / 'seam.png')


def _seam(axes: Any, job: Job) -> None:
    """Draw the seam in its plane: to the right the way from start to end."""
    measured = job.recording.measured
    assert measured is not None
    nominal = measured.position - job.deviation
    plane = _plane(nominal, job.plan.seam.normal[0])
    flat, off = (nominal - nominal[0]) @ plane, job.deviation @ plane
    factor = _round(SHOWN * np.ptp(flat, axis=0).max() / np.linalg.norm(off, axis=1).max())
    shown = flat + factor * off
    axes.plot(*flat.T * 1e3, color='black', lw=1.2, label='seam, as the twin has it')
    size = deviation(job.deviation) * 1e3
    marks = axes.scatter(
        *shown.T * 1e3,
        c=size,
        cmap='viridis',
        s=7,
        zorder=3,
        label=f'measured, deviation magnified {factor:g} times',
    )
    for k in np.linspace(0, len(flat) - 1, 40).astype(int):
        axes.plot(*np.stack([flat[k], shown[k]]).T * 1e3, color='0.6', lw=0.6, zorder=1)
    axes.annotate('start', flat[0] * 1e3, xytext=(0, -14), textcoords='offset points', ha='center')
    axes.set(aspect='equal', xlabel='from start to end [mm]', ylabel='to the left [mm]')
    axes.margins(0.06, 0.18)
    axes.figure.colorbar(marks, ax=axes, label='deviation D [mm]', pad=0.01)
    axes.legend(loc='upper right', frameon=False, markerscale=2.0)
    axes.set_title(f'{job.robot.name}: the seam seen from above the work', loc='left')


def _course(axes: Any, job: Job) -> None:
    measured = job.recording.measured
    assert measured is not None
    way = np.interp(measured.t, job.plan.motion.t, job.plan.s) * 1e3
    for column, (name, colour) in zip(job.seam_deviation.T, COLOURS.items(), strict=True):
        axes.plot(way, column * 1e3, color=colour, lw=1.0, label=name)
    axes.plot(way, deviation(job.deviation) * 1e3, color='black', lw=1.2, label='D')
    axes.axhline(0.0, color='0.7', lw=0.6, zorder=0)
    axes.set(xlabel='way along the seam [mm]', ylabel='deviation [mm]', xlim=(0.0, way.max()))
    axes.legend(ncols=4, loc='upper center', frameon=False)
    axes.margins(y=0.25)
    rms, d_norm = job.metrics.rms_m * 1e3, job.metrics.d_norm
    axes.set_title(f'RMS {rms:.3f} mm, D_norm {d_norm:.2e}', loc='left')


def _plane(points: Array, normal: Array) -> Array:
    """Return two unit vectors as columns, shape (3, 2): from start to end, and to its left."""
    along = points[-1] - points[0]
    if np.linalg.norm(along) < 1e-6:
        along = points[len(points) // 2] - points[0]
    along = along - (along @ normal) * normal
    along = along / np.linalg.norm(along)
    return np.column_stack([along, np.cross(normal, along)])


def _round(factor: float) -> float:
    """Return 1, 2 or 5 times a power of ten, not above a factor."""
    power = 10.0 ** np.floor(np.log10(factor))
    return float(max(step * power for step in (1.0, 2.0, 5.0) if step * power <= factor))
