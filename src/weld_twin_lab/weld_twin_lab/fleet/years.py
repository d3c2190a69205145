# Copyright 2026 weld_twin contributors
# SPDX-License-Identifier: Apache-2.0
"""
The study of years: what it runs, what was told of each held against what happened, and its page.

In drawn years, two checks of every cell are simulated by the plant and diagnosed by the command. Each
week's values are then what such a diagnosis says of the arm as it is that week, its noise drawn anew.
So two hundred years cost as much as two dozen diagnoses; what a diagnosis gets wrong of itself is in
the years that are diagnosed in full, whose every check is simulated and diagnosed.
"""

from __future__ import annotations

from collections import Counter
from collections.abc import Mapping, Sequence
from dataclasses import replace
from datetime import datetime, timedelta, timezone
from typing import Any

import numpy as np

from weld_twin_core.arrays import Array
from weld_twin_core.history import Change, Observation, changes, outlook, reaches
from weld_twin_msgs_py.files import markdown
from weld_twin_nodes.offline.task_pool import Runner, Task
from weld_twin_report.history import Entry, observations
from weld_twin_report.history.words import Beforehand, beforehand

from ..blind.scoring import NORMAL_90
from ..study import Study, require_simulator
from .life import Cause, Event, Year, cause, diagnosed, draw, moved, set_up, year

WEEK = 7.0
"""Days."""
TOOL = ('tool_pose', '')
"""Effect and joint of the tool."""
ERRORS = 4.0
"""Standard errors of a change that make it real."""
GRACE = 3
"""Recordings after that within which it must be found."""
FEWEST = 4
"""Checks before the first look: fewer are no history."""
NEAR = 4
"""Weeks by which a date may be off while it is still the same event; whether it is right is counted
apart."""
AHEAD = 0.5
"""Share of the way that wear has gone by the end of the year, after which its limit lies."""
LAST = ('joint_offset', 'link_length', 'link_offset', 'link_twist', 'axis_parallelism')
"""Errors of the last joint's row, which are the same place as the tool."""


def score(
    observations: Sequence[Observation],
    year: Year,
    believed: Beforehand,
    joints: Sequence[str],
    truth: Mapping[str, float],
) -> dict[str, Any]:
    """
    Return what a year of weekly looks came to: its events, and the alarms for nothing.

    truth: values before anything happened.
    """
    weeks = np.array(year.weeks, float)
    due = [_reached(observations, year.events, event, weeks) for event in year.events]
    found: list[int | None] = [None] * len(year.events)
    false: list[dict[str, Any]] = []
    before: set[tuple[str, str]] = set()
    reported: tuple[Change, ...] = ()
    for k in range(FEWEST, len(observations) + 1):
        reported = changes(observations[:k], **believed)
        wrong = set()
        for change in reported:
            hits = [i for i, event in enumerate(year.events) if _same(event, change, joints)]
            for i in hits:
                found[i] = k - 1 if found[i] is None else found[i]
            if not hits:
                wrong.add((change.name, change.kind))
        false += [{'look': k - 1, 'name': n, 'kind': kind} for n, kind in wrong - before]
        before = wrong
    events = [
        {
            **_entry(event, reached, first, reported, weeks, joints),
            'forecast': _forecast(observations, year.events, event, reported, truth),
        }
        for event, reached, first in zip(year.events, due, found, strict=True)
    ]
    return {'looks': len(observations) - FEWEST + 1, 'events': events, 'false': false}


