# Copyright 2026 weld_twin contributors
# SPDX-License-Identifier: Apache-2.0
"""The study of years: what it runs, what it comes to, and its page."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from typing import Any

from weld_twin_msgs_py.files import markdown
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
WORDS = {
    'found': 'real changes found within three recordings of reaching four standard errors',
    'false_a_year': 'false alarms a year',
    'right': 'of those found: effect and joint right, date within one recording',
    'forecast': 'the date of reaching a limit lies in the 90 % interval',
}
LEAD = """\
Cells are checked every week: 120 stations, a tracker that is set up anew each quarter and then sees
other stations, weeks that are missed, holidays. Tools are knocked, motors put back, gears wear and
are serviced, links grow with the seasons; in one year of four nothing happens.

In the *drawn* years, how sure each diagnosis is comes from real diagnoses of recordings that the plant
made; the values are drawn. The other years are simulated by the plant week by week, and each check is
diagnosed by the command.
"""
COUNTED = """\
What is counted: a change is real from the recording on after which its size is four of its standard
errors, all else left free. It is found when it, or the set told with it, holds its coordinate. Effect
and joint are judged at the end of the year, by the coordinate told first; the last joint's row and the
tool are one place. The date of a step is right within one recording, that of a trend if the interval
told reaches the week it began in; a step may be told as *at once or slowly since* a date, which counts
for wear. Limits of forecasts lie half as far ahead again as the wear has
gone. A change of three standard errors would be told in one of seven looks: so many instants and
coordinates are tried that chance reaches four. The changes drawn are those that use makes: a link that
was bent would come second in a set.
"""
MORE = {
    'found_at_last': 'found at all',
    'what': 'of those found: effect and joint right',
    'when': 'of those found: date right',
    'sizes': 'of those told as they are: size in its 90 % interval',
}


def run_years(seed: int, years: int, cells: int, full: int, runner: Runner) -> dict[str, Any]:
    """
    Return all figures of the study.

    seed, years, cells: so many drawn years of so many cells.
    full: years that are diagnosed in full, of cells of their own.
    """
    wanted = [
        Task(full_years.base, (seed, number, check), f'cell {number + 1}')
        for number in range(cells + full)
        for check in range(full_years.CHECKS)
    ]
    kept = runner.run(wanted)
    bases = [
        kept[full_years.CHECKS * k : full_years.CHECKS * (k + 1)] for k in range(cells + full)
    ]
    drawn = runner.run(
        [Task(cheap_year, (seed, k, bases[k % cells]), f'year {k + 1}') for k in range(years)]
    )
    whole = [_full(seed, number, bases[number], runner) for number in range(cells, cells + full)]
    return {
        'drawn': figures(drawn),
        'full': figures(whole),
        'years': {'drawn': drawn, 'full': whole},
    }


def _full(seed: int, number: int, bases: Sequence[Result], runner: Runner) -> dict[str, Any]:
    """Return what a year that is diagnosed in full came to."""
    first = bases[0]
    year = full_years.lived(seed, number, first)
    tasks = [
        Task(full_years.check, (seed, number, week, set_up, first), f'week {week}')
        for week, set_up in zip(year.weeks, year.set_ups, strict=True)
    ]
    return full_years.scored(seed, number, first, runner.run(tasks))


def figures(years: Sequence[Result]) -> dict[str, Any]:
    """Return the measures of some years."""
    real = [e for year in years for e in year['events'] if e['reached'] is not None]
    in_time = [e['found'] is not None and e['found'] <= e['reached'] + GRACE for e in real]
    detected = [e for e in real if e['found'] is not None]
    right = [e['what'] and e['when'] for e in detected]
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
        'what': _share([e['what'] for e in detected]),
        'when': _share([e['when'] for e in detected]),
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


def page(result: Mapping[str, Any], seed: int, cells: int) -> str:
    """Return the page of drawn years of so many cells."""
    drawn, full = result['drawn'], result['full']
    rows = [
        (words, _goal(name), _value(drawn, name), _value(full, name))
        for name, words in {**WORDS, **MORE}.items()
    ]
    heads = ('measure', 'goal', f'{drawn["years"]} drawn years', f'{full["years"]} in full')
    kinds = [
        (kind, *('{1} of {0}'.format(*figures['kinds'][kind]) for figures in (drawn, full)))
        for kind in drawn['kinds']
    ]
    counts = (
        f'Real changes: {drawn["real"]} and {full["real"]}; forecasts: {drawn["forecasts"]} and '
        f'{full["forecasts"]}; looks: {drawn["checks"]} and {full["checks"]}. In time by kind:'
    )
    parts = (
        f'# Simulated years\n\n`weld-twin lab years --seed {seed} --years {drawn["years"]} '
        f'--cells {cells} --full {full["years"]}`\n',
        LEAD,
        markdown.table(heads, *rows),
        '',
        counts,
        '',
        markdown.table(('kind', 'drawn', 'in full'), *kinds),
        '',
        COUNTED,
    )
    return '\n'.join(parts)


def _goal(name: str) -> str:
    if name not in GOALS:
        return ''
    low, high = GOALS[name]
    if name == 'false_a_year':
        return f'<= {high:g}'
    return f'{100 * low:.0f} to {100 * high:.0f} %' if high < 1.0 else f'>= {100 * low:.0f} %'


def _value(figures: Mapping[str, Any], name: str) -> str:
    value = figures[name]
    if value is None:
        return ''
    return f'{value:.2f}' if name == 'false_a_year' else f'{100.0 * value:.1f} %'
