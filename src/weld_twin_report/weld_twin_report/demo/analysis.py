# Copyright 2026 weld_twin contributors
# SPDX-License-Identifier: Apache-2.0
"""The offline part: the bag against the twin, the errors ranked, the numbers written, the seam drawn."""

from __future__ import annotations

from typing import Any

import numpy as np

from weld_twin_core.arrays import Array
from weld_twin_core.errors import DataError
from weld_twin_core.metrics.deviation import deviation, deviation_metrics
from weld_twin_core.motion.seam_frame import seam_components
from weld_twin_core.sensitivity import default_tolerances, local_sensitivity, study_of_plan
from weld_twin_core.twin.poses import Poses
from weld_twin_core.twin.twin import Twin
from weld_twin_msgs_py.bags import read_recording
from weld_twin_msgs_py.files.whole_files import write_json, write_text

from .hand_over import Job


def analyse(job: Job, _: object) -> None:
    """Fill in the recording, its deviations from the nominal twin, and their metrics."""
    job.recording = read_recording(job.bag, job.robot)
    measured = job.recording.measured
    if measured is None:
        raise DataError(f"bag '{job.bag}' holds no measurements")
    expected = Twin(job.robot).poses(job.recording, measured.t)
    actual = expected if measured.rotation is None else Poses(measured.position, measured.rotation)
    job.deviation = measured.position - expected.position
    # The plan's stamps are those of the joint states, so each measurement finds its place on
    # the seam by time.
    place = np.searchsorted(job.plan.motion.t, measured.t - 1e-9).clip(max=len(job.plan.s) - 1)
    tangent, normal = job.plan.seam.tangent[place], job.plan.seam.normal[place]
    job.seam_deviation = seam_components(job.deviation, tangent, normal)
    job.metrics = deviation_metrics(
        actual,
        expected,
        t=measured.t,
        path_length_m=job.plan.length,
        tangent=tangent,
        normal=normal,
    )


FAMILIES = ('joint_offset', 'link_length', 'link_twist', 'backlash', 'base_pose')
NAMED = 3
"""Parameters that the demo names."""


def rank(job: Job, _: object) -> None:
    """Write ``sensitivity.json`` and name the parameters that move the tool most."""
    study = study_of_plan(job.robot, job.plan)
    result = local_sensitivity(study, default_tolerances(job.robot, FAMILIES)).as_dict()
    write_json(job.folder / 'sensitivity.json', result)
    leaders = ', '.join(
        f'{row["name"]} {row["contribution_m"] * 1e3:.2f} mm'
        for row in result['parameters'][:NAMED]
    )
    job.lines.append(f'matters   at typical tolerances {leaders}')


MARK = 'summary.txt'
COLUMNS = 't_s,dx_m,dy_m,dz_m,along_m,across_m,normal_m,d_m'
"""Measured minus twin, in the robot's base frame and along the seam; ``d_m`` is its length."""


def write_table(job: Job, _: object) -> None:
    """Write ``deviation.csv`` and ``summary.txt``."""
    measured = job.recording.measured
    assert measured is not None
    rows = np.column_stack(
        [measured.t, job.deviation, job.seam_deviation, deviation(job.deviation)]
    )
    np.savetxt(
        job.folder / 'deviation.csv', rows, delimiter=',', header=COLUMNS, comments='', fmt='%.9g'
    )
    job.lines = _summary(job) + job.lines
    write_text(job.folder / MARK, '\n'.join(job.lines) + '\n')


def _summary(job: Job) -> list[str]:
    m = job.metrics
    injected = ', '.join(_described(effect.to_mapping()) for effect in job.effects)

    def mm(value: float | None) -> str:
        return 'unknown' if value is None else f'{value * 1e3:8.4f} mm'

    return [
        f'robot     {job.robot.name}, seam of {job.plan.length:.3f} m in '
        f'{job.plan.report.duration:.1f} s, {m.samples} poses measured',
        f'injected  {injected}',
        f'RMS       {mm(m.rms_m)}     along   {mm(m.along_rms_m)}',
        f'mean      {mm(m.mean_m)}     across  {mm(m.across_rms_m)}',
        f'95 %      {mm(m.p95_m)}     normal  {mm(m.normal_rms_m)}',
        f'max       {mm(m.max_m)}     D_norm  {m.d_norm:.3e}   D_cum {m.d_cum_m:.4f} m',
    ]


def _described(entry: dict[str, object]) -> str:
    name, joint = entry.pop('effect'), entry.pop('joint', None)
    values = ', '.join(f'{key} {value:g}' for key, value in entry.items())
    return f'{name} of {joint} ({values})' if joint else f'{name} ({values})'


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
