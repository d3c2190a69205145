# Copyright 2026 weld_twin contributors
# SPDX-License-Identifier: Apache-2.0
"""Open the seals, check the commitments, hold verdicts against truths; the score as a page."""

from __future__ import annotations

from collections.abc import Callable, Mapping
from dataclasses import dataclass
from pathlib import Path
from typing import Any

import numpy as np

from weld_twin_core.diagnosis.result import NAMING
from weld_twin_core.errors import DataError
from weld_twin_msgs_py.files.diagnosis_model import read_diagnosis

from ..study import tabled
from . import layout, seal
from .achieved import over_floor
from .judging import NOT_IN_LIBRARY, Judged, judge
from .measures import (
    Measure,
    alias_measure,
    calibration_measures,
    measure_table,
    verdict_measures,
)

MIB = 1 << 20
"""Bytes."""


@dataclass(frozen=True, eq=False)
class Score:
    """Everything there is to say about a blind check."""

    made: dict[str, Any]
    """Seed, seal, engine and how the diagnosis was run."""
    cases: list[Judged]
    left: dict[str, float]
    """RMS left over what the true causes leave, by case name, where causes were named."""
    costs: dict[str, float]
    """Median and largest seconds and memory of a diagnosis."""
    errors: Mapping[str, str]
    """By case name, why there is no verdict."""

    @property
    def measures(self) -> list[Measure]:
        """Return the measures, in the order they are told."""
        return [
            *verdict_measures(self.cases),
            alias_measure(self.cases, self.left),
            *calibration_measures(self.cases),
        ]

    def as_dict(self) -> dict[str, Any]:
        """Return plain values."""
        return {
            'made': self.made,
            'count': len(self.cases),
            'measures': [measure.as_dict() for measure in self.measures],
            'costs': self.costs,
            'errors': dict(self.errors),
            'left': self.left,
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

    cases, truths, results: as `make` and `diagnose_cases` wrote them.
    seal_given: the seal as printed before the diagnosis; left out, the one stored holds.

    Raises DataError: a case or truth was changed, or the verdicts are on other cases.
    """
    opened = seal.opened(cases, truths, seal_given)
    listed = _verdicts_on(cases, results)
    verdicts = {verdict['name']: verdict for verdict in listed['verdicts']}
    judged: list[Judged] = []
    remaining = {}
    for truth in opened:
        name = truth['name']
        file = results / name / layout.DIAGNOSIS
        diagnosis = None if verdicts[name]['error'] else read_diagnosis(file)
        case = judge(truth, diagnosis)
        judged.append(case)
        if diagnosis and case.kind in NOT_IN_LIBRARY and case.status in NAMING:
            remaining[name] = over_floor(cases, truths, truth, file)
    about = {key: value for key, value in listed.items() if key not in ('schema', 'verdicts')}
    made = {'seed': layout.read(truths / layout.TRUTHS)['seed'], **about}
    return Score(
        made,
        judged,
        remaining,
        _costs(list(verdicts.values())),
        {name: verdict['error'] for name, verdict in verdicts.items() if verdict['error']},
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


def page(score: Score) -> str:
    """Return measures, cases that were missed, and what a diagnosis costs."""
    made, costs = score.made, score.costs
    seen = 'could be read' if made['truths_readable'] else 'could not be read'
    missed = [case for case in score.cases if not case.right]
    columns: dict[str, Callable[[Judged], str]] = {
        'case': lambda case: case.name,
        'kind': lambda case: f'{case.kind}, {case.robot}, {case.motion}',
        'truth (RMS over noise)': lambda case: f'{case.truth} ({case.stratum:.1f})',
        'verdict': lambda case: f'{case.status}: {case.said or "-"}',
        'confidence': lambda case: f'{case.confidence:.2f}',
        'why there is none': lambda case: score.errors.get(case.name, ''),
    }
    return '\n'.join(
        [
            f'# {len(score.cases) - len(missed)} of {len(score.cases)} cases answered rightly\n',
            f'Seed {made["seed"]}, seal {made["seal"]}, engine {made["engine"][:16]} of version '
            f'{made["version"]}. Truths {seen} from where the cases were diagnosed.\n',
            measure_table([measure.as_dict() for measure in score.measures]),
            f'A diagnosis took {costs["median_seconds"]:.1f} s in the median, '
            f'{costs["most_seconds"]:.1f} s at most, and {costs["most_memory_mib"]:.0f} MiB.\n',
            *([tabled(columns, missed)] if missed else []),
        ]
    )