def _reached(
    observations: Sequence[Observation], events: Sequence[Event], one: Event, weeks: Array
) -> int | None:
    """
    Return the first check after which a change has four of its standard errors, None if none.

    Everything else is left free: the arm as it was, and all that happens besides. Written anew,
    apart from the product's own sums.
    """
    names = list(dict.fromkeys(name for each in observations for name in each.names))
    if one.name not in names:
        return None
    others = [event for event in events if event is not one and event.name in names]
    rows = [(names.index(event.name), event.columns(weeks)) for event in (*others, one)]
    width = {
        n: w for each in observations for n, w in zip(each.names, each.prior_std, strict=True)
    }
    count, size = len(names), one.sizes()
    whole = np.zeros((count + sum(columns.shape[1] for _, columns in rows),) * 2)
    whole[:count, :count] = np.diag([width[name] ** -2.0 for name in names])
    for k, each in enumerate(observations):
        places = [np.eye(count)[:, [place]] * columns[k] for place, columns in rows]
        wide = np.concatenate([np.eye(count), *places], axis=1)
        whole += wide.T @ _widened(each, names) @ wide
        free = whole[: -size.size, : -size.size]
        side = whole[: -size.size, -size.size :]
        rest = free + 1e-12 * np.diag(np.diag(free) + 1e-300)
        remaining = whole[-size.size :, -size.size :] - side.T @ np.linalg.solve(rest, side)
        if k and size @ remaining @ size >= ERRORS**2:
            return k
    return None


def _widened(observation: Observation, names: Sequence[str]) -> Array:
    """Return what a check says of all coordinates; nothing of those that it does not know."""
    out = np.zeros((len(names), len(names)))
    at = [names.index(name) for name in observation.names]
    out[np.ix_(at, at)] = observation.information()[0]
    return out


def _same(event: Event, change: Change, joints: Sequence[str]) -> bool:
    """Tell whether a change told may be an event: its coordinate among those told, its date near."""
    names = {change.name, *change.alike, *(each.name for each in change.together)}
    if event.name not in names and not any(
        {_site(event.name, joints), _site(name, joints)} == {TOOL} for name in names
    ):
        return False
    if event.kind != 'step' or change.kind == 'season':
        return True
    first, last = change.between
    return first - NEAR * WEEK <= event.begin * WEEK <= last + NEAR * WEEK


def _entry(
    event: Event,
    reached: int | None,
    found: int | None,
    reported: Sequence[Change],
    weeks: Array,
    joints: Sequence[str],
) -> dict[str, Any]:
    """Return what became of one event; what and when it was is judged at the end of the year."""
    mine = [change for change in reported if _same(event, change, joints)]
    return {
        'kind': event.kind,
        'name': event.name,
        'begin': event.begin,
        'reached': reached,
        'found': found,
        'what': any(_site(change.name, joints) == _site(event.name, joints) for change in mine),
        'in_set': bool(mine),
        'when': any(_dated(event, change, weeks) for change in mine),
        'size': _size(event, mine),
        'told': [(change.name, change.kind, change.day, len(change.alike)) for change in mine],
    }


def _size(event: Event, mine: Sequence[Change]) -> dict[str, Any] | None:
    """Return the 90 % interval of the size of a change told as it is, and the true one."""
    for change in mine:
        if (change.name, change.kind) == (event.name, event.kind):
            half, unit = NORMAL_90 * change.std, WEEK if event.kind == 'trend' else 1.0
            size = abs(event.size) if event.kind == 'season' else event.size
            return {
                'ci90': [unit * (change.size - half), unit * (change.size + half)],
                'true': size,
            }
    return None


def _forecast(
    observations: Sequence[Observation],
    events: Sequence[Event],
    event: Event,
    reported: Sequence[Change],
    truth: Mapping[str, float],
) -> dict[str, Any] | None:
    """
    Return the weeks foretold until wear has gone half as far again, and those it takes.

    None where no trend of that coordinate was told, or it moves towards zero.
    """
    now = outlook(observations, reported, event.name)
    if event.kind != 'trend' or now is None:
        return None
    last = observations[-1].day / WEEK
    moved = sum(e.values(np.array([last]))[0] for e in events if e.name == event.name)
    value = truth.get(event.name, 0.0) + float(moved)
    limit = abs(value) + AHEAD * event.size * (last - event.begin) * np.sign(value)
    if limit <= abs(value):
        return None
    weeks = [day / WEEK for day in reaches(limit, now)]
    true = float((limit - abs(value)) / abs(event.size))
    return {'weeks': weeks, 'true': true, 'held': bool(weeks[0] <= true <= weeks[2])}


