# Copyright 2026 weld_twin contributors
# SPDX-License-Identifier: Apache-2.0
"""Contenders taking turns, and what came of it."""

from __future__ import annotations

from collections.abc import Callable, Sequence
from dataclasses import dataclass
from time import process_time
from typing import Any

import numpy as np

from weld_twin_core.arrays import Array
from weld_twin_core.errors import DataError

REFERENCE = 'pinocchio'
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
        """Return plain numbers and lists."""
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
    """
    Time the contenders in turn.

    least: how long each contender works in a round, in as many calls as that takes [s].

    Raises DataError: a contender's result is not that of the others.
    """
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
