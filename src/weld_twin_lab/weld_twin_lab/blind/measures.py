# Copyright 2026 weld_twin contributors
# SPDX-License-Identifier: Apache-2.0
"""What is measured over many judged cases, with the goals it is held against."""

from __future__ import annotations

from collections.abc import Callable, Mapping, Sequence
from dataclasses import asdict, dataclass
from typing import Any, NamedTuple

import numpy as np

from .achieved import Achieved
from .judging import NOT_IN_LIBRARY, Judged
from .statistics import Estimate, bootstrap, brier, calibration_error, share

AS_GOOD = 1.05
"""RMS left over what the true causes leave, up to which an answer predicts as the truth does."""
CLEAR = 3.0
"""Effect RMS over noise from which a cause is plain to see."""
BINS = ((0.0, 1.0, '< 1'), (1.0, 3.0, '1-3'), (3.0, 10.0, '3-10'), (10.0, np.inf, '> 10'))
"""Effect RMS over noise: from, below, and what it is called."""


@dataclass(frozen=True)
class Measure:
    """
    One number over many cases.

    Attributes
    ----------
    key, title : str
    estimate : Estimate
    goal : float or None
    at_least : bool
        Whether the goal is a least or a most.

    """

    key: str
    title: str
    estimate: Estimate
    goal: float | None = None
    at_least: bool = True

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


class Question(NamedTuple):
    """
    What is asked of some of the cases.

    Attributes
    ----------
    key, title : str
    asked : callable
        Tells which cases are asked.
    told : callable
        Tells whether the answer to a case is right; None where it cannot be said.
    goal : float, optional
    at_least : bool
        Whether the goal is a least or a most.

    """

    key: str
    title: str
    asked: Callable[[Judged], bool]
    told: Callable[[Judged], bool | None]
    goal: float | None = None
    at_least: bool = True


def _clear(kind: str) -> Callable[[Judged], bool]:
    return lambda case: case.kind == kind and case.stratum >= CLEAR


def _kind(*kinds: str) -> Callable[[Judged], bool]:
    return lambda case: case.kind in kinds


def _faint(case: Judged) -> bool:
    return case.kind == 'single' and 1.0 <= case.stratum < CLEAR


def _status(*statuses: str) -> Callable[[Judged], bool]:
    return lambda case: case.status in statuses


def alias_measure(cases: Sequence[Judged], shrinks: Mapping[str, Achieved]) -> Measure:
    """Return how often a cause no library knows is unknown, or what is named does as well."""

    def told(case: Judged) -> bool:
        shrink = shrinks.get(case.name)
        return case.status == 'unknown' or (shrink is not None and shrink.over_floor < AS_GOOD)

    foreign = [case for case in cases if case.kind in NOT_IN_LIBRARY]
    return Measure(
        'alias',
        "withheld or outside: 'unknown', or as good on the sealed recording",
        _of(foreign, told),
    )


def calibration_measures(cases: Sequence[Judged]) -> list[Measure]:
    """Return how far the confidence can be trusted."""
    told = [c for c in cases if c.status != 'error']
    known = [c for c in told if c.kind not in NOT_IN_LIBRARY]
    return [
        Measure('ece', 'expected calibration error', _calibrated(told), 0.03, False),
        Measure('ece_library', 'the same, causes in the library and none', _calibrated(known)),
        Measure(
            'brier', 'Brier score', brier([c.confidence for c in told], [c.right for c in told])
        ),
    ]


def shrink_measures(shrinks: Sequence[Achieved]) -> list[Measure]:
    """Return how the shrink claimed compares with the shrink achieved on sealed recordings."""
    same = [s for s in shrinks if s.test == 'same motion']
    other = [s for s in shrinks if s.test != 'same motion']
    return [
        Measure(
            'shrink_off',
            'median distance of claimed and achieved shrink',
            _off(shrinks),
            0.03,
            False,
        ),
        Measure('shrink_off_same', 'the same, motion repeated', _off(same)),
        Measure('shrink_off_new', 'the same, another motion', _off(other)),
        Measure(
            'shrink_cover',
            '90 % interval of the shrink holds the achieved (85-95 %)',
            share([s.covered_90 for s in shrinks]),
            0.85,
        ),
        Measure(
            'shrink_cover_same', 'the same, motion repeated', share([s.covered_90 for s in same])
        ),
        Measure(
            'shrink_cover_new', 'the same, another motion', share([s.covered_90 for s in other])
        ),
        Measure(
            'over_floor',
            'RMS left over what the true causes leave, median',
            bootstrap([s.over_floor for s in shrinks]),
            1.05,
            False,
        ),
    ]


def parameter_measures(cases: Sequence[Judged]) -> list[Measure]:
    """Return whether parameters are within their standard errors."""
    z = [value for case in cases for value in case.z]
    return [
        Measure(
            'z_spread',
            'errors of parameters over their standard errors: RMS, outer 2 % cut',
            bootstrap(_trimmed(z), lambda v, axis: np.sqrt((v**2).mean(axis=axis))),
        ),
        Measure('z_inside', 'the same: share within 1.96', share([abs(v) < 1.96 for v in z])),
    ]


