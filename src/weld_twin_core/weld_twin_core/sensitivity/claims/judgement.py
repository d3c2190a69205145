# SPDX-FileCopyrightText: weld_twin contributors
# SPDX-License-Identifier: Apache-2.0
"""From the measurements on many robots and seams to a verdict on every claim."""

from __future__ import annotations

from collections.abc import Callable, Mapping, Sequence
from dataclasses import dataclass
from typing import Any, NamedTuple

import numpy as np

from ...errors import DataError

HOLDS, HOLDS_WHEN, DOES_NOT = 'holds', 'holds when', 'does not hold'
Measured = Mapping[str, float]


class CaseName(NamedTuple):
    """Which robot on which seam."""

    robot: str
    seam: str


class Range:
    """What a measurement was over all cases; formats as its least and largest value."""

    def __init__(self, values: Sequence[float]) -> None:
        self.low, self.high = float(np.min(values)), float(np.max(values))

    def __format__(self, form: str) -> str:
        """Return 'low to high' by a format, or one number where both read the same."""
        kind = form or '.3g'
        low, high = format(self.low, kind), format(self.high, kind)
        return low if low == high else f'{low} to {high}'

    def __mul__(self, factor: float) -> Range:
        return Range([self.low * factor, self.high * factor])


@dataclass(frozen=True)
class Rule:
    """
    A claim and how it is decided.

    Attributes
    ----------
    key, statement, where : str
        Name, what the paper says, and in which section.
    holds : callable
        Whether the claim as written holds on one case.
    reason : callable
        One line made of the ranges of the measurements.
    shows : tuple of str
        Measurements the table gives.
    condition : str
        Under which condition the claim holds where it does not hold as written.
    holds_then : callable, optional
        Whether it holds on one case under that condition.

    """

    key: str
    statement: str
    where: str
    holds: Callable[[Measured], bool]
    reason: Callable[[Mapping[str, Range]], str]
    shows: tuple[str, ...]
    condition: str = ''
    holds_then: Callable[[Measured], bool] | None = None


@dataclass(frozen=True)
class Claim:
    """
    A claim with its verdict.

    Attributes
    ----------
    key, statement, where : str
    verdict : str
        'holds', 'holds when ...' with the condition, or 'does not hold'.
    reason : str
    held : int; cases : int
        On how many of the cases the claim holds as written.
    measured : mapping
        Least and largest value of every measurement behind it.

    """

    key: str
    statement: str
    where: str
    verdict: str
    reason: str
    held: int
    cases: int
    measured: dict[str, tuple[float, float]]

    def as_dict(self) -> dict[str, Any]:
        """Return plain numbers and strings."""
        measured = {key: {'least': a, 'largest': b} for key, (a, b) in self.measured.items()}
        return {
            'claim': self.key,
            'statement': self.statement,
            'where': self.where,
            'verdict': self.verdict,
            'reason': self.reason,
            'held': self.held,
            'cases': self.cases,
            'measured': measured,
        }


def judge(cases: Mapping[CaseName, Measured]) -> tuple[Claim, ...]:
    """
    Return a verdict on every claim from the measurements of every case.

    Raises
    ------
    DataError
        There are no cases.

    """
    from .rules import RULES

    if not cases:
        raise DataError('the claims need at least one robot on one seam')
    return tuple(_decide(rule, list(cases.values())) for rule in RULES)


def _decide(rule: Rule, cases: Sequence[Measured]) -> Claim:
    ranges = {key: Range([case[key] for case in cases]) for key in cases[0]}
    held = sum(bool(rule.holds(case)) for case in cases)
    verdict = DOES_NOT
    if held == len(cases):
        verdict = HOLDS
    elif rule.holds_then is not None and all(rule.holds_then(case) for case in cases):
        verdict = f'{HOLDS_WHEN} {rule.condition}'
    measured = {key: (ranges[key].low, ranges[key].high) for key in rule.shows}
    return Claim(
        rule.key,
        rule.statement,
        rule.where,
        verdict,
        rule.reason(ranges),
        held,
        len(cases),
        measured,
    )
