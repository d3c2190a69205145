# Copyright 2026 weld_twin contributors
# SPDX-License-Identifier: Apache-2.0
"""Read broken files of every kind.

Samples that are right are changed at random, as bytes, as text and as trees, and read. A file must
give a result or one clear sentence: never a traceback, a hang or a gigabyte. With --recordings,
recordings that hardly say anything are diagnosed, too: one axis to nine, one station to sixty, joints
that stand still, exact zeros, repeats, shuffled rows.
"""

from __future__ import annotations

import argparse
from collections.abc import Callable
from typing import Any

from weld_twin_msgs_py.files import markdown

from ..study import options

OPTIONS = options(
    """
--cases N       broken files of each kind [default: 5000]
--seed N        decides how they are broken [default: 1]
--only LIST     kinds, comma-separated
--recordings N  recordings that hardly say anything, from --seed on [default: 0]
""",
    out='',
)


def run(args: argparse.Namespace, tell: Callable[[str], None]) -> dict[str, Any]:
    """Return what every kind of file came to."""
    from dataclasses import asdict

    from weld_twin_core.errors import DataError

    from .fuzzing.hunt import CPU_LIMIT, MEMORY_LIMIT, Finding, hunt
    from .fuzzing.malicious import try_all
    from .fuzzing.recordings import worst_of
    from .fuzzing.targets import targets

    names = list(targets())
    chosen = [name for name in args.only.split(',') if name] or names
    if unknown := set(chosen) - set(names):
        listed = ', '.join(names)
        raise DataError(f'no kind of file is called {min(unknown)!r}; there are {listed}')
    findings: dict[str, Finding] = {}
    kinds = {}
    for name in chosen:
        tally = hunt(name, args.seed, args.cases, findings)
        kinds[name] = asdict(tally)
        tell(f'{name}: {tally.right} read, {tally.refused} refused, {tally.wrong} wrong')
    for finding in findings.values():
        tell(f'{finding.target} {finding.case}: {finding.what} ({finding.times} times)')
    malicious = try_all()
    for name, outcome in malicious.items():
        tell(f'{name}: {outcome}')
    recordings = worst_of(args.recordings, args.seed, tell) if args.recordings else {'bad': []}
    passed = not (findings or recordings['bad'])
    passed = passed and all(text.startswith('refused') for text in malicious.values())
    return {
        'passed': passed,
        'seed': args.seed,
        'cases_of_each': args.cases,
        'cpu_limit_s': CPU_LIMIT,
        'memory_limit_mb': MEMORY_LIMIT / 1e6,
        'kinds': kinds,
        'findings': [asdict(finding) for finding in findings.values()],
        'malicious': malicious,
        'recordings': recordings,
    }


def table(result: dict[str, Any]) -> str:
    """Return a row for each kind of file."""
    kinds = [
        (name, row['right'], row['refused'], row['wrong']) for name, row in result['kinds'].items()
    ]
    outcomes = result['malicious'].values()
    refused = sum(text.startswith('refused') for text in outcomes)
    kinds.append(('malicious', 0, refused, len(outcomes) - refused))
    return markdown.table(('kind', 'read', 'refused', 'wrong'), *kinds)
