# Copyright 2026 weld_twin contributors
# SPDX-License-Identifier: Apache-2.0
"""What answers are worth on cases that nothing was learned from, beside the goals."""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np

from weld_twin_core.diagnosis.result import Cause, Site
from weld_twin_core.diagnosis.trust.model import Trust
from weld_twin_core.diagnosis.trust.trusted import trusted_cause

from ..blind.judging import NOT_IN_LIBRARY
from ..blind.measures import Measure
from ..blind.statistics import Estimate, bootstrap, share
from .judged import Case
from .levels_of_truth import levels_of
from .told import is_sure, sure_and_right

SEEN, PLAIN = 1.0, 3.0
"""Effect RMS over noise from which a cause can be seen, and from which it is plain."""


def goal_measures(cases: Sequence[Case], trust: Trust) -> list[Measure]:
    """
    Return the measures of verdicts, of levels, and of what curves remove.

    Parameters
    ----------
    cases : sequence of Case
        None of them was learned from.
    trust : Trust

    """
    known = [c for c in cases if c.judged.in_library and c.judged.stratum >= SEEN]
    return [
        *_of_causes(cases, trust),
        *_of_foreign([c for c in cases if c.judged.kind in NOT_IN_LIBRARY]),
        Measure(
            'needless_unknown',
            'causes in the library, 1 noise or more: needlessly unknown',
            share([c.judged.status == 'unknown' for c in known]),
            0.02,
            False,
        ),
        Measure(
            'fia', 'mean belief in the true family, one cause detected', _fia(cases, trust), 0.93
        ),
        Measure('breadth', 'members of a set, median', _breadth(cases), 2.0, False),
        Measure('seconds', 'processor seconds of a diagnosis, median', _seconds(cases)),
    ]


def _of_causes(cases: Sequence[Case], trust: Trust) -> list[Measure]:
    """Return the measures of named causes, and of what is said as sure."""
    single = [c for c in cases if c.judged.kind == 'single' and c.judged.stratum >= SEEN]
    wrong = [is_sure(c, trust) and not c.right for c in cases]
    return [
        Measure('sure_wrong', 'sure and wrong', share(wrong), 0.01, False),
        Measure(
            'single_sure',
            'one cause in the library, 1 noise or more: right and sure',
            share([sure_and_right(c, trust) for c in single]),
            0.90,
        ),
        Measure('single_right', 'the same: right', share([c.right for c in single])),
        Measure(
            'double_named', 'two causes, each 3 noise: both named', _named(cases, 'double'), 0.92
        ),
        Measure(
            'triple_named', 'three causes, each 3 noise: all named', _named(cases, 'triple'), 0.85
        ),
    ]


def _of_foreign(foreign: Sequence[Case]) -> list[Measure]:
    """Return the measures of causes that the library does not have."""
    return [
        Measure(
            'honest',
            'withheld or outside: unknown, a set that holds it, or as good on sealed data',
            share([c.honest or c.judged.status == 'unknown' for c in foreign]),
            0.95,
        ),
        Measure('place', 'the same: place right, first answer', _level(foreign, 'place', 0), 0.90),
        Measure(
            'dependence', 'the same: dependence right', _level(foreign, 'dependence', 1), 0.85
        ),
        Measure(
            'curve_removes',
            "the same, 'unknown': share of the removable gap removed on a new motion, median",
            _removed(foreign),
            0.70,
        ),
    ]


def _named(cases: Sequence[Case], kind: str) -> Estimate:
    asked = [c for c in cases if c.judged.kind == kind and c.judged.stratum >= PLAIN]
    return share([c.judged.named for c in asked])


def _level(cases: Sequence[Case], level: str, at: int) -> Estimate:
    """Return how often the first place, or dependence, of the largest cause is right."""
    word, hits = ('at' if level == 'place' else 'on'), []
    for case in cases:
        causes = case.row['verdict']['causes']
        right = frozenset().union(*(truth[at] for truth in levels_of(case.row['truth'])))
        hits.append(bool(causes and causes[0][level] and causes[0][level][0][word] in right))
    return share(hits)


def _removed(cases: Sequence[Case]) -> Estimate:
    out = []
    for case in cases:
        sealed, truth = case.row['sealed'], case.row['truth']
        room = sealed['before'] ** 2 - sealed['floor'] ** 2
        if case.judged.status == 'unknown' and truth['test'] == 'new motion' and room > 0.0:
            out.append((sealed['before'] ** 2 - sealed['after'] ** 2) / room)
    return bootstrap(out)


def _fia(cases: Sequence[Case], trust: Trust) -> Estimate:
    """Return the mean belief in the true family, as fault isolation benchmarks have it."""
    out = []
    for case in cases:
        if case.judged.kind == 'single' and case.judged.status != 'none':
            (family, _), *_ = case.row['truth']['sites']
            beliefs = [
                _belief_in(family, cause, case, more, trust) for cause, more in _causes(case)
            ]
            out.append(max(beliefs, default=0.0))
    return bootstrap(out, np.mean)


def _causes(case: Case) -> list[tuple[dict[str, object], dict[str, float]]]:
    return list(zip(case.row['verdict']['causes'], case.row['cause_signs'], strict=True))


def _belief_in(
    family: str, told: dict[str, object], case: Case, more: dict[str, float], trust: Trust
) -> float:
    """Return the belief in a family that one cause holds, as it is told."""
    names = told['name']
    assert isinstance(names, list)
    sites = tuple((Site(n['effect'], n['joint']), float(n['probability'])) for n in names)
    slot = None if told.get('effect', 0) is None else 0
    bare = Cause((), (), sites, 0.0, (0.0, 0.0), slot=slot)
    cause = trusted_cause(bare, case.judged.status, {**case.row['signs'], **more}, trust)
    return sum(p for site, p in cause.name if site.effect == family)


def _breadth(cases: Sequence[Case]) -> Estimate:
    sizes = [len(g) for c in cases for g in c.row['verdict']['indistinguishable'] if len(g) > 1]
    return bootstrap([float(size) for size in sizes])


def _seconds(cases: Sequence[Case]) -> Estimate:
    return bootstrap([float(c.row['seconds']) for c in cases])
