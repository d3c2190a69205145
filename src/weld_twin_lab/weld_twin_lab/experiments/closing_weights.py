# Copyright 2026 weld_twin contributors
# SPDX-License-Identifier: Apache-2.0
"""How far to believe what two diagnoses of an investigation name: learned on cells that are open."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from typing import Any, NamedTuple

import numpy as np
from numpy.typing import NDArray

from weld_twin_core.arrays import Array
from weld_twin_core.errors import DataError
from weld_twin_msgs_py.files import markdown

from ..belief.learning import Weights, fitted

SIGNS = ('own', 'same', 'against')
"""Log odds of the answer, and those of the other diagnosis that speak for it, or against it."""
WAYS = np.array([1.0, 1.0, -1.0])
"""Which way each may change belief."""
RIDGE = 1.0
"""Towards the log odds of the answer alone, in log loss: as much as one answer."""
FOLDS = 10
"""Parts of the cells of which each is judged by weights learned from the others."""
TRIED = (0.9, 0.93, 0.95, 0.98)
"""Beliefs from which a question could be closed."""


class Heard(NamedTuple):
    """Every answer that was heard in the rounds of many cells."""

    signs: NDArray[Any]
    """Shape (N, 3)."""
    right: NDArray[Any]
    """Shape (N,)."""
    cell: NDArray[Any]
    turn: NDArray[Any]
    """Which cell, and which of its rounds, shape (N,)."""

    def only(self, rows: NDArray[Any]) -> Heard:
        """Return some of them."""
        return Heard(*(column[rows] for column in self))


def heard(cases: Sequence[Mapping[str, Any]]) -> Heard:
    """Return the answers that say what the causes are, of cells as in investigate.json."""
    rows = [
        (answer['signs'], answer['right'], k, turn)
        for k, case in enumerate(cases)
        for turn, step in enumerate(case['rounds'])
        for answer in (step.get('heard') or {}).values()
        if answer['stated']
    ]
    columns = zip(*rows, strict=True) if rows else ([], [], [], [])
    signs, right, cell, turn = (np.array(column) for column in columns)
    return Heard(signs.reshape(-1, len(SIGNS)), right.astype(bool), cell, turn)


def weights(taught: Heard) -> Weights:
    """Return what each sign counts, and what is added."""
    ones = np.ones(len(taught.right))
    prior = np.array([1.0, 0.0, 0.0])
    return fitted(taught.signs, taught.right, WAYS, RIDGE, ones, prior)


def unseen(all_: Heard) -> Array:
    """Return the belief in each answer by weights learned from other cells, shape (N,)."""
    out = np.zeros(len(all_.right))
    for fold in range(FOLDS):
        here = all_.cell % FOLDS == fold
        bias, slopes = weights(all_.only(~here))
        out[here] = 1.0 / (1.0 + np.exp(-(bias + all_.signs[here] @ slopes)))
    return out


def reached(all_: Heard, probability: Array, least: float) -> tuple[int, int]:
    """Return in how many cells the first answer believed by so much is right, and in how many wrong."""
    counts = [0, 0]
    for cell in np.unique(all_.cell):
        own = np.flatnonzero((all_.cell == cell) & (probability >= least))
        if own.size:
            first = own[all_.turn[own] == all_.turn[own].min()]
            counts[0 if all_.right[first[np.argmax(probability[first])]] else 1] += 1
    return counts[0], counts[1]


def page(cases: Sequence[Mapping[str, Any]]) -> str:
    """
    Return what was learned, and what it is worth on cells that it was not learned from.

    cases: as `heard` takes them.

    Raises DataError: none of them has two diagnoses of the same round.
    """
    all_ = heard(cases)
    if not len(all_.right):
        raise DataError('none of the cells has two diagnoses of the same round; give other tables')
    fit, probability = weights(all_), unseen(all_)
    learned = zip((*SIGNS, 'added'), (*fit.slopes, fit.bias), strict=True)
    rows = [(f'{least:.2f}', *map(str, reached(all_, probability, least))) for least in TRIED]
    return '\n'.join(
        [
            f'{len(all_.right)} answers of {len(np.unique(all_.cell))} cells',
            '',
            markdown.table(('sign', 'counts'), *((name, f'{v:.2f}') for name, v in learned)),
            '',
            markdown.table(('believed from', 'right', 'wrong'), *rows),
            '',
        ]
    )
