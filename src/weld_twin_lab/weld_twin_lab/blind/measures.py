# Copyright 2026 weld_twin contributors
# SPDX-License-Identifier: Apache-2.0
"""What is measured over many judged cases, with the goals it is held against."""

from __future__ import annotations

from collections.abc import Callable, Mapping, Sequence
from dataclasses import asdict, dataclass
from typing import Any, NamedTuple

from weld_twin_msgs_py.files import markdown

from .statistics import Estimate, share

NUMBERS = frozenset({'ece', 'seconds', 'fia', 'fia_shared'})
"""Measures that are numbers; the others are shares of cases."""
HEADS = ('measure', 'value', '95 % interval', 'cases', 'goal', 'reached')
REACHED = {None: '', True: 'yes', False: 'no'}


@dataclass(frozen=True)
class Measure:
    """One number over many cases."""

    key: str
    title: str
    estimate: Estimate
    goal: float | None = None
    at_least: bool = True
    """Whether the goal is a least or a most."""

    @property
    def reached(self) -> bool | None:
        """Return whether the goal is reached, None where there is none or no case."""
        value = self.estimate.value
        if self.goal is None or value is None:
            return None
        return value >= self.goal if self.at_least else value <= self.goal

    def as_dict(self) -> dict[str, Any]:
        """Return plain values."""
        return {**asdict(self), 'estimate': self.estimate._asdict(), 'reached': self.reached}


def measure_table(measures: Sequence[Mapping[str, Any]]) -> str:
    """
    Return measures beside their goals in Markdown.

    measures: as `Measure.as_dict` gives them.
    """
    return markdown.table(HEADS, *map(_row, measures))


def _row(item: Mapping[str, Any]) -> tuple[str, ...]:
    estimate, goal = item['estimate'], item['goal']
    if estimate['value'] is None:
        return (item['title'], '-', '-', '0', '-', '-')
    digits = 3 if item['key'] == 'ece' else 2

    def in_words(value: float) -> str:
        return f'{value:.{digits}f}' if item['key'] in NUMBERS else f'{100.0 * value:.1f} %'

    return (
        item['title'],
        in_words(estimate['value']),
        f'{in_words(estimate["low"])} to {in_words(estimate["high"])}',
        str(estimate['cases']),
        '' if goal is None else f'{"≥" if item["at_least"] else "≤"} {in_words(goal)}',
        REACHED[item['reached']],
    )


class Question(NamedTuple):
    """What is asked of some of the cases."""

    key: str
    title: str
    asked: Callable[[Any], bool]
    """Tells which cases are asked."""
    right: Callable[[Any], Any]
    """Tells whether the answer to a case is right; None where it cannot be said."""
    goal: float | None = None
    at_least: bool = True
    """Whether the goal is a least or a most."""


def measured(questions: Sequence[Question], cases: Sequence[Any]) -> list[Measure]:
    """Return the share of cases that each question is asked of and that answer it rightly."""
    out = []
    for q in questions:
        answers = [q.right(case) for case in cases if q.asked(case)]
        hits = [bool(one) for one in answers if one is not None]
        out.append(Measure(q.key, q.title, share(hits), q.goal, q.at_least))
    return out
