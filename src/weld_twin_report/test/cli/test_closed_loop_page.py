# Copyright 2026 weld_twin contributors
# SPDX-License-Identifier: Apache-2.0
"""The page of a seam that was welded twice says what was measured, and by which way."""

import numpy as np

from weld_twin_report.demo.closed_loop import Seam, closed_loop_page


def seam(off):
    meant = np.stack([np.linspace(0.0, 0.3, 31), np.zeros(31), np.full(31, 0.5)], axis=1)
    return Seam(meant, meant + [0.0, 0.0, off])


def test_both_runs_stand_beside_each_other(kept):
    for way in ('poses', 'goals'):
        kept(f'closed_loop_{way}', closed_loop_page('ur5', (seam(4e-4), seam(-3e-5)), way, 2e-5))


def test_distance_and_way_of_a_run_are_those_of_its_points():
    run = seam(4e-4)
    assert abs(run.rms - run.worst) < 1e-12
    assert abs(run.rms - 4e-4) < 1e-12
    assert abs(run.way[-1] - 0.3) < 1e-12
