# Copyright 2026 weld_twin contributors
# SPDX-License-Identifier: Apache-2.0
"""Predictions that say how sure they are: do nine of ten measured positions lie in 90 % regions?

Poor recordings of two measured arms, judged on poses inside and outside of them, and sealed cases
of the plant where they are given. Writes coverage.json, coverage.md and a file per recording; a run
that was interrupted goes on where it stopped.
"""

from __future__ import annotations

from pathlib import Path

from ...study import REQUIRED, Study, option, options, study

add_arguments = options(
    option('--ur5', REQUIRED, 'DIR', 'holds grid.csv'),
    option('--ur10', REQUIRED, 'DIR', 'holds series_c_random_poses.csv'),
    option(
        '--cases',
        None,
        'DIR',
        'sealed cases: holds cases and truths, as weld-twin lab blind make writes them',
    ),
)


@study
def run(study: Study) -> None:
    """Try all regions and print what they hold."""
    from ...coverage.study import NAME, PARTS, entries_of
    from ...coverage.table import page, summary_table
    from ...study import head

    args = study.args
    study.refuse_foreign(f'{NAME}.json', f'{NAME}.md', PARTS)
    cases = None if args.cases is None else Path(args.cases)
    entries = entries_of(Path(args.ur5), Path(args.ur10), cases, study.parts(PARTS))
    study.write(NAME, head('coverage/1', entries=entries), page(entries), say=False)
    print(summary_table(entries))