def _site(name: str, joints: Sequence[str]) -> tuple[str, str]:
    """Return effect and joint of a coordinate; the last joint's row is the tool."""
    if name.startswith('tool'):
        return TOOL
    effect, *where, _ = name.split(' ')
    site = effect, ' '.join(where)
    return TOOL if effect in LAST and site[1] == joints[-1] else site


def _dated(event: Event, change: Change, weeks: Array) -> bool:
    """
    Tell whether a date is right within one recording.

    Of a step its first recording; of a trend the interval told must reach the week it began in, that
    of a slow change where a step is told with one; a season has none.
    """
    if event.kind == 'season':
        return True
    after = int(np.searchsorted(weeks, event.begin))
    first, last = change.between
    first = first if change.since is None else min(first, change.since)
    days = [float(np.searchsorted(weeks, day / WEEK)) for day in (change.day, first, last)]
    if event.kind == 'step' and change.kind == 'step':
        return abs(days[0] - after) <= 1.0
    return days[1] - 1.0 <= after <= days[2] + 1.0


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
    """Return all figures: of drawn years of some cells, and of full years of cells of their own."""
    wanted = [
        Task(base, (seed, number, check), f'cell {number + 1}')
        for number in range(cells + full)
        for check in range(CHECKS)
    ]
    kept = runner.run(wanted)
    bases = [kept[CHECKS * k : CHECKS * (k + 1)] for k in range(cells + full)]
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
    first = bases[0]
    year = lived(seed, number, first)
    tasks = [
        Task(check, (seed, number, week, set_up, first), f'week {week}')
        for week, set_up in zip(year.weeks, year.set_ups, strict=True)
    ]
    return scored(seed, number, first, runner.run(tasks))


