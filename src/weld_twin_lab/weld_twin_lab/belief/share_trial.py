# Copyright 2026 weld_twin contributors
# SPDX-License-Identifier: Apache-2.0
"""Cases whose true shares are known, however much their causes overlap or cancel."""

from __future__ import annotations

from collections.abc import Sequence
from typing import Any

from weld_twin_core.errors import DataError
from weld_twin_nodes.offline.task_pool import Runner, Task

from ..blind.blind_cell import deviation, floor
from ..blind.making import SealedCase
from .mix import drawn, mixed
from .trial import tried

KINDS = {'single': 1, 'double': 2, 'triple': 3}
"""Kinds of cases, and how many causes each has."""


def true_shares(case: SealedCase) -> list[float]:
    """
    Return the true share of every cause of a case.

    As a diagnosis tells it: of the squared gap with its noise, what is no noise is parted by how
    far each cause moves the tool along with all of them together. One that works against the
    others takes nothing off the gap beside them, and has a share of zero. The noise is all that
    is not the causes': the instrument's, and that of stamps that jitter.

    Parameters
    ----------
    case : SealedCase

    """
    whole = deviation(case.cell, case.causes, case.train)
    noise, _ = floor(case.cell, case.causes, case.train)
    square = float((whole**2).sum(axis=-1).mean())
    along = [
        max(float((deviation(case.cell, [cause], case.train) * whole).sum(axis=-1).mean()), 0.0)
        for cause in case.causes
    ]
    explained = square / (square + noise**2) / max(sum(along), 1e-300)
    return [explained * part for part in along]


def shared(seed: int, number: int) -> dict[str, Any] | None:
    """
    Return the row of one case with its true shares; None of one that has none.

    Parameters
    ----------
    seed, number : int
        As `mix.drawn` takes them.

    """
    try:
        case, poor = drawn(seed, number)
    except DataError:
        return None
    if poor or case.cell.align:
        return None
    row = tried(seed, number)
    if row['error']:
        return {'name': row['name'], 'error': row['error']}
    return {
        'name': row['name'],
        'error': None,
        'engine': row['engine'],
        'shares': dict(zip(map(_site, row['truth']['sites']), true_shares(case), strict=True)),
        'told': [
            {'site': _named(cause['name'][0]), **{k: cause[k] for k in ('share', 'share_ci90')}}
            for cause in row['verdict']['causes']
            if cause['name']
        ],
    }


def _site(site: Sequence[str | None]) -> str:
    return ' of '.join(part for part in site if part)


def _named(name: dict[str, Any]) -> str:
    return _site((name['effect'], name['joint']))


def rows_of(
    seed: int, count: int, runner: Runner, causes: Sequence[int] = (1, 2, 3)
) -> list[dict[str, Any]]:
    """
    Return rows of the cases with causes and rich motion among the first of a seed.

    Parameters
    ----------
    seed, count : int
    runner : Runner
    causes : sequence of int
        Only cases with so many.

    """
    kinds = [lot.kind for lot in mixed(seed, count)]
    tasks = [
        Task(shared, (seed, number), f'case {number}')
        for number in range(count)
        if KINDS.get(kinds[number]) in causes
    ]
    return [row for row in runner.run(tasks) if row is not None]
