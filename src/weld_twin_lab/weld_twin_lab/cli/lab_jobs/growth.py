# Copyright 2026 weld_twin contributors
# SPDX-License-Identifier: Apache-2.0
"""How the cost grows: with minutes, stations, joints, effects, candidates and draws.

Every size is run in a process of its own, on one thread. Writes growth.json, growth.md and
growth.png; takes two minutes of processor time.
"""

from __future__ import annotations

from ...study import Study, option, options, study

add_arguments = options(option('--only', [], 'TEXT', 'what grows, by part of its name', nargs='+'))


@study
def run(study: Study) -> None:
    """Measure all sizes, draw them, and print the table."""
    from ...benchmark.growing_page import draw, measured, page

    found = measured(study.args.only, study.tell)
    study.write('growth', found, page(found))
    draw(found, study.out / 'growth.png')
