# Copyright 2026 weld_twin contributors
# SPDX-License-Identifier: Apache-2.0
"""Cases whose true shares are known, however much their causes overlap."""

from __future__ import annotations

from collections.abc import Sequence
from typing import Any

from weld_twin_core.errors import DataError
from weld_twin_nodes.offline.task_pool import Runner, Task

from ..blind.blind_cell import deviation
from ..blind.making import Case
from .mix import drawn, mixed
from .trial import tried

KINDS = ('double', 'triple')
"""Kinds of cases with several causes; of one alone its square is its share."""


def true_shares(case: Case) -> list[float]:
    """
    Return the true share of every cause of a case.

    As a diagnosis tells it: how far the cause moves the tool along with all of them together, of
    the squared gap with its noise. One that works against the others has a share below zero.

    Parameters
    ----------
    case : Case

    """
    whole = deviation(case.cell, case.causes, case.train)
    size = float((whole**2).sum(axis=-1).mean()) + case.cell.noise**2
    return [
        float((deviation(case.cell, [cause], case.train) * whole).sum(axis=-1).mean()) / size
        for cause in case.causes
    ]


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


def rows_of(seed: int, count: int, runner: Runner) -> list[dict[str, Any]]:
    """
    Return rows of the cases with several causes and rich motion among the first of a seed.

    Parameters
    ----------
    seed, count : int
    runner : Runner

    """
    kinds = [lot.kind for lot in mixed(seed, count)]
    tasks = [
        Task(shared, (seed, number), f'case {number}')
        for number in range(count)
        if kinds[number] in KINDS
    ]
    return [row for row in runner.run(tasks) if row is not None]
