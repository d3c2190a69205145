# Copyright 2026 weld_twin contributors
# SPDX-License-Identifier: Apache-2.0
"""Kill the recorder at random moments and look at what is left.

Joint states at 500 Hz and poses at 100 Hz are recorded with both storages, in files small enough that
splits are hit too. SIGKILL comes while recording, or while the bag is being completed. What
`weld-twin bag recover` finds must be the messages sent, in order and without a gap from the first on,
and may lack one second at most.
"""

from __future__ import annotations

import argparse
from collections.abc import Callable
from typing import Any

from weld_twin_msgs_py.files import markdown

from ..study import options

ALLOWED = 1.0
"""Seconds of messages that a kill may cost."""


OPTIONS = options(
    """
--times N    kills of the recorder [default: 200]
--seed N     decides the moments [default: 1]
--longest S  latest moment of a kill of the recorder [default: 3]
""",
    out='',
)


def run(args: argparse.Namespace, tell: Callable[[str], None]) -> dict[str, Any]:
    """Return one row for each kill, and what they come to."""
    import numpy as np

    from .killing.trial import Trial, try_once

    rng = np.random.default_rng(args.seed)
    rows: list[dict[str, Any]] = []
    for k in range(args.times):
        trial = Trial(
            storage=('mcap', 'sqlite3')[k % 2],
            moment=float(rng.uniform(0.0, args.longest)),
            closing=bool(rng.random() < 0.2),
            split_mb=float(rng.choice([0.0, 0.1, 0.2])),
            wait=float(rng.uniform(0.0, 0.1)),
        )
        rows.append(try_once(trial))
        if rows[-1]['fault'] or (k + 1) % 10 == 0:
            worst = max(row['missing_s'] for row in rows)
            faults = sum(bool(row['fault']) for row in rows)
            tell(f'{k + 1} kills, {faults} faults {rows[-1]["fault"]}, at most {worst:.3f} s lost')
    return {**_summary(rows), 'kills': rows}


def _summary(rows: list[dict[str, Any]]) -> dict[str, Any]:
    import numpy as np

    def share(chosen: list[dict[str, Any]]) -> dict[str, Any]:
        missing = [row['missing_s'] for row in chosen] or [0.0]
        return {
            'kills': len(chosen),
            'faults': sum(bool(row['fault']) for row in chosen),
            'missing_s': {
                'median': round(float(np.median(missing)), 3),
                'max': round(max(missing), 3),
            },
            'sent': sum(row['sent'] for row in chosen),
            'recovered': sum(row['recovered'] for row in chosen),
        }

    groups = {
        storage: share([row for row in rows if row['storage'] == storage])
        for storage in ('mcap', 'sqlite3')
    }
    whole = share(rows)
    passed = whole['faults'] == 0 and whole['missing_s']['max'] <= ALLOWED
    return {'passed': passed, 'allowed_s': ALLOWED, 'all': whole, **groups}


def table(result: dict[str, Any]) -> str:
    """Return a row for each storage."""
    head = ('storage', 'kills', 'gaps, repeats, broken bags', 'missing, median', 'missing, worst')
    rows = []
    for name in ('mcap', 'sqlite3'):
        row = result[name]
        missing = (f'{row["missing_s"][key]:.2f} s' for key in ('median', 'max'))
        rows.append((name, row['kills'], row['faults'], *missing))
    return markdown.table(head, *rows)
