# Copyright 2026 weld_twin contributors
# SPDX-License-Identifier: Apache-2.0
"""Sealed cells, several at a time, each kept as soon as it is done."""

from __future__ import annotations

import time
from collections.abc import Callable, Iterator
from typing import Any

from weld_twin_core.errors import TwinError
from weld_twin_nodes.offline.task_pool import Runner, Task

from ..blind.deck import lots
from ..study import engine_digest, head, require_simulator
from .goals import summary

KINDS = ('single', 'double', 'triple')
"""Cases with their causes in the library: of the others no experiment can make anybody sure."""
MOST_DRAWN = 40
"""Cells drawn for each that is wanted: most are diagnosed rightly from a poor motion."""
BATCH = 8
"""Cells drawn at a time: a run that has to end in between ends after some, whatever came of them."""


def investigated(
    seed: int, wanted: int, runner: Runner, tell: Callable[[str], None], *, minutes: float
) -> dict[str, Any]:
    """
    Investigate sealed cells that poor motions leave open.

    seed: decides the cells.
    wanted: cells that poor motions leave open.
    runner: keeps what came of every cell drawn.
    tell: told how many were drawn.
    minutes: no further cells are begun after so long.
    """
    end = time.monotonic() + 60.0 * minutes
    drawn: list[dict[str, Any]] = []
    cases: list[dict[str, Any]] = []
    for tasks in _batches(seed, wanted):
        drawn += runner.run(tasks)
        cases = [entry for entry in drawn if entry['open']][:wanted]
        tell(f'{len(drawn)} drawn, {len(cases)} left open at first')
        if len(cases) == wanted or time.monotonic() > end:
            break
    return head(
        'investigate/2',
        engine=engine_digest(),
        seed=seed,
        drawn=drawn.index(cases[-1]) + 1 if len(cases) == wanted else len(drawn),
        summary=summary(cases),
        cases=cases,
    )


def _batches(seed: int, wanted: int) -> Iterator[list[Task]]:
    most = MOST_DRAWN * wanted
    for begin in range(0, most, BATCH):
        numbers = range(begin, min(begin + BATCH, most))
        yield [Task(investigated_cell, (seed, k), f'cell {k}') for k in numbers]


def investigated_cell(seed: int, number: int) -> dict[str, Any]:
    """
    Return what came of one cell, in plain values; the simulator is loaded where it is needed.

    seed, number: decide the cell.
    """
    require_simulator()
    from .sealed_cell import SealedCell
    from .trial import looped, poor_at_first

    begun = time.process_time()
    try:
        cell = SealedCell(lots(seed, number + 1, KINDS)[number], seed, number)
    except TwinError as error:
        return {'open': False, 'why': str(error)}
    made = time.process_time()
    first = poor_at_first(cell)
    spent = {'making': made - begun, 'first': time.process_time() - made}
    if first is None:
        return {'open': False, 'why': 'right from the first', 'spent': spent}
    entry = looped(cell, *first)
    spent['loop'] = time.process_time() - begun - sum(spent.values())
    return {'open': True, **entry, 'spent': spent}
