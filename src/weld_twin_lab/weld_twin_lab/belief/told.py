# Copyright 2026 weld_twin contributors
# SPDX-License-Identifier: Apache-2.0
"""What is believed of an answer before and after anything was learned."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from typing import Any, NamedTuple

import numpy as np
from numpy.typing import NDArray

from weld_twin_core.arrays import Array
from weld_twin_core.diagnosis.trust.model import Trust
from weld_twin_core.diagnosis.trust.trusted import group_of

from ..blind.judging import CONFIDENT
from ..blind.statistics import brier, calibration_error, share
from .bound import upper_limit
from .judged import Case, Example

COVERAGE = 0.7
"""Share of the cases, the surest first, at which the risk is quoted."""


class Belief(NamedTuple):
    """
    What is believed of many statements, and which were right.

    Attributes
    ----------
    before, after : array, shape (N,)
        By hand, and as learned.
    right, sure : array of bool, shape (N,)
        Which were right, and which are told as sure.

    """

    before: Array
    after: Array
    right: NDArray[np.bool_]
    sure: NDArray[np.bool_]


def belief_in(examples: Sequence[Example], trust: Trust) -> Belief:
    """
    Return what is believed of statements.

    Parameters
    ----------
    examples : sequence of Example
    trust : Trust

    """
    after = [trust.learned(*_level(e), e.signs) for e in examples]
    before = [e.told for e in examples]
    return Belief(
        np.array(before),
        np.array([b if a is None else a for a, b in zip(after, before, strict=True)]),
        np.array([e.right for e in examples], dtype=bool),
        np.array([trust.sure(*_level(e), e.signs) for e in examples], dtype=bool),
    )


def _level(example: Example) -> tuple[str, str]:
    level, _, group = example.level.partition(' ')
    return level, group


def calibration(belief: Belief, told: Array) -> dict[str, Any]:
    """
    Return how far some beliefs can be trusted.

    Parameters
    ----------
    belief : Belief
    told : array, shape (N,)
        Its ``before`` or its ``after``.

    """
    right = list(map(bool, belief.right))
    sure = belief.sure if told is belief.after else told > CONFIDENT
    wrong = sure & ~belief.right
    return {
        'ece': calibration_error(list(told), right)._asdict(),
        'brier': brier(list(told), right)._asdict(),
        'sure': share(list(sure))._asdict(),
        'sure_and_wrong': share(list(wrong))._asdict(),
        'sure_and_wrong_most_95': upper_limit(int(wrong.sum()), max(len(right), 1), 0.05),
        'wrong_at_70': float(risk_at(told, belief.right, COVERAGE)),
    }


def risk_at(told: Array, right: NDArray[np.bool_], coverage: float) -> float:
    """
    Return the share that is wrong among the surest.

    Parameters
    ----------
    told, right : array, shape (N,)
    coverage : float
        Share of the statements that are looked at.

    """
    count = max(round(coverage * told.size), 1)
    first = np.argsort(-told, kind='stable')[:count]
    return float((~right[first]).mean()) if told.size else 0.0


def risk_curve(told: Array, right: NDArray[np.bool_]) -> tuple[Array, Array]:
    """
    Return coverage and the share wrong among those covered, the surest first.

    Parameters
    ----------
    told, right : array, shape (N,)

    """
    order = np.argsort(-told, kind='stable')
    count = np.arange(1, told.size + 1)
    return count / told.size, np.cumsum(~right[order]) / count


def sure_and_right(case: Case, trust: Trust) -> bool:
    """
    Return whether a case is answered rightly and told as sure.

    Parameters
    ----------
    case : Case
    trust : Trust

    """
    return case.right and is_sure(case, trust)


def is_sure(case: Case, trust: Trust) -> bool:
    """
    Return whether an answer as a whole is told as sure.

    Parameters
    ----------
    case : Case
    trust : Trust

    """
    signs: Mapping[str, float] = case.row['signs']
    return trust.sure('answer', group_of(case.judged.status, signs), signs)
