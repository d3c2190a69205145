# Copyright 2026 weld_twin contributors
# SPDX-License-Identifier: Apache-2.0
"""Broken files of every kind are read, and recordings that hardly say anything diagnosed."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import asdict
from typing import Any

from weld_twin_core.errors import DataError
from weld_twin_msgs_py.files import markdown
from weld_twin_nodes.cli.given import Given

from .broken_files import targets
from .hunt import CPU_LIMIT, MEMORY_LIMIT, Finding, hunt, try_all
from .poor_recordings import worst_of


def run(args: Given, tell: Callable[[str], None]) -> dict[str, Any]:
    """Return what every kind of file came to."""
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
