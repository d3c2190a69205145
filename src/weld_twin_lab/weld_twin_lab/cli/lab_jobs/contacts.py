# Copyright 2026 weld_twin contributors
# SPDX-License-Identifier: Apache-2.0
"""Three arms without an instrument: a ball in two sockets, judged on places left out.

Published postures of two Panda and one iiwa 14. Each place is left out in turn, and each place
alone is fitted and judged on the others. Writes contacts.json, contacts.md and a file per split; a
run that was interrupted goes on where it stopped.
"""

from __future__ import annotations

import argparse
from pathlib import Path


def add_arguments(parser: argparse.ArgumentParser) -> None:
    """Add the options."""
    parser.add_argument('--data', required=True, metavar='DIR', help='holds panda_1, kuka_14, ...')
    parser.add_argument(
        '--arms', default='', metavar='A,B', help='panda_1, panda_2, kuka_14; all when left out'
    )
    parser.add_argument(
        '--sealed',
        type=int,
        default=0,
        metavar='N',
        help='also make and open N cases of the plant',
    )
    parser.add_argument(
        '--postures',
        type=int,
        default=0,
        metavar='N',
        help='also ask on N arms of the plant how many postures a place needs',
    )
    parser.add_argument('--out', required=True, metavar='DIR', help='where results go')


def run(args: argparse.Namespace) -> int:
    """Judge every split and print the table."""
    import json
    import sys

    from weld_twin_core.errors import DataError
    from weld_twin_nodes.offline.output_directory import write_owned

    from ...contacts.data import ARMS
    from ...contacts.splits import study
    from ...contacts.table import summary, table
    from ...parts import write_results

    def tell(text: str) -> None:
        print(text, file=sys.stderr, flush=True)

    arms = [name.strip() for name in args.arms.split(',') if name.strip()] or list(ARMS)
    for name in arms:
        if name not in ARMS:
            raise DataError(f'--arms: there is no arm {name!r}; they are {", ".join(ARMS)}')
    out = Path(args.out)
    entries = study(Path(args.data), arms, out / 'splits', tell)
    write_results(out / 'contacts.json', summary(entries))
    write_owned(out / 'contacts.md', table(entries))
    print(table(entries), end='')
    if args.sealed:
        from ...contacts.sealed import sealed

        score = sealed(args.sealed, out / 'sealed', tell)
        write_results(out / 'sealed.json', score)
        print(', '.join(f'{key} {value}' for key, value in score.items()))
    if args.postures:
        from ...contacts.postures import postures

        needed = postures(args.postures, out / 'postures', tell)
        write_results(out / 'postures.json', needed)
        print(json.dumps(needed))
    return 0
