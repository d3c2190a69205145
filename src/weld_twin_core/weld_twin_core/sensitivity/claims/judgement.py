# Copyright 2026 weld_twin contributors
# SPDX-License-Identifier: Apache-2.0
"""From the measurements on many robots and seams to a verdict on every claim."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import asdict, dataclass
from typing import Any, NamedTuple

from ...errors import DataError
from .rules import RULES, Measured, Range, Rule

_HOLDS, _HOLDS_WHEN, _DOES_NOT = 'holds', 'holds when', 'does not hold'


class CaseName(NamedTuple):
    """Which robot on which seam."""

    robot: str
    seam: str


@dataclass(frozen=True)
class Claim:
    """A claim with its verdict."""

    key: str
    statement: str
    where: str
    verdict: str
    """'holds', 'holds when ...' with the condition, or 'does not hold'."""
    reason: str
    held: int
    """On how many of the cases the claim holds as written."""
    cases: int
    measured: dict[str, tuple[float, float]]
    """Least and largest value of every measurement behind it."""

    def as_dict(self) -> dict[str, Any]:
        """Return plain numbers and strings."""
        measured = {key: {'least': a, 'largest': b} for key, (a, b) in self.measured.items()}
        told = asdict(self)
        return {'claim': told.pop('key'), **told, 'measured': measured}


def judge(cases: Mapping[CaseName, Measured]) -> tuple[Claim, ...]:
    """Return a verdict on every claim by the measurements of all cases; DataError for none."""
    if not cases:
        raise DataError('the claims need at least one robot on one seam')
    return tuple(_decide(rule, list(cases.values())) for rule in RULES)


def _decide(rule: Rule, cases: Sequence[Measured]) -> Claim:
    ranges = {key: Range([case[key] for case in cases]) for key in cases[0]}
    held = sum(bool(rule.holds(case)) for case in cases)
    verdict = _DOES_NOT
    if held == len(cases):
        verdict = _HOLDS
    elif rule.holds_then is not None and all(rule.holds_then(case) for case in cases):
        verdict = f'{_HOLDS_WHEN} {rule.condition}'
    measured = {key: (ranges[key].low, ranges[key].high) for key in rule.shows}
    told = rule.key, rule.statement, rule.where, verdict, rule.reason(ranges)
    return Claim(*told, held, len(cases), measured)
