# Copyright 2026 weld_twin contributors
# SPDX-License-Identifier: Apache-2.0
"""What the regions hold, as tables in Markdown."""

from __future__ import annotations

from collections.abc import Sequence
from typing import Any

import numpy as np

from weld_twin_msgs_py.files.markdown import table

Entry = dict[str, Any]
REGIONS = ('inside', 'outside')


def page(entries: Sequence[Entry]) -> str:
    """Return the summary and the table of every recording."""
    return '\n'.join([summary_table(entries), entry_table(entries)])


def summaries(entries: Sequence[Entry]) -> list[dict[str, Any]]:
    """Return the mean share held over recordings, by source, group and region."""
    out = []
    keys = dict.fromkeys((e['source'], e['group']) for e in entries)
    for source, group in keys:
        for region in REGIONS:
            mine = [
                e[region]
                for e in entries
                if (e['source'], e['group']) == (source, group) and region in e
            ]
            if mine:
                out.append(_summary(source, group, region, mine))
    return out


def _summary(source: str, group: str, region: str, mine: Sequence[Entry]) -> dict[str, Any]:
    held = np.array([e['held'] for e in mine])
    known = [e for e in mine if e.get('oracle_sigma_m')]
    wider = [e['median_sigma_m'] / e['oracle_sigma_m'] for e in known]
    poses = np.array([e['poses'] for e in mine])
    return {
        'source': source,
        'group': group,
        'region': region,
        'recordings': len(mine),
        'held': float(held.mean()),
        'held_of_all_poses': float(np.average(held, weights=poses)),
        'worst': float(held.min()),
        'flagged': float(np.mean([e['flagged'] for e in mine])),
        'over_oracle': float(np.median(wider)) if wider else None,
    }


def summary_table(entries: Sequence[Entry]) -> str:
    """Return the table of `summaries`."""
    rows = [
        [
            s['source'],
            s['group'],
            s['region'],
            str(s['recordings']),
            f'{s["held"]:.1%}',
            f'{s["held_of_all_poses"]:.1%}',
            f'{s["worst"]:.0%}',
            f'{s["flagged"]:.1%}',
            '' if s['over_oracle'] is None else f'{s["over_oracle"]:.2f}',
        ]
        for s in summaries(entries)
    ]
    heads = (
        'of',
        'group',
        'poses',
        'recordings',
        'held',
        'of all poses',
        'worst',
        'flagged',
        'over oracle',
    )
    return table(heads, *rows)


def entry_table(entries: Sequence[Entry]) -> str:
    """Return the table of every recording and region."""
    rows = []
    for entry in entries:
        for region in REGIONS:
            if region in entry:
                rows.append(_row(entry, region))
    heads = (
        'recording',
        'status',
        'poses',
        'number',
        'held',
        'not flagged',
        'flagged',
        'mean error',
        'sigma',
    )
    return table(heads, *rows)


def _row(entry: Entry, region: str) -> list[str]:
    e = entry[region]
    return [
        str(entry['name']),
        str(entry['status']),
        region,
        str(e['poses']),
        _share(e['held']),
        _share(e['held_unflagged']),
        _share(e['flagged']),
        _mm(e['mean_error_m']),
        _mm(e['median_sigma_m']),
    ]


def _share(value: float | None) -> str:
    return '' if value is None else f'{value:.0%}'


def _mm(value: float | None) -> str:
    return '' if value is None else f'{value * 1e3:.3f} mm'
