# Copyright 2026 weld_twin contributors
# SPDX-License-Identifier: Apache-2.0
"""Contenders taking turns, and what came of it."""

from __future__ import annotations

from collections.abc import Callable, Iterator, Sequence
from dataclasses import dataclass
from time import process_time
from typing import Any

import numpy as np

from weld_twin_core.arrays import Array
from weld_twin_core.errors import DataError
from weld_twin_msgs_py.files import markdown

OWN, REFERENCE = 'weld_twin', 'pinocchio'
"""The contender that the others are compared with."""


@dataclass(frozen=True)
class Contender:
    """One way to do a job."""

    name: str
    run: Callable[[], object]
    items: int = 1
    """How many poses, draws or runs one call does; a slow contender may do fewer of them."""
    gap: float = 0.0
    """Largest difference of its result to the reference."""


@dataclass(frozen=True)
class Workload:
    """A job: its contenders, the item their time is counted by, and how well they must agree."""

    title: str
    item: str
    contenders: Sequence[Contender]
    tolerance: float
    note: str = ''


@dataclass(frozen=True, eq=False)
class Outcome:
    """Processor seconds per item, shape (rounds,) for every contender."""

    workload: Workload
    seconds: dict[str, Array]

    def ratio(self, name: str) -> Array | None:
        """Return the reference's time over the contender's, per round; None without either."""
        if REFERENCE not in self.seconds:
            return None
        return np.asarray(self.seconds[REFERENCE] / self.seconds[name])

    def as_dict(self) -> dict[str, Any]:
        rows = {}
        for contender in self.workload.contenders:
            ratio = self.ratio(contender.name)
            rows[contender.name] = {
                'seconds_per_item': self.seconds[contender.name].tolist(),
                'ratio': None if ratio is None else ratio.tolist(),
                'gap': contender.gap,
                'items': contender.items,
            }
        load = self.workload
        return {
            'title': load.title,
            'item': load.item,
            'reference': [REFERENCE],
            'tolerance': load.tolerance,
            'note': load.note,
            'contenders': rows,
        }


def race(workload: Workload, rounds: int, least: float) -> Outcome:
    """Time contenders in turn, each so long a round [s]; raises DataError where their results differ."""
    for contender in workload.contenders:
        if not contender.gap <= workload.tolerance:
            raise DataError(
                f'{workload.title}: {contender.name} differs from the others by '
                f'{contender.gap:.3g}, more than {workload.tolerance:.3g}; nothing was timed'
            )
    calls = {c.name: _calls(c, least) for c in workload.contenders}
    seconds: dict[str, list[float]] = {c.name: [] for c in workload.contenders}
    for _ in range(rounds):
        for contender in workload.contenders:
            seconds[contender.name].append(_timed(contender, calls[contender.name]))
    return Outcome(workload, {name: np.array(values) for name, values in seconds.items()})


def _calls(contender: Contender, least: float) -> int:
    contender.run()
    calls, spent = 1, _timed(contender, 1) * contender.items
    while spent < 0.1 * least:
        calls *= 4
        spent = _timed(contender, calls) * contender.items * calls
    return max(1, round(calls * least / max(spent, 1e-9)))


def _timed(contender: Contender, calls: int) -> float:
    start = process_time()
    for _ in range(calls):
        contender.run()
    return (process_time() - start) / (calls * contender.items)


UNITS = ((1.0, 's'), (1e-3, 'ms'), (1e-6, 'us'), (1e-9, 'ns'))
"""Units of time, the largest that a figure reaches is used."""
LEFT_OUT = 'N = 1,000'
"""End of the titles that the brief table goes without."""


def lines(outcome: Outcome) -> Iterator[str]:
    """Yield a line for the workload and one for each contender."""
    load = outcome.workload
    yield f'{load.title} (per {load.item}; times: {REFERENCE} / contender)'
    for contender in load.contenders:
        seconds = float(np.median(outcome.seconds[contender.name]))
        yield f'  {contender.name:<26} {duration(seconds):>10}  {times(outcome, contender.name)}'
    if load.note:
        yield f'  {load.note}'


def page(outcomes: list[Outcome]) -> str:
    """Return a table in Markdown: own time, and times as fast as the reference and the others."""
    rows = [('workload', 'time', 'times as fast as', 'and as the others')]
    for outcome in outcomes:
        load = outcome.workload
        own = outcome.seconds[OWN]
        others = [
            f'{c.name} {short(np.median(outcome.seconds[c.name]) / np.median(own))}'
            for c in load.contenders
            if c.name not in (OWN, REFERENCE)
        ]
        rows.append(
            (
                load.title,
                f'{duration(float(np.median(own)))} per {load.item}',
                f'{REFERENCE}: **{times(outcome, OWN)}**',
                ', '.join(others),
            )
        )
    return markdown.table(*rows)


def brief(outcomes: list[Outcome]) -> str:
    """Return a shorter table, without ranges and small batches."""
    rows = [('one thread, in one run', 'times as fast')]
    for outcome in outcomes:
        load, ratio = outcome.workload, outcome.ratio(OWN)
        if ratio is not None and not load.title.endswith(LEFT_OUT):
            rows.append((load.title, f'{short(float(np.median(ratio)))} ({REFERENCE})'))
    return markdown.table(*rows)


def times(outcome: Outcome, name: str) -> str:
    """Return the median ratio and its range over the rounds."""
    ratio = outcome.ratio(name)
    if ratio is None:
        return '-'
    return f'{short(np.median(ratio))} ({short(ratio.min())} to {short(ratio.max())})'


def short(ratio: float) -> str:
    """Return a ratio with three digits, or all before the point."""
    return f'{ratio:,.0f}' if ratio >= 100.0 else f'{ratio:.3g}'


def duration(seconds: float) -> str:
    scale, unit = next((u for u in UNITS if seconds >= u[0]), UNITS[-1])
    return f'{seconds / scale:.3g} {unit}'
