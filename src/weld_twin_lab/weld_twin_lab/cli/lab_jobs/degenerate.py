# Copyright 2026 weld_twin contributors
# SPDX-License-Identifier: Apache-2.0
"""Recordings that hardly say anything, drawn by the thousand: no traceback, nothing absurd.

One axis, two, seven, nine; one station to sixty; joints that stand still, exact zeros, whole
degrees, repeats, shuffled rows. Writes one JSON file; exits with 1 when a draw went wrong.
"""

from __future__ import annotations

import argparse

FAILED = 1
"""Exit code when a diagnosis was worse than it may be."""


def add_arguments(parser: argparse.ArgumentParser) -> None:
    """Add the options."""
    parser.add_argument('--count', type=int, default=3000, metavar='N', help='default: 3000')
    parser.add_argument('--seed', type=int, default=0, metavar='S', help='first draw')
    parser.add_argument('--out', required=True, metavar='FILE', help='JSON file to write')


def run(args: argparse.Namespace) -> int:
    """Draw, diagnose, and say what went wrong."""
    import json
    import warnings
    from collections import Counter

    from weld_twin_nodes.offline.output_directory import write_owned

    from ...transfer.degenerate import drawn, tried

    counts: Counter[str] = Counter()
    bad = []
    with warnings.catch_warnings():
        warnings.simplefilter('ignore')
        for seed in range(args.seed, args.seed + args.count):
            came = tried(drawn(seed))
            counts[came['status'] or 'traceback'] += 1
            if came['traceback'] or came['wrong']:
                bad.append(came)
                last = (came['traceback'] or came['wrong'][0]).strip().splitlines()[-1]
                print(f'{seed}: {last}', flush=True)
    result = {
        'schema': 'weld_twin/degenerate/1',
        'first': args.seed,
        'count': args.count,
        'statuses': dict(counts),
        'bad': bad,
    }
    write_owned(args.out, json.dumps(result, indent=1) + '\n')
    print(', '.join(f'{name} {number}' for name, number in sorted(counts.items())))
    return FAILED if bad else 0
