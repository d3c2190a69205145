# Copyright 2026 weld_twin contributors
# SPDX-License-Identifier: Apache-2.0
"""Robot programs: are they read as they are meant, and does a corrected one help?

In every language drawn programs are read again by the product and by an independent reader, programs
are broken at random, and a seam is recorded, diagnosed, corrected and driven by the plant. Writes
programs.json, programs.md and a file per part; a run that was interrupted goes on where it stopped.
Exits with 1 when a program is read wrongly, or a broken one not met with words.
"""

from __future__ import annotations

import argparse
from pathlib import Path

MISSED = 1
"""Exit code where a program was read wrongly, or a broken one was not met with words."""


def add_arguments(parser: argparse.ArgumentParser) -> None:
    """Add the options."""
    parser.add_argument('--out', required=True, metavar='DIR', help='where results go')
    parser.add_argument('--drawn', type=int, default=200, metavar='N', help='programs a language')
    parser.add_argument(
        '--broken', type=int, default=2000, metavar='N', help='broken programs a language'
    )
    parser.add_argument(
        '--seams',
        type=int,
        default=1,
        metavar='N',
        help='seams a language that the plant runs before and after (default: 1)',
    )
    parser.add_argument(
        '--made', default='test/programs/made', metavar='DIR', help='programs as users have them'
    )


def run(args: argparse.Namespace) -> int:
    """Try what is not tried yet, and print the tables."""
    import sys

    from ...programs.study import study, summary

    def tell(text: str) -> None:
        print(text, file=sys.stderr, flush=True)

    result = study(Path(args.out), args.drawn, args.broken, args.seams, Path(args.made), tell)
    print(summary(result))
    wrong = [line for part in ('round_trips', 'fuzz') for e in result[part] for line in e['wrong']]
    for line in wrong:
        print(line, file=sys.stderr)
    return MISSED if wrong else 0
