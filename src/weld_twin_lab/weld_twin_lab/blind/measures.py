# Copyright 2026 weld_twin contributors
# SPDX-License-Identifier: Apache-2.0
"""What is measured over many judged cases, with the goals it is held against."""

from __future__ import annotations

from collections.abc import Callable, Mapping, Sequence
from dataclasses import asdict, dataclass
from operator import attrgetter
from typing import Any, NamedTuple

from weld_twin_msgs_py.files import markdown

from .judging import NOT_IN_LIBRARY, Judged
from .statistics import Estimate, brier, calibration_error, share

AS_GOOD = 1.05
"""RMS left over what the true causes leave, up to which an answer predicts as the truth does."""
NUMBERS = frozenset({'brier', 'ece', 'ece_library', 'seconds', 'fia'})
"""Measures that are numbers; the others are shares of cases."""
HEADS = ('measure', 'value', '95 % interval', 'cases', 'goal', 'reached')
REACHED = {None: '', True: 'yes', False: 'no'}
CLEAR = 3.0
"""Effect RMS over noise from which a cause is plain to see."""


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
    digits = 3 if item['key'].startswith(('brier', 'ece')) else 2

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


def _clear(kind: str) -> Callable[[Judged], bool]:
    return lambda case: case.kind == kind and case.stratum >= CLEAR


def _kind(*kinds: str) -> Callable[[Judged], bool]:
    return lambda case: case.kind in kinds


def _faint(case: Judged) -> bool:
    return case.kind == 'single' and 1.0 <= case.stratum < CLEAR


def _status(*statuses: str) -> Callable[[Judged], bool]:
    return lambda case: case.status in statuses


def alias_measure(cases: Sequence[Judged], remaining: Mapping[str, float]) -> Measure:
    """Return how often a cause no library knows is unknown, or what is named does as well."""
    question = Question(
        'alias',
        "withheld or outside: 'unknown', or as good on the sealed recording",
        _kind(*NOT_IN_LIBRARY),
        lambda case: case.status == 'unknown' or remaining.get(case.name, AS_GOOD) < AS_GOOD,
    )
    return measured([question], cases)[0]


def calibration_measures(cases: Sequence[Judged]) -> list[Measure]:
    """Return how far the confidence can be trusted."""
    answered = [c for c in cases if c.status != 'error']
    known = [c for c in answered if c.kind not in NOT_IN_LIBRARY]
    return [
        Measure('ece', 'expected calibration error', _calibrated(answered), 0.03, False),
        Measure('ece_library', 'the same, causes in the library and none', _calibrated(known)),
        Measure(
            'brier',
            'Brier score',
            brier([c.confidence for c in answered], [c.right for c in answered]),
        ),
    ]


def _calibrated(cases: Sequence[Judged]) -> Estimate:
    return calibration_error([c.confidence for c in cases], [c.right for c in cases])


QUESTIONS = (
    Question(
        'single_family',
        'one cause, 3 sigma or more: family named',
        _clear('single'),
        attrgetter('family'),
        0.98,
    ),
    Question('single_joint', 'the same: joint named', _clear('single'), attrgetter('joint'), 0.98),
    Question(
        'single_exact',
        'the same: nothing else named',
        _clear('single'),
        lambda case: case.set == 'exact',
    ),
    Question(
        'faint_named',
        'one cause, 1-3 sigma: named, or in the set that is',
        _faint,
        attrgetter('named'),
        0.85,
    ),
    Question(
        'double_named',
        'two causes, both 3 sigma or more: both named',
        _clear('double'),
        attrgetter('named'),
        0.90,
    ),
    Question(
        'triple_named',
        'three causes, all 3 sigma or more: all named',
        _clear('triple'),
        attrgetter('named'),
        0.80,
    ),
    Question(
        'ambiguous_named',
        'ambiguous by construction: truth or its like named',
        _kind('ambiguous'),
        attrgetter('named'),
    ),
    Question(
        'ambiguous_said',
        'the same: and said to be ambiguous',
        _kind('ambiguous'),
        lambda case: case.named and case.status == 'ambiguous',
    ),
    Question(
        'false_alarm',
        'no cause: something named or found',
        _kind('none'),
        lambda case: case.status != 'none',
        0.01,
        False,
    ),
    Question(
        'withheld_honest',
        "family withheld: 'unknown' or a set, no wrong name",
        _kind('withheld'),
        _status('unknown', 'ambiguous'),
        0.90,
    ),
    Question('withheld_unknown', "the same: 'unknown'", _kind('withheld'), _status('unknown')),
    Question(
        'outside_unknown',
        "cause outside the library: 'unknown'",
        _kind('outside'),
        _status('unknown'),
    ),
    Question(
        'false_unknown',
        "cause in the library, or none: 'unknown' all the same",
        lambda case: case.in_library or case.kind == 'none',
        _status('unknown'),
        0.03,
        False,
    ),
    Question(
        'confident_wrong',
        'sure and wrong',
        lambda case: True,
        lambda case: case.confidently_wrong,
        0.01,
        False,
    ),
)
"""What verdicts are measured by, with the goals they are held against."""


def verdict_measures(cases: Sequence[Judged]) -> list[Measure]:
    """Return how often which kind of case was answered rightly."""
    return measured(QUESTIONS, cases)
