# Copyright 2026 weld_twin contributors
# SPDX-License-Identifier: Apache-2.0
"""How the cost grows: with minutes, stations, joints, effects, candidates and draws.

Every size is run in a process of its own, on one thread. Writes growth.json, growth.md and
growth.png; takes two minutes of processor time.
"""

from __future__ import annotations

import argparse
from pathlib import Path


def add_arguments(parser: argparse.ArgumentParser) -> None:
    """Add the options."""
    parser.add_argument('--out', required=True, metavar='DIR', help='where results go')
    parser.add_argument(
        '--only', nargs='+', default=[], metavar='TEXT', help='what grows, by part of its name'
    )


def run(args: argparse.Namespace) -> int:
    """Measure all sizes, draw them, and print the table."""
    import json
    import sys

    from weld_twin_nodes.offline.output_directory import write_owned

    from ...benchmark.growing_page import draw, measured, page

    def tell(text: str) -> None:
        print(text, file=sys.stderr, flush=True)

    out = Path(args.out)
    out.mkdir(parents=True, exist_ok=True)
    found = measured(args.only, tell)
    write_owned(out / 'growth.json', json.dumps(found, indent=1) + '\n')
    write_owned(out / 'growth.md', page(found))
    draw(found, out / 'growth.png')
    print(page(found), end='')
    return 0
