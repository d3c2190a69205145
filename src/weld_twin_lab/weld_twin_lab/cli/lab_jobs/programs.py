# Copyright 2026 weld_twin contributors
# SPDX-License-Identifier: Apache-2.0
"""Robot programs: are they read as they are meant, and does a corrected one help?

In every language drawn programs are read again by the product and by an independent reader, and programs
are broken at random (programs.json, programs.md). Seams of arms with sealed causes are recorded,
diagnosed, corrected as programs and driven by the plant (corrections.json, corrections.md). Arms given
as URDFs are planned, simulated, measured, diagnosed and corrected (urdf_arms.json, urdf_arms.md). With
--seams 0, --urdf-arms 0, or --drawn 0 and --broken 0, one part is left out. A run that was interrupted
goes on where it stopped. Exits with 1 when a program is read wrongly, or a broken one not met with
words.
"""

from __future__ import annotations

import argparse
from pathlib import Path
from typing import Any

from ..blind_jobs.job_options import add_pool, runner_of

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
        help='sealed seams a language that the plant runs before and after (default: 1)',
    )
    parser.add_argument(
        '--urdf-arms',
        type=int,
        default=0,
        metavar='N',
        help='arms given as URDFs that go all the way (default: 0)',
    )
    parser.add_argument('--seed', type=int, default=1, metavar='N', help='decides the seams')
    parser.add_argument(
        '--made', default='test/programs/made', metavar='DIR', help='programs as users have them'
    )
    add_pool(parser)


def run(args: argparse.Namespace) -> int:
    """Try what is not tried yet, and print the tables."""
    from ...blind.diagnosing import engine_digest
    from ...programs.cells import CELLS
    from ...programs.correction_table import page
    from ...programs.study import PARTS, corrections

    missed = _read(args) if args.drawn or args.broken else 0
    if args.seams:
        out = Path(args.out)
        with runner_of(args, out / PARTS, 'correcting') as runner:
            found = corrections(out, args.seed, args.seams, runner, engine_digest(), list(CELLS))
        print(page(found))
    if args.urdf_arms:
        _given_as_urdfs(args)
    return missed


def _given_as_urdfs(args: argparse.Namespace) -> None:
    """Take arms that are given as URDFs all the way, and print what they add up to."""
    from ...blind.diagnosing import engine_digest
    from ...programs.study import PARTS, urdf_arms
    from ...programs.urdf_table import page

    out = Path(args.out)
    with runner_of(args, out / PARTS, 'arms') as runner:
        print(page(urdf_arms(out, args.seed, args.urdf_arms, runner, engine_digest())))


def _read(args: argparse.Namespace) -> int:
    """Read what is drawn and what is broken, and return whether all went well."""
    import sys

    from ...programs.study import study, summary

    def tell(text: str) -> None:
        print(text, file=sys.stderr, flush=True)

    result: dict[str, Any] = study(Path(args.out), args.drawn, args.broken, Path(args.made), tell)
    print(summary(result))
    wrong = [line for part in ('round_trips', 'fuzz') for e in result[part] for line in e['wrong']]
    for line in wrong:
        print(line, file=sys.stderr)
    return MISSED if wrong else 0
