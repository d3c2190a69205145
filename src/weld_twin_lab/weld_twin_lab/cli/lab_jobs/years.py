# Copyright 2026 weld_twin contributors
# SPDX-License-Identifier: Apache-2.0
"""Live through simulated years of weekly checks, and see which changes the history finds.

Most years are drawn: how sure each diagnosis is comes from real ones. Some are simulated by the plant
and diagnosed in full. A run that was interrupted goes on where it stopped.
"""

from __future__ import annotations

import argparse
import json
from pathlib import Path

from ..blind_jobs.job_options import add_pool, runner_of

RESULT, TABLE = 'years.json', 'years.md'
MISSED = 1
"""Exit code where a goal was not met in the drawn years."""


def add_arguments(parser: argparse.ArgumentParser) -> None:
    """Add the options."""
    parser.add_argument('--out', required=True, metavar='OUT', help='directory for the results')
    parser.add_argument('--seed', type=int, default=26, metavar='S')
    parser.add_argument('--years', type=int, default=200, metavar='N', help='drawn years')
    parser.add_argument('--cells', type=int, default=12, metavar='N', help='cells they are of')
    parser.add_argument('--full', type=int, default=2, metavar='N', help='years diagnosed in full')
    add_pool(parser)


def run(args: argparse.Namespace) -> int:
    """Run what is not done yet, write the results, print the table."""
    from weld_twin_nodes.offline.output_directory import write_owned

    from ...blind.diagnosing import engine_digest
    from ...blind.simulator import require_simulator
    from ...fleet.years import GOALS, run_years
    from ...fleet.years_page import page

    require_simulator()
    out = Path(args.out)
    with runner_of(args, out / 'done', 'living through years') as runner:
        result = run_years(args.seed, args.years, args.cells, args.full, engine_digest(), runner)
    text = page(result, args.seed)
    write_owned(out / RESULT, json.dumps(result, indent=1) + '\n')
    write_owned(out / TABLE, text)
    print(text)
    kept = {name: result['drawn'][name] for name in GOALS}
    met = [
        value is not None and GOALS[name][0] <= value <= GOALS[name][1]
        for name, value in kept.items()
    ]
    return 0 if all(met) else MISSED
