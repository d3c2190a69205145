# Copyright 2026 weld_twin contributors
# SPDX-License-Identifier: Apache-2.0
"""Run the demo again and again: every recording whole, every result the same.

Half of the runs have busy processes beside them, and some other demos too. A run passes if it ends
by itself with a recording of one message on each topic for each joint state; the campaign passes if
all runs do and leave the same table and the same words.
"""

from __future__ import annotations

import argparse
import json
import time
from collections.abc import Callable
from pathlib import Path
from typing import Any

from weld_twin_msgs_py.files import markdown

from ..study import option, options

BUSY = 6
"""Processes beside every second run; with the demo's own, five to a core of a machine with two."""
TOGETHER = 3
"""Crowded demos that run at once: a harder test than one by one, and a shorter one."""


add_arguments = options(
    option('--runs', 60, 'N', 'demos (default: 60)'),
    option('--busy', BUSY, 'N', f'busy processes (default: {BUSY})'),
    option('--together', TOGETHER, 'K', f'crowded demos that run at once (default: {TOGETHER})'),
    option(
        '--minutes', float('inf'), 'M', 'begin no more demos after this time (default: no limit)'
    ),
    option('--go-on', False, None, 'add to the demos that the file has, up to --runs'),
    out='',
)


def run(args: argparse.Namespace, tell: Callable[[str], None]) -> dict[str, Any]:
    """Return one row for each run, and what they come to."""
    from .demonstrating.one_demo import run_demos
    from .keeping.result_file import write_result

    rows = _before(args) if args.go_on else []
    begun = time.monotonic()
    while len(rows) < args.runs:
        if rows and time.monotonic() > begun + 60.0 * args.minutes:
            break
        together = _next(rows, args)
        for row in run_demos(args.busy if together else 0, max(together, 1)):
            rows.append(row)
            what = fault(row, rows[0]) or 'whole and the same'
            tell(f'{len(rows)}: {row["busy"]} busy, {row["seconds"]} s, {what}')
        made = {**summary(rows, args.busy), 'demos': rows}
        write_result(args.out, 'demos', time.monotonic() - begun, made)  # a kill leaves these
    return {**summary(rows, args.busy), 'demos': rows}


def _next(rows: list[dict[str, Any]], args: argparse.Namespace) -> int:
    """Return how many crowded demos come next; 0: one alone."""
    crowded = sum(row['busy'] > 0 for row in rows)
    if len(rows) - crowded <= crowded:
        return 0
    left: int = args.runs // 2 - crowded
    return min(int(args.together), left)


def _before(args: argparse.Namespace) -> list[dict[str, Any]]:
    """Return the demos of the file, none where there is no file yet."""
    file = Path(args.out)
    rows: list[dict[str, Any]] = []
    if file.exists():
        rows += json.loads(file.read_text(encoding='utf-8'))['demos']
    return rows


def summary(rows: list[dict[str, Any]], busy: int) -> dict[str, Any]:
    """Return what rows of runs come to, the first of them the one to compare with."""
    groups = {
        name: _group([row for row in rows if row['busy'] == count], rows[0])
        for name, count in (('alone', 0), ('crowded', busy))
    }
    passed = all(not fault(row, rows[0]) for row in rows)
    messages = rows[0].get('messages', {})
    headline = rows[0].get('headline', '')
    return {'passed': passed, 'messages': messages, 'headline': headline, **groups}


def fault(row: dict[str, Any], first: dict[str, Any]) -> str:
    """Return what is wrong with a run, empty when nothing is."""
    if row['code'] != 0:
        return f'ended with {row["code"]}: {row["said"][:200]}'
    if row['incomplete'] or not _even(row['messages']):
        return '; '.join(row['incomplete']) or f'unequal counts {row["messages"]}'
    if row['digests'] != first.get('digests'):
        changed = [
            name for name in row['digests'] if row['digests'][name] != first['digests'][name]
        ]
        return f'another {", ".join(changed)}'
    return ''


def _even(messages: dict[str, int]) -> bool:
    """Return whether the streams with one message for each joint state have as many."""
    streams = {count for topic, count in messages.items() if topic != '/deviation/metrics'}
    return len(streams) == 1


def _group(rows: list[dict[str, Any]], first: dict[str, Any]) -> dict[str, Any]:
    import numpy as np

    whole = [row for row in rows if row['code'] == 0]
    seconds = [row['seconds'] for row in rows] or [0.0]
    return {
        'runs': len(rows),
        'failed': len(rows) - len(whole),
        'incomplete': sum(bool(row['incomplete']) or not _even(row['messages']) for row in whole),
        'different': sum(row['digests'] != first.get('digests') for row in whole),
        'seconds': {
            'median': round(float(np.median(seconds)), 1),
            'max': round(max(seconds), 1),
        },
    }


def table(result: dict[str, Any]) -> str:
    """Return a row for the runs alone and one for those with busy processes beside."""
    head = ('beside it', 'demos', 'failed', 'incomplete', 'another result', 'median', 'longest')
    rows = []
    beside_it = (('alone', 'nothing of ours'), ('crowded', 'six busy processes and other demos'))
    for name, beside in beside_it:
        row = result[name]
        seconds = (f'{row["seconds"][key]:.0f} s' for key in ('median', 'max'))
        rows.append(
            (beside, row['runs'], row['failed'], row['incomplete'], row['different'], *seconds)
        )
    return markdown.table(head, *rows)
