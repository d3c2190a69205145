# Copyright 2026 weld_twin contributors
# SPDX-License-Identifier: Apache-2.0
"""Open the seals, check the commitments, hold verdicts against truths."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass
from pathlib import Path
from typing import Any

import numpy as np

from weld_twin_core.errors import DataError
from weld_twin_msgs_py.files.diagnosis_model import read_diagnosis

from . import layout, seal
from .achieved import Achieved, achieved
from .judging import AS_IT_IS, IN_LIBRARY, NAMING, NOT_IN_LIBRARY, Judged, judge
from .measures import (
    Measure,
    alias_measure,
    by,
    by_stratum,
    calibration_measures,
    parameter_measures,
    semi_real_measures,
    shrink_measures,
    verdict_measures,
)
from .statistics import reliability

MIB = 1 << 20
"""Bytes."""
SHRINKING = IN_LIBRARY | NOT_IN_LIBRARY
"""Kinds of cases with a gap to shrink."""


@dataclass(frozen=True, eq=False)
class Score:
    """
    Everything there is to say about a blind check.

    Attributes
    ----------
    made : dict
        Seed, seal, engine and how the diagnosis was run.
    cases : list of Judged
    shrinks : dict
        By case name, where causes were named.
    costs : dict
        Median and largest seconds and memory of a diagnosis.
    errors : mapping
        By case name, why there is no verdict.
    own : mapping
        What is said of real bags before anything is put into them, by their names.

    """

    made: dict[str, Any]
    cases: list[Judged]
    shrinks: dict[str, Achieved]
    costs: dict[str, float]
    errors: Mapping[str, str]
    own: Mapping[str, str]

    @property
    def measures(self) -> list[Measure]:
        """Return the measures, in the order they are told."""
        if self.own:
            return semi_real_measures(self.cases, self.own)
        return [
            *verdict_measures(self.cases),
            alias_measure(self.cases, self.shrinks),
            *calibration_measures(self.cases),
            *shrink_measures(self.known_shrinks),
            *parameter_measures(self.cases),
        ]

    @property
    def known_shrinks(self) -> list[Achieved]:
        """Return the shrinks of the cases whose causes are in the library."""
        known = {case.name for case in self.cases if case.in_library}
        return [value for name, value in self.shrinks.items() if name in known]

    @property
    def failures(self) -> list[Judged]:
        """Return the cases that were not answered rightly."""
        return [case for case in self.cases if not case.right]

    def as_dict(self) -> dict[str, Any]:
        """Return plain values."""
        told = [c for c in self.cases if c.status != 'error']
        bins = reliability([c.confidence for c in told], [c.right for c in told])
        return {
            'made': self.made,
            'count': len(self.cases),
            'measures': [measure.as_dict() for measure in self.measures],
            'by_kind': by(self.cases, lambda c: c.kind),
            'by_stratum': by_stratum(self.cases),
            'by_robot': by(self.cases, lambda c: c.robot),
            'by_motion': by(self.cases, lambda c: c.motion),
            'by_cause': by(
                [c for c in self.cases if c.kind not in ('double', 'triple')],
                lambda c: f'{c.truth.partition(" ")[0]} ({c.kind})',
            ),
            'reliability': [{**b._asdict(), 'right': b.right._asdict()} for b in bins],
            'costs': self.costs,
            'errors': dict(self.errors),
            'own': dict(self.own),
            'shrinks': {name: value._asdict() for name, value in self.shrinks.items()},
            'cases': [case.as_dict() for case in self.cases],
        }


def score(
    cases: Path,
    truths: Path,
    results: Path,
    *,
    seal_given: str = '',
) -> Score:
    """
    Return the score of verdicts.

    Parameters
    ----------
    cases, truths, results : Path
        As `make` and `diagnose_cases` wrote them.
    seal_given : str, optional
        The seal as printed before the diagnosis; left out, the one stored holds.

    Raises
    ------
    DataError
        A case or truth was changed, or the verdicts are on other cases.

    """
    opened = seal.opened(cases, truths, seal_given)
    listed = _verdicts_on(cases, results)
    verdicts = {verdict['name']: verdict for verdict in listed['verdicts']}
    judged: list[Judged] = []
    shrinks, own = {}, {}
    for truth in opened:
        name = truth['name']
        file = results / name / layout.DIAGNOSIS
        diagnosis = None if verdicts[name]['error'] else read_diagnosis(file)
        case = judge(truth, diagnosis)
        if case.kind == AS_IT_IS:
            own[case.motion] = case.said
            continue
        judged.append(case)
        if diagnosis and case.kind in SHRINKING and case.status in NAMING:
            claim = diagnosis['shrink']
            shrinks[name] = achieved(cases, truths, truth, file, claim)
    told = {key: value for key, value in listed.items() if key not in ('schema', 'verdicts')}
    made = {'seed': layout.read(truths / layout.TRUTHS)['seed'], **told}
    return Score(
        made,
        judged,
        shrinks,
        _costs(list(verdicts.values())),
        {name: verdict['error'] for name, verdict in verdicts.items() if verdict['error']},
        own,
    )


def _verdicts_on(cases: Path, results: Path) -> dict[str, Any]:
    listed = layout.read(results / layout.VERDICTS)
    if listed['seal'] != layout.read(cases / layout.CASES)['seal']:
        raise DataError(f"the verdicts in '{results}' are on other cases than those in '{cases}'")
    return listed


def _costs(verdicts: list[dict[str, Any]]) -> dict[str, float]:
    seconds = [verdict['seconds'] for verdict in verdicts]
    memory = [verdict['memory_bytes'] / MIB for verdict in verdicts]
    return {
        'median_seconds': float(np.median(seconds)),
        'most_seconds': float(np.max(seconds)),
        'median_memory_mib': float(np.median(memory)),
        'most_memory_mib': float(np.max(memory)),
    }
