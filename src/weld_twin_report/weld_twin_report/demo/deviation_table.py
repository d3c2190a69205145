# Copyright 2026 weld_twin contributors
# SPDX-License-Identifier: Apache-2.0
"""The numbers of the demo: every deviation as CSV, the summary as text."""

from __future__ import annotations

import numpy as np

from weld_twin_core.metrics.deviation import deviation
from weld_twin_msgs_py.files.whole_files import write_text

from .hand_over import Job

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
