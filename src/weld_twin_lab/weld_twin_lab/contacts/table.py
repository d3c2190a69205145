# Copyright 2026 weld_twin contributors
# SPDX-License-Identifier: Apache-2.0
"""What the splits of the arms come to, as one table."""

from __future__ import annotations

from collections import Counter
from collections.abc import Sequence
from typing import Any

import numpy as np

from weld_twin_msgs_py.files import markdown

HEADER = (
    *('arm', 'places', 'spread before [mm]', 'after, each place left out [mm]', 'per axis [mm]'),
    *(
        'worst place [mm]',
        'sockets [mm]',
        'status',
        'one place only: better or flagged',
        'time [s]',
    ),
)
EACH = (
    *('arm', 'place left out', 'before [mm]', 'after [mm]', 'per axis [mm]', 'sockets [mm]'),
    *('foretold from the others [mm]', 'status'),
)
TITLE = """# Arms without an instrument

Mean distance of the predicted ball from the middle of its socket, each place left out in turn;
[how it was done](../../contacts.md#what-it-reached).
"""


def summary(entries: Sequence[dict[str, Any]]) -> list[dict[str, Any]]:
    """Return one entry per arm; lengths in m."""
    out = []
    for arm in dict.fromkeys(entry['arm'] for entry in entries):
        own = [entry for entry in entries if entry['arm'] == arm]
        left = [(e, e['judged'][0]) for e in own if e['kind'] == 'without']
        alone = [
            row['after_m'] <= row['before_m'] or row['place'] in entry['flagged']
            for entry in own
            if entry['kind'] == 'only'
            for row in entry['judged']
        ]
        out.append(
            {
                'arm': arm,
                'places': len(left),
                'before_m': float(np.mean([row['before_m'] for _, row in left])),
                'after_m': float(np.mean([row['after_m'] for _, row in left])),
                'each_axis_m': float(np.mean([row['each_axis_m'] for _, row in left])),
                'worst_m': float(max(row['after_m'] for _, row in left)),
                'worse_than_nominal': [
                    row['place'] for _, row in left if row['after_m'] > row['before_m']
                ],
                'distances_m': [row['distance_m'] for _, row in left],
                'status': [entry['status'] for entry, _ in left],
                'alone': [sum(alone), len(alone)],
                'seconds': float(max(entry['seconds'] for entry in own)),
            }
        )
    return out


def table(entries: Sequence[dict[str, Any]]) -> str:
    """Return the table in Markdown."""
    arms = [_arm(row) for row in summary(entries)]
    places = [_place(entry) for entry in entries if entry['kind'] == 'without']
    return '\n'.join([TITLE, markdown.table(HEADER, *arms), markdown.table(EACH, *places)])


def _arm(row: dict[str, Any]) -> tuple[object, ...]:
    near, far = min(row['distances_m']) * 1e3, max(row['distances_m']) * 1e3
    counts = Counter(row['status'])
    return (
        row['arm'],
        row['places'],
        *(f'{row[key] * 1e3:.3f}' for key in ('before_m', 'after_m', 'each_axis_m', 'worst_m')),
        f'{near:.2f} to {far:.2f}',
        ', '.join(f'{count} {name}' for name, count in counts.items()),
        f'{row["alone"][0]} of {row["alone"][1]}',
        f'{row["seconds"]:.1f}',
    )


def _place(entry: dict[str, Any]) -> tuple[object, ...]:
    row, told = entry['judged'][0], entry['told_held_out_m']
    return (
        entry['arm'],
        row['place'],
        *(f'{row[key] * 1e3:.3f}' for key in ('before_m', 'after_m', 'each_axis_m')),
        f'{row["distance_m"] * 1e3:.2f}',
        '-' if told is None else f'{told * 1e3:.3f}',
        entry['status'],
    )
