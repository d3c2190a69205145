# Copyright 2026 weld_twin contributors
# SPDX-License-Identifier: Apache-2.0
"""Make every mistake of data and set-up, and see whether the gate names it and spares the sound.

Recordings come from the plant, as bags and as tables; each mistake is drawn anew. Sound ones have
causes of all families in plausible size, on rich and poor motions, with and without alignment.
With --real, stations of two measured arms and a servo axis are tried besides (docs/transfer.md says
where the data come from): poor parts of them as they are, and the same mistakes put into them. A
run that was interrupted goes on where it stopped.
"""

from __future__ import annotations

import argparse
import json
from collections.abc import Mapping
from pathlib import Path
from typing import Any

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
    parser.add_argument(
        '--real',
        nargs=3,
        metavar=('UR5', 'UR10', 'EMPS'),
        help='directories of real recordings, tried besides',
    )
    parser.add_argument(
        '--real-draws', type=int, default=30, metavar='N', help='of stations of either real arm'
    )
    add_pool(parser)


def run(args: argparse.Namespace) -> int:
    """Run what is not done yet, write the result, print the table."""
    from weld_twin_core.errors import DataError

    from ...blind.diagnosing import engine_digest
    from ...blind.simulator import require_simulator
    from ...gate.mistakes import KINDS
    from ...gate.table import result
    from ...gate.tasks import drawn, real

    require_simulator()
    kinds = [k for k in args.kinds.split(',') if k] or list(KINDS)
    for kind in kinds:
        if kind not in KINDS:
            raise DataError(f'there is no mistake {kind!r}; there are ' + ', '.join(KINDS))
    engine = engine_digest()
    tasks = drawn(args.seed, kinds, args.draws, args.sound, engine)
    more = real(args.real, kinds, args.draws, args.real_draws, engine) if args.real else []
    out = Path(args.out)
    with runner_of(args, out / 'done', 'trying the gate') as runner:
        found = runner.run([*tasks, *more])
    content = result(found[: len(tasks)], args.seed)
    if more:
        content['real'] = result(found[len(tasks) :], args.seed)
        content['passed'] = content['passed'] and content['real']['passed']
    return _written(out, content)


def _written(out: Path, content: Mapping[str, Any]) -> int:
    from weld_twin_nodes.offline.output_directory import write_owned

    from ...gate.table import page

    told = page(content)
    out.mkdir(parents=True, exist_ok=True)
    write_owned(out / RESULT, json.dumps(content, indent=1) + '\n')
    write_owned(out / TABLE, told)
    print(told)
    print(f'gate: {"passed" if content["passed"] else "FAILED"}, {out / RESULT}')
    return 0 if content['passed'] else MISSED
