# Copyright 2026 weld_twin contributors
# SPDX-License-Identifier: Apache-2.0
"""A year looked at week by week: what was told, held against what happened."""

from __future__ import annotations

from collections.abc import Collection, Mapping, Sequence
from typing import Any

import numpy as np

from weld_twin_core.arrays import Array
from weld_twin_core.history import Change, Observation, changes, outlook, reaches

from ..blind.displacement import NORMAL_90
from .life import Event, Year

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
    named: Collection[str],
    likely: Collection[str],
    joints: Sequence[str],
    truth: Mapping[str, float],
) -> dict[str, Any]:
    """
    Return what a year of weekly looks came to: its events, and the alarms for nothing.

    observations: of each check, in the order of time; day 0 is that of week 0.
    named, likely: coordinates that a diagnosis has named as causes, and that use can change.
    truth: values before anything happened.
    """
    weeks = np.array(year.weeks, float)
    due = [_reached(observations, year.events, event, weeks) for event in year.events]
    found: list[int | None] = [None] * len(year.events)
    false: list[dict[str, Any]] = []
    before: set[tuple[str, str]] = set()
    reported: tuple[Change, ...] = ()
    for k in range(FEWEST, len(observations) + 1):
        reported = changes(observations[:k], named=named, likely=likely)
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
    names = {change.name, *change.alike}
    if not any(_alias(event.name, name, joints) for name in names):
        return False
    if event.kind != 'step' or change.kind == 'season':
        return True
    first, last = change.between
    return first - NEAR * WEEK <= event.begin * WEEK <= last + NEAR * WEEK


def _alias(one: str, other: str, joints: Sequence[str]) -> bool:
    """Tell whether two coordinates are the same, or the last joint's row and the tool."""
    return one == other or {_site(one, joints), _site(other, joints)} == {TOOL}


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
