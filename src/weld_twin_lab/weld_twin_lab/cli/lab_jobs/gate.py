# SPDX-FileCopyrightText: weld_twin contributors
# SPDX-License-Identifier: Apache-2.0
"""Make every mistake of data and set-up, and see whether the gate names it and spares the sound.

Recordings come from the plant, as bags and as tables; each mistake is drawn anew. Sound ones have
causes of all families in plausible size, on rich and poor motions, with and without alignment.
"""

from __future__ import annotations

import argparse
import json
from pathlib import Path

from ..blind_jobs.job_options import add_pool, runner_of

RESULT, TABLE = 'gate.json', 'gate.md'
MISSED = 1
"""Exit code where a goal was not met."""


def add_arguments(parser: argparse.ArgumentParser) -> None:
    """Add the options."""
    parser.add_argument(
        '--out', required=True, metavar='OUT', help='directory for gate.json and gate.md'
    )
    parser.add_argument('--seed', type=int, default=20, metavar='S')
    parser.add_argument(
        '--draws', type=int, default=10, metavar='N', help='of every kind, as bag and as table'
    )
    parser.add_argument('--sound', type=int, default=300, metavar='N', help='sound recordings')
    parser.add_argument(
        '--kinds', default='', metavar='LIST', help='only these mistakes, comma-separated'
    )
    add_pool(parser)


def run(args: argparse.Namespace) -> int:
    """Run what is not done yet, write the result, print the table."""
    from weld_twin_core.errors import DataError
    from weld_twin_msgs_py.files.whole_files import write_text
    from weld_twin_nodes.offline.task_pool import Task

    from ...blind.diagnosing import engine_digest
    from ...blind.simulator import require_simulator
    from ...gate.mistakes import KINDS, MOVING_ONLY
    from ...gate.table import result, table
    from ...gate.trials import WAYS, complaint, mistake

    require_simulator()
    kinds = [k for k in args.kinds.split(',') if k] or list(KINDS)
    for kind in kinds:
        if kind not in KINDS:
            raise DataError(f'there is no mistake {kind!r}; there are ' + ', '.join(KINDS))
    engine = engine_digest()
    wrong = [
        Task(mistake, (args.seed, kind, way, number, engine), f'{kind} {way}')
        for kind in kinds
        for way in WAYS
        for number in range(args.draws)
        if not (way == 'table' and kind in MOVING_ONLY)
    ]
    sound = [Task(complaint, (args.seed, n, engine), 'sound') for n in range(args.sound)]
    out = Path(args.out)
    with runner_of(args, out / 'done', 'trying the gate') as runner:
        found = runner.run([*wrong, *sound])
    content = result(found[: len(wrong)], found[len(wrong) :], args.seed)
    out.mkdir(parents=True, exist_ok=True)
    write_text(out / RESULT, json.dumps(content, indent=1) + '\n', overwrite=True)
    told = table(content)
    write_text(out / TABLE, told, overwrite=True)
    print(told)
    print(f'gate: {"passed" if content["passed"] else "FAILED"}, {out / RESULT}')
    return 0 if content['passed'] else MISSED
