# Copyright 2026 weld_twin contributors
# SPDX-License-Identifier: Apache-2.0
"""Explain a real UR5 and a real UR10 that a laser tracker measured, on poses never fitted.

Needs the two published data sets; docs/real_robots.md says where they come from. Writes
results.json, a page per robot (ur5.html, ur10.html) and every diagnosis.
"""

from __future__ import annotations

from pathlib import Path

from weld_twin_nodes.cli.options import add_output, output

from ...study import REQUIRED, Study, option, options, study

add_arguments = options(
    option('--ur5', REQUIRED, 'DIR', 'holds grid.csv, random.csv'),
    option('--ur10', REQUIRED, 'DIR', 'holds series_c_random_poses.csv'),
    lambda parser: add_output(parser, 'where results go'),
    out='',
)


@study
def run(study: Study) -> None:
    """Diagnose, judge, write, and print one line for each split."""
    from ...real_robots.arm_study import RESULTS, judged_arms

    with output(study.args, RESULTS) as place:
        robots = judged_arms(Path(study.args.ur5), Path(study.args.ur10), place, study.tell)
    for robot in robots['robots'].values():
        for name, split in robot['splits'].items():
            got = split['got']
            print(
                f'{name}: mean {got["mean_m"] * 1e3:.4f} mm, max {got["max_m"] * 1e3:.4f} mm, '
                f'goal {"reached" if split["reached"] else "missed"}'
            )