def semi_real_measures(cases: Sequence[Judged], own: Mapping[str, str]) -> list[Measure]:
    """
    Return how often a cause put into a real bag is named.

    Parameters
    ----------
    cases : sequence of Judged
    own : mapping
        What is said of every bag as it is, by its name.

    """
    new = [c for c in cases if c.truth not in own.get(c.motion, '')]
    return [
        Measure(
            f'semi_real_{k}',
            f'cause put into a real bag, {label} of its noise: named',
            _of([c for c in new if low <= c.stratum < high], _named),
        )
        for k, (low, high, label) in enumerate(BINS)
    ]


def by_stratum(cases: Sequence[Judged]) -> list[dict[str, Any]]:
    """Return the causes in the library by how large the weakest is against the noise."""
    out = []
    for low, high, label in BINS:
        for kind in ('single', 'double', 'triple'):
            inside = [c for c in cases if c.kind == kind and low <= c.stratum < high]
            if inside:
                out.append({'stratum': label, **row(kind, inside)})
    return out


def by(cases: Sequence[Judged], key: Callable[[Judged], str]) -> list[dict[str, Any]]:
    """Return the cases grouped, each group a row."""
    groups: dict[str, list[Judged]] = {}
    for case in cases:
        groups.setdefault(key(case), []).append(case)
    return [row(name, groups[name]) for name in sorted(groups)]


def row(name: str, cases: Sequence[Judged]) -> dict[str, Any]:
    """Return the measures that every group of cases has."""
    sets = [c.set for c in cases]
    return {
        'group': name,
        'count': len(cases),
        'right': share([c.right for c in cases])._asdict(),
        'family': _of(cases, _family)._asdict(),
        'joint': _of(cases, _joint)._asdict(),
        'sets': {key: sets.count(key) for key in ('exact', 'partial', 'wrong', 'silent')},
        'statuses': _counts(c.status for c in cases),
        'confidently_wrong': sum(c.confidently_wrong for c in cases),
        'breadth': float(np.mean([c.breadth for c in cases])),
    }


def _counts(values: Any) -> dict[str, int]:
    listed = list(values)
    return {key: listed.count(key) for key in sorted(set(listed))}


def _of(cases: Sequence[Judged], test: Callable[[Judged], bool | None]) -> Estimate:
    """Return the share of the cases that the test applies to and that pass it."""
    return share([told for told in map(test, cases) if told is not None])


def _family(case: Judged) -> bool | None:
    return case.family


def _joint(case: Judged) -> bool | None:
    return case.joint


def _exact(case: Judged) -> bool:
    return case.set == 'exact'


def _named(case: Judged) -> bool:
    return case.named


def _unknown(case: Judged) -> bool:
    return case.status == 'unknown'


def _calibrated(cases: Sequence[Judged]) -> Estimate:
    return calibration_error([c.confidence for c in cases], [c.right for c in cases])


def _off(shrinks: Sequence[Achieved]) -> Estimate:
    return bootstrap([abs(s.claimed - s.ratio) for s in shrinks])


def _trimmed(values: Sequence[float]) -> list[float]:
    ordered = sorted(values, key=abs)
    return ordered[: int(np.ceil(0.98 * len(ordered)))]


QUESTIONS = (
    Question(
        'single_family',
        'one cause, 3 sigma or more: family named',
        _clear('single'),
        _family,
        0.98,
    ),
    Question('single_joint', 'the same: joint named', _clear('single'), _joint, 0.98),
    Question('single_exact', 'the same: nothing else named', _clear('single'), _exact),
    Question(
        'faint_named', 'one cause, 1-3 sigma: named, or in the set that is', _faint, _named, 0.85
    ),
    Question(
        'double_named',
        'two causes, both 3 sigma or more: both named',
        _clear('double'),
        _named,
        0.90,
    ),
    Question(
        'triple_named',
        'three causes, all 3 sigma or more: all named',
        _clear('triple'),
        _named,
        0.80,
    ),
    Question(
        'ambiguous_named',
        'ambiguous by construction: truth or its like named',
        _kind('ambiguous'),
        _named,
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
    Question('withheld_unknown', "the same: 'unknown'", _kind('withheld'), _unknown),
    Question(
        'outside_unknown', "cause outside the library: 'unknown'", _kind('outside'), _unknown
    ),
    Question(
        'false_unknown',
        "cause in the library, or none: 'unknown' all the same",
        lambda case: case.in_library or case.kind == 'none',
        _unknown,
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
    return [
        Measure(
            q.key,
            q.title,
            _of([case for case in cases if q.asked(case)], q.told),
            q.goal,
            q.at_least,
        )
        for q in QUESTIONS
    ]
