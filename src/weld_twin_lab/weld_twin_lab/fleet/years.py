# Copyright 2026 weld_twin contributors
# SPDX-License-Identifier: Apache-2.0
"""The study of years: what it runs, and what it comes to."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from typing import Any

from weld_twin_nodes.offline.task_pool import Runner, Task

from . import full_years
from .cheap_years import cheap_year
from .scoring import GRACE

Result = Mapping[str, Any]
GOALS = {
    'found': (0.95, 1.0),
    'false_a_year': (0.0, 0.5),
    'right': (0.90, 1.0),
    'forecast': (0.85, 0.95),
}
"""Least and most of each measure; `scoring` says what each means."""


def run_years(
    seed: int, years: int, cells: int, full: int, engine: str, runner: Runner
) -> dict[str, Any]:
    """
    Return all figures of the study.

    seed, years, cells: so many drawn years of so many cells.
    full: years that are diagnosed in full, of cells of their own.
    engine: digest of the program: what another one found is not taken for this one's.
    """
    wanted = [
        Task(_base, (seed, number, check, engine), f'cell {number + 1}')
        for number in range(cells + full)
        for check in range(full_years.CHECKS)
    ]
    kept = runner.run(wanted)
    bases = [
        kept[full_years.CHECKS * k : full_years.CHECKS * (k + 1)] for k in range(cells + full)
    ]
    drawn = runner.run(
        [Task(_cheap, (seed, k, bases[k % cells], engine), f'year {k + 1}') for k in range(years)]
    )
    whole = [
        _full(seed, number, bases[number], engine, runner) for number in range(cells, cells + full)
    ]
    return {
        'drawn': figures(drawn),
        'full': figures(whole),
        'years': {'drawn': drawn, 'full': whole},
    }


def _base(seed: int, number: int, check: int, engine: str) -> Any:
    return full_years.base(seed, number, check)


def _cheap(seed: int, number: int, bases: Sequence[Result], engine: str) -> Any:
    return cheap_year(seed, number, bases)


def _check(seed: int, number: int, week: int, set_up: int, first: Result, engine: str) -> Any:
    return full_years.check(seed, number, week, set_up, first)


def _full(
    seed: int, number: int, bases: Sequence[Result], engine: str, runner: Runner
) -> dict[str, Any]:
    """Return what a year that is diagnosed in full came to."""
    first = bases[0]
    year = full_years.lived(seed, number, first)
    tasks = [
        Task(_check, (seed, number, week, set_up, first, engine), f'week {week}')
        for week, set_up in zip(year.weeks, year.set_ups, strict=True)
    ]
    return full_years.scored(seed, number, first, runner.run(tasks))


def figures(years: Sequence[Result]) -> dict[str, Any]:
    """Return the measures of some years."""
    real = [e for year in years for e in year['events'] if e['reached'] is not None]
    in_time = [e['found'] is not None and e['found'] <= e['reached'] + GRACE for e in real]
    told = [e for e in real if e['found'] is not None]
    right = [e['what'] and e['when'] for e in told]
    ahead = [e['forecast']['held'] for year in years for e in year['events'] if e['forecast']]
    sizes = [e['size'] for year in years for e in year['events'] if e.get('size')]
    false = sum(len(year['false']) for year in years)
    return {
        'years': len(years),
        'checks': sum(year['looks'] for year in years),
        'real': len(real),
        'found': _share(in_time),
        'found_at_last': _share([e['found'] is not None for e in real]),
        'false_a_year': false / max(len(years), 1),
        'right': _share(right),
        'what': _share([e['what'] for e in told]),
        'when': _share([e['when'] for e in told]),
        'sizes': _share([s['ci90'][0] <= s['true'] <= s['ci90'][1] for s in sizes]),
        'forecasts': len(ahead),
        'forecast': _share(ahead),
        'kinds': {
            kind: [
                sum(e['kind'] == kind for e in real),
                sum(ok for e, ok in zip(real, in_time, strict=True) if e['kind'] == kind),
            ]
            for kind in ('step', 'trend', 'season')
        },
    }


def _share(flags: Sequence[bool]) -> float | None:
    return sum(flags) / len(flags) if flags else None