def figures(years: Sequence[Result]) -> dict[str, Any]:
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
    command = f'--seed {seed} --years {drawn["years"]} --cells {cells} --full {full["years"]}'
    parts = (
        f'# Simulated years\n\n`weld-twin lab years {command}`\n\n{LEAD}',
        f'{markdown.table(heads, *rows)}\n\n{counts}\n',
        f'{markdown.table(("kind", "drawn", "in full"), *kinds)}\n\n{COUNTED}',
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


FIRST = datetime(2026, 1, 5, tzinfo=timezone.utc)
"""Monday of week 0."""
CHECKS = 2
"""Sets of stations of a cell."""


def base(seed: int, number: int, check: int) -> dict[str, Any]:
    rng = np.random.default_rng([seed, number, check])
    yearly = draw(seed, number)
    causes = [*yearly.as_built, set_up(rng)]
    return diagnosed(yearly, causes, check, int(rng.integers(2**31)), FIRST).plain()


def lived(seed: int, number: int, first: Mapping[str, Any]) -> Year:
    """Return what happens on a cell in the year that is diagnosed in full."""
    return year(Entry.of_plain(first), np.random.default_rng([seed, 2_000_000 + number]))


def check(seed: int, number: int, week: int, set_up_number: int, first: Mapping[str, Any]) -> Any:
    yearly = draw(seed, number)
    off = moved(lived(seed, number, first).events, week)
    stands = set_up(np.random.default_rng([seed, number, 3, set_up_number]))
    causes = [*_together([*yearly.as_built, *(cause(n, v) for n, v in off.items())]), stands]
    drawn = int(np.random.default_rng([seed, number, 4, week]).integers(2**31))
    at = FIRST + timedelta(weeks=week)
    return diagnosed(yearly, causes, set_up_number % CHECKS, drawn, at).plain()


def _together(causes: Sequence[Cause]) -> list[Cause]:
    """Return flaws with those of one kind at one place added up."""
    out: dict[tuple[str, str | None], Cause] = {}
    for each in causes:
        key = str(each['effect']), each.get('joint')
        before = out.get(key)
        if before is None:
            out[key] = dict(each)
            continue
        for name, value in each.items():
            if isinstance(value, float):
                before[name] += value
            elif isinstance(value, list):
                before[name] = [a + b for a, b in zip(before[name], value, strict=True)]
    return list(out.values())


def scored(
    seed: int, number: int, first: Mapping[str, Any], kept: Sequence[Mapping[str, Any]]
) -> dict[str, Any]:
    """Return what the weekly looks at a year of diagnoses came to."""
    entries = [Entry.of_plain(each) for each in kept]
    start = FIRST.timestamp() / 86_400.0
    seen = [replace(o, day=o.day - start) for o in observations(entries)]
    yearly = draw(seed, number)
    truth = {
        f'{each["effect"]} {each["joint"]} 0': float(
            next(v for k, v in each.items() if k not in ('effect', 'joint'))
        )
        for each in yearly.as_built
    }
    joints = yearly.cell.robot.joint_names
    scores = score(seen, lived(seed, number, first), beforehand(entries), joints, truth)
    status = dict(Counter(each.status for each in entries))
    return {**scores, 'status': status, 'weeks': len(entries), 'unit': WEEK}


def cheap_year(seed: int, number: int, bases: Sequence[Mapping[str, Any]]) -> dict[str, Any]:
    """Return what a year of weekly looks came to, from entries of the cell's checks."""
    rng = np.random.default_rng([seed, 1_000_000 + number])
    checks = _common([Entry.of_plain(base) for base in bases])
    lived = year(checks[0], rng)
    # What the first check leaves open, the arm may have: its values are drawn from what it says.
    arm = rng.multivariate_normal(checks[0].value, checks[0].covariance, method='eigh')
    truth = dict(zip(checks[0].names, map(float, arm), strict=True))
    seen = drawn(checks, lived, truth, rng)
    joints = [name.split(' ')[1] for name in truth if name.startswith('joint_offset ')]
    return score(seen, lived, beforehand(checks), joints, truth)


def _common(entries: Sequence[Entry]) -> list[Entry]:
    names = [n for n in entries[0].names if all(n in each.names for each in entries)]

    def own(each: Entry) -> Entry:
        at = [each.names.index(name) for name in names]
        some: dict[str, Any] = {'value': each.value[at], 'prior_std': each.prior_std[at]}
        covariance = each.covariance[np.ix_(at, at)]
        return replace(each, names=tuple(names), covariance=covariance, **some)

    return [own(each) for each in entries]


def drawn(
    checks: Sequence[Entry], lived: Year, truth: Mapping[str, float], rng: np.random.Generator
) -> list[Observation]:
    """Return the observations of a year: the arm as it is each week, seen through a check."""
    seen, out = observations(checks), []
    for week, number in zip(lived.weeks, lived.set_ups, strict=True):
        check = seen[number % len(checks)]
        off = moved(lived.events, week)
        theta = np.array([truth[name] + off.get(name, 0.0) for name in check.names])
        precision = check.information()[0]
        known, axes = np.linalg.eigh(precision)
        root = axes * np.sqrt(np.maximum(known, 0.0))
        information = precision @ theta + root @ rng.normal(size=theta.size)
        out.append(replace(check, day=WEEK * week, value=check.covariance @ information))
    return out


def run(study: Study) -> bool:
    require_simulator()
    args = study.args
    with study.runner('living through years') as runner:
        result = run_years(args.seed, args.years, args.cells, args.full, runner)
    study.write('years', result, page(result, args.seed, args.cells))
    kept = {name: result['drawn'][name] for name in GOALS}
    return all(
        value is not None and GOALS[name][0] <= value <= GOALS[name][1]
        for name, value in kept.items()
    )
