# Copyright 2026 weld_twin contributors
# SPDX-License-Identifier: Apache-2.0
"""Try the nodes and the files hard, and keep what came of it.

Writes one JSON file. Exits with 1 when the campaign found a failure; the file tells which.
"""

from __future__ import annotations

import argparse
import time
from importlib import import_module
from typing import Any

from weld_twin_nodes.cli.parsing import Command, add_command

OUT = '--out FILE, required  JSON file to write, or to replace if it is of the same campaign'
FAILED = 1
"""Exit code of a campaign that ran and did not pass."""


def add_arguments(parser: argparse.ArgumentParser) -> None:
    """Add the campaigns, each with its options."""
    from ... import campaigns

    jobs = parser.add_subparsers(required=True, metavar='CAMPAIGN', dest='campaign')
    for name in campaigns.names():
        module = import_module(f'{campaigns.__name__}.{name}')
        add_command(jobs, name, Command(str(module.__doc__), options=(*module.OPTIONS, OUT)))


def run(args: argparse.Namespace) -> int:
    """Run the campaign, write its result, and say whether it passed."""
    from ...campaigns import refuse_foreign, write_result

    refuse_foreign(args.out, args.campaign)
    module = import_module(f'weld_twin_lab.campaigns.{args.campaign}')
    begin = time.monotonic()
    result: dict[str, Any] = module.run(args, lambda line: print(line, flush=True))
    write_result(args.out, args.campaign, time.monotonic() - begin, result)
    print(module.table(result))
    print(f'{args.campaign}: {"passed" if result["passed"] else "FAILED"}, {args.out}')
    return 0 if result['passed'] else FAILED
