# Copyright 2026 weld_twin contributors
# SPDX-License-Identifier: Apache-2.0
"""Make every mistake of data and set-up, and see whether the gate names it and spares the sound.

Recordings come from the plant, as bags and as tables; each mistake is drawn anew. Sound ones have
causes of all families in plausible size, on rich and poor motions, with and without alignment.
A run that was interrupted goes on where it stopped.
"""

from __future__ import annotations

from ...study import Study, listed, options, require_simulator, study

OPTIONS = options(
    """
--seed N      decides what is drawn [default: 20]
--draws N     of every kind, as bag and as table [default: 10]
--sound N     sound recordings [default: 300]
--kinds LIST  only these mistakes, comma-separated
""",
    out='directory for gate.json and gate.md',
    of='OUT',
    pool=True,
)


@study
def run(study: Study) -> bool:
    """Run what is not done yet, write the result, print the table."""
    from weld_twin_core.errors import DataError
    from weld_twin_nodes.offline.task_pool import Task

    from ...gate.mistakes import KINDS, MOVING_ONLY
    from ...gate.table import page, result
    from ...gate.trials import WAYS, complaint, mistake

    require_simulator()
    args = study.args
    kinds = listed(args.kinds) or list(KINDS)
    for kind in kinds:
        if kind not in KINDS:
            raise DataError(f'there is no mistake {kind!r}; there are ' + ', '.join(KINDS))
    tasks = [
        Task(mistake, (args.seed, kind, way, number), f'{kind} {way}')
        for kind in kinds
        for way in WAYS
        for number in range(args.draws)
        if not (way == 'table' and kind in MOVING_ONLY)
    ]
    tasks += [Task(complaint, (args.seed, n), 'sound') for n in range(args.sound)]
    content = result(study.tasks(tasks, 'trying the gate'), args.seed)
    study.write('gate', content, page(content))
    passed = bool(content['passed'])
    print(f'\ngate: {"passed" if passed else "FAILED"}, {study.out / "gate.json"}')
    return passed
