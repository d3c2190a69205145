# Copyright 2026 weld_twin contributors
# SPDX-License-Identifier: Apache-2.0
"""Recordings that hardly say anything, drawn by the thousand: no traceback, nothing absurd.

One axis, two, seven, nine; one station to sixty; joints that stand still, exact zeros, whole
degrees, repeats, shuffled rows. Writes one JSON file; exits with 1 when a draw went wrong.
"""

from __future__ import annotations

from ...study import Study, option, options, study

add_arguments = options(
    option('--count', 3000, 'N', 'default: 3000'),
    option('--seed', 0, 'S', 'first draw'),
    out='JSON file to write',
    of='FILE',
)


@study
def run(study: Study) -> bool:
    """Draw, diagnose, and say what went wrong."""
    import json
    import warnings
    from collections import Counter

    from weld_twin_nodes.offline.output_directory import write_owned

    from ...transfer.degenerate import drawn, tried

    args = study.args
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
    write_owned(study.out, json.dumps(result, indent=1) + '\n')
    print(', '.join(f'{name} {number}' for name, number in sorted(counts.items())))
    return not bad
