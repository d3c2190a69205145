# Copyright 2026 weld_twin contributors
# SPDX-License-Identifier: Apache-2.0
"""Robot programs: does a corrected one help?

In every language seams of arms with sealed causes are recorded, diagnosed, corrected as programs and
driven by the plant. Writes corrections.json and corrections.md; a run that was interrupted goes on
where it stopped.
"""

from __future__ import annotations

from ...study import Study, engine_digest, head, options, require_simulator, study

OPTIONS = options(
    """
--seams N  sealed seams a language [default: 1]
--seed N   decides the seams [default: 1]
""",
    pool=True,
)


@study
def run(study: Study) -> None:
    """Correct and drive what is not done yet, and print the table."""
    from weld_twin_nodes.offline.task_pool import Task

    require_simulator()
    from ...programs.cells import CELLS
    from ...programs.correction_table import page, totals
    from ...programs.corrections import corrected_seam

    seed = study.args.seed
    tasks = [
        Task(corrected_seam, (language, seed, k), f'{language} {k}')
        for language in CELLS
        for k in range(study.args.seams)
    ]
    cases = study.tasks(tasks, 'corrections')
    results = {'engine': engine_digest(), 'seed': seed, 'totals': totals(cases), 'cases': cases}
    study.write('corrections', head('programs/1', **results), page(results))
