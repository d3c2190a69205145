# Copyright 2026 weld_twin contributors
# SPDX-License-Identifier: Apache-2.0
"""What the regions hold, as tables in Markdown."""

from __future__ import annotations

from collections.abc import Callable, Sequence
from operator import itemgetter
from typing import Any

import numpy as np

from weld_twin_msgs_py.files.markdown import table

from ..study import tabled

Entry = dict[str, Any]
REGIONS = ('inside', 'outside')
HEAD = """# What 90 % regions of predictions hold

Poor recordings of two measured arms, and cells of the plant, whose poses are judged where
the tool really is; [how it was done](../../predictions.md#does-it-hold).
"""


def page(entries: Sequence[Entry]) -> str:
    """Return the summary, what became of other promises, and the table of every recording."""
    plans = [entry for entry in entries if 'promised_within' in entry]
    rest = [entry for entry in entries if 'source' in entry]
    tables = [summary_table(rest), promise_table(rest), entry_table(rest)]
    if plans:
        told = ', '.join(f'{key} {value:.3g}' for key, value in of_plans(plans).items())
        tables.insert(2, f'Plans carried out: {told}.\n')
    return '\n'.join([HEAD, *tables])


def of_plans(plans: Sequence[Entry]) -> dict[str, float]:
    """Return how plans of a first measurement compare with what came of them."""
    ratio = [e['kept_sigma_m'] / e['promised_sigma_m'] for e in plans]
    warned = [e['warned_sigma_m'] / e['promised_sigma_m'] for e in plans]
    beyond = [e['warned_elsewhere_m'] / e['promised_elsewhere_m'] for e in plans]
    return {
        'plans': len(plans),
        'kept over promised': float(np.median(ratio)),
        'worst': max(ratio),
        'warned over promised': float(np.median(warned)),
        'the same elsewhere': float(np.median(beyond)),
        'promised within tolerance': float(np.mean([e['promised_within'] for e in plans])),
        'kept': float(np.mean([e['kept_within'] for e in plans])),
    }


def promises(entries: Sequence[Entry]) -> dict[str, list[dict[str, Any]]]:
    """Return all intervals with what is true, by their kind."""
    out: dict[str, list[dict[str, Any]]] = {}
    for entry in entries:
        for kind, told in entry.get('promises', {}).items():
            out.setdefault(kind, []).extend(told)
    return {kind: told for kind, told in out.items() if told}


def promise_table(entries: Sequence[Entry]) -> str:
    """Return how often the intervals of `promises` hold, and how wide they are."""
    rows = []
    for kind, told in promises(entries).items():
        ends = np.array([one['ci90'] for one in told])
        true = np.array([one['true'] for one in told])
        above, below = true > ends[:, 1], true < ends[:, 0]
        width = np.median((ends[:, 1] - ends[:, 0]) / np.maximum(np.abs(true), 1e-12))
        rows.append(
            [
                kind,
                str(true.size),
                f'{1.0 - (above | below).mean():.1%}',
                f'{below.mean():.1%}',
                f'{above.mean():.1%}',
                f'{width:.3f}',
            ]
        )
    heads = ('interval of', 'number', 'held', 'truth below', 'above', 'width over the truth')
    return table(heads, *rows)


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
    known = [e for e in mine if e.get('oracle_sigma_m') and e['formal_sigma_m']]
    wider, formal = (
        [e['median_sigma_m'] / e[key] for e in known]
        for key in ('oracle_sigma_m', 'formal_sigma_m')
    )
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
        'over_formal': float(np.median(formal)) if formal else None,
    }


def summary_table(entries: Sequence[Entry]) -> str:
    """Return the table of `summaries`."""
    return tabled(SUMMARIES, summaries(entries))


def entry_table(entries: Sequence[Entry]) -> str:
    """Return the table of every recording and region."""
    rows = [(entry, region) for entry in entries for region in REGIONS if region in entry]
    return tabled(ENTRIES, rows)


def _share(value: float | None, digits: int = 0) -> str:
    return '' if value is None else f'{value:.{digits}%}'


def _of(key: str, tell: Callable[[Any], str]) -> Callable[[Any], str]:
    """Return what tells a number of a recording in a region."""
    return lambda row: tell(row[0][row[1]][key])


def _mm(value: float | None) -> str:
    return '' if value is None else f'{value * 1e3:.3f} mm'


def _wide(key: str) -> Callable[[Any], str]:
    return lambda s: '' if s[key] is None else f'{s[key]:.2f}'


SUMMARIES: dict[str, Callable[[Any], object]] = {
    'of': itemgetter('source'),
    'group': itemgetter('group'),
    'poses': itemgetter('region'),
    'recordings': itemgetter('recordings'),
    'held': lambda s: _share(s['held'], 1),
    'of all poses': lambda s: _share(s['held_of_all_poses'], 1),
    'worst': lambda s: _share(s['worst']),
    'flagged': lambda s: _share(s['flagged'], 1),
    'width over the oracle': _wide('over_oracle'),
    'over its formal one': _wide('over_formal'),
}
"""Columns of the table of summaries."""
ENTRIES: dict[str, Callable[[Any], object]] = {
    'recording': lambda row: row[0]['name'],
    'status': lambda row: row[0]['status'],
    'poses': itemgetter(1),
    'number': _of('poses', str),
    'held': _of('held', _share),
    'not flagged': _of('held_unflagged', _share),
    'flagged': _of('flagged', _share),
    'mean error': _of('mean_error_m', _mm),
    'sigma': _of('median_sigma_m', _mm),
}
"""Columns of the table of recordings, each with a region."""
