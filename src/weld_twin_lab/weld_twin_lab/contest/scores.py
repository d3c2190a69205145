# Copyright 2026 weld_twin contributors
# SPDX-License-Identifier: Apache-2.0
"""What answers are worth, by the same rules for all."""

from __future__ import annotations

from collections.abc import Callable, Mapping, Sequence
from dataclasses import dataclass, fields
from functools import partial
from pathlib import Path
from typing import Any

import numpy as np
from scipy.special import ndtr

from weld_twin_core.arrays import Array
from weld_twin_msgs_py.bags import read_recording
from weld_twin_msgs_py.robots import load_robot

from ..blind import seal
from ..blind.cause_sizes import Site
from ..blind.scoring import (
    CONFIDENT,
    IN_LIBRARY,
    NORMAL_90,
    answers_of,
    counted,
    measured_of,
    rms,
)
from ..study import Study, listed, shown, tabled
from . import course
from .course import ContestAnswer, Name, Run, read_case
from .entrants import ENTRANTS
from .entrants.geometry import never_knows

DENSITY, APART = 1.0 / np.sqrt(2.0 * np.pi), 1.0 / np.sqrt(np.pi)
"""Of a normal distribution of unit width: its density in the middle, and half the mean distance of two
draws."""
LIKELY = 0.5
"""Probability from which something is said to be there."""
NAMES = 3
"""Names of one cause that count: with more, nothing has been told apart."""


@dataclass(frozen=True)
class Sealed:
    """The truth of a case, and what was measured when the methods were asked."""

    truth: Mapping[str, Any]
    positions: Array
    good: Array
    nominal_m: float

    @property
    def named(self) -> bool:
        return self.truth['kind'] in IN_LIBRARY


def sealed(cases: Path, truths: Path, name: str, nominal: Array) -> Sealed:
    """Return the truth of a case; ``nominal`` is what the nominal arm predicts, shape (M, 3)."""
    truth = seal.read(truths / name / seal.TRUTH)
    test = read_recording(truths / name / seal.TEST, load_robot(str(cases / name / seal.ROBOT)))
    good = counted(test, truth['outliers'])
    positions = measured_of(test).position
    return Sealed(truth, positions, good, rms((positions - nominal)[good]))


@dataclass(frozen=True)
class Point:
    """
    What one answer was worth; None where the question does not arise.

    References
    ----------
    .. [1] T. Gneiting, A. E. Raftery, "Strictly proper scoring rules, prediction, and estimation",
       Journal of the American Statistical Association 102, 2007, equation 21.

    """

    detected: bool | None
    false_alarm: bool | None
    family: bool | None
    joint: bool | None
    belief: float | None
    """In the true families, of cases detected."""
    sure_wrong: bool
    left: float
    """Gap with the prediction over the gap of the nominal arm."""
    over_floor: float
    """Gap with the prediction over what the true causes would leave."""
    held: float | None = None
    width_m: float | None = None
    crps_m: float | None = None
    """Share of the measured coordinates within their 90 % interval; the median of its width; and
    the mean continuous ranked probability score, which is less the sharper and the truer an answer
    is [1]_. None where a method does not say how sure it is."""


def promised(off: Array, sigma: Array) -> tuple[float, float, float]:
    """Return the share held by 90 % intervals, their median width and mean CRPS, off by (M, 3) [m]."""
    z = off / sigma
    score = sigma * (z * (2.0 * ndtr(z) - 1.0) + 2.0 * DENSITY * np.exp(-0.5 * z**2) - APART)
    covered = float((np.abs(z) <= NORMAL_90).mean())
    return covered, 2.0 * NORMAL_90 * float(np.median(sigma)), float(score.mean())


def point(answer: ContestAnswer, case: Sealed) -> Point:
    truth = case.truth
    there = answer.none < LIKELY and (bool(answer.causes) or answer.unknown >= LIKELY)
    something = truth['kind'] != 'none'
    best = max(answers_of(truth), key=lambda at: _belief(answer, at)) if case.named else []
    first = {(effect, joint) for effect, joint, _ in _first(answer, len(best))}
    family = {effect for effect, _ in best} <= {effect for effect, _ in first}
    joint = {at[1] for at in best} <= {at[1] for at in first}
    off = (case.positions - answer.predicted)[case.good]
    gap = rms(off)
    return Point(
        there if something else None,
        None if something else there,
        family if case.named else None,
        joint if case.named else None,
        _belief(answer, best) if case.named and there else None,
        _sure_wrong(answer, case),
        gap / case.nominal_m,
        gap / float(truth['floor_m']),
        *(() if answer.sigma is None else promised(off, answer.sigma[case.good])),
    )


def _first(answer: ContestAnswer, count: int) -> list[Name]:
    """Return the names of so many causes, the likeliest, and of each the likeliest names."""
    ranked = sorted(answer.causes, key=lambda cause: -sum(p for *_, p in cause))
    return [
        name
        for cause in ranked[:count]
        for name in sorted(cause, key=lambda name: -name[2])[:NAMES]
    ]


def _names(answer: ContestAnswer) -> list[Name]:
    return [name for cause in answer.causes for name in cause]


def _belief(answer: ContestAnswer, sites: Sequence[Site]) -> float:
    each = [
        max((p for effect, _, p in _names(answer) if effect == at[0]), default=0.0) for at in sites
    ]
    return float(np.mean(each)) if each else 0.0


def _sure_wrong(answer: ContestAnswer, case: Sealed) -> bool:
    """Return whether it is sure of a cause that is none, or of nothing where something is."""
    right = {at for sites in answers_of(case.truth) for at in sites} if case.named else set()
    if answer.sure is None:
        sure = [[(effect, joint)] for effect, joint, p in _names(answer) if p > CONFIDENT]
        denies = answer.none > CONFIDENT
    else:
        pairs = zip(answer.causes, answer.sure, strict=False)
        sure = [[(effect, joint) for effect, joint, _ in cause] for cause, known in pairs if known]
        denies = answer.none > 0.0 and answer.sure[-1]
    denied = denies and case.truth['kind'] != 'none'
    return denied or any(not right & set(group) for group in sure)


def page(runs: Mapping[str, Mapping[str, Run]], cases: Mapping[str, Sealed], nominal: str) -> str:
    rows = [(method, summary(said, cases)) for method, said in runs.items()]
    return tabled(COLUMNS, rows) + f'\n{nominal}\n'


def summary(runs: Mapping[str, Run], cases: Mapping[str, Sealed]) -> dict[str, Any]:
    points = [point(run.answer, cases[name]) for name, run in runs.items() if run.answer]

    def over_all(key: str) -> float | None:
        """Return a mean, or a median of what is a size."""
        given = [getattr(each, key) for each in points if getattr(each, key) is not None]
        middle = np.median if key in ('left', 'over_floor', 'width_m', 'crps_m') else np.mean
        return float(middle(given)) if given else None

    said = list(runs.values())
    return {
        'cases': len(runs),
        'answers': len(points),
        **{field.name: over_all(field.name) for field in fields(Point)},
        'worse_than_nominal': sum(each.left > 1.0 for each in points),
        'seconds': float(np.median([run.seconds for run in said])),
        'memory_bytes': float(np.median([run.memory_bytes for run in said])),
    }


_share = partial(shown, 1, by='{:.0f} %', times=100.0, none='-')
_number = partial(shown, 1, by='{:.2f}', none='-')
_millimetres = partial(shown, 1, by='{:.3f}', times=1e3, none='-')
COLUMNS: dict[str, Callable[[Any], object]] = {
    'method': lambda row: row[0],
    'answers': lambda row: f'{row[1]["answers"]} of {row[1]["cases"]}',
    'detected': _share('detected'),
    'false alarms': _share('false_alarm'),
    'family': _share('family'),
    'joint': _share('joint'),
    'belief (FIA)': _number('belief'),
    'sure and wrong': _share('sure_wrong'),
    'gap left, median': _number('left'),
    'over the floor, median': _number('over_floor'),
    'worse than nominal': shown(1, 'worse_than_nominal'),
    '90 % hold': _share('held'),
    'their width [mm]': _millimetres('width_m'),
    'CRPS [mm]': _millimetres('crps_m'),
    'processor [s]': shown(1, 'seconds', by='{:.1f}'),
    'memory [MB]': shown(1, 'memory_bytes', by='{:.0f}', times=1e-6),
}
"""Columns of the table of methods, each a name and its summary."""


def run(study: Study) -> None:
    args = study.args
    methods = course.commands(listed(args.entrants) or list(ENTRANTS), args.enter)
    content, table = _on_sealed(study, methods)
    errors: course.Errors = {}
    measured: dict[str, Array] = {}
    if args.ur5 and args.ur10:
        place = study.out / 'arms'
        measured = course.arm_cases(Path(args.ur5), Path(args.ur10), place)
        counts = {name: len(rows) for name, rows in measured.items()}
        answers = study.out / 'arm_answers'
        runs = course.run_all(place, list(measured), methods, answers, counts, study.tell)
        errors = course.lefts(runs, measured)
    content['arms_mean_m'] = errors
    study.write('contest', content, course.page(table, errors, measured))


def _on_sealed(study: Study, methods: dict[str, list[str]]) -> tuple[dict[str, Any], str]:
    args, out = study.args, study.out
    cases, truths = Path(args.cases), Path(args.truths)
    names = course.opened(cases, truths, out / 'cases')[: args.first or None]
    known = {name: read_case(out / 'cases' / name) for name in names}
    truth = {
        name: sealed(cases, truths, name, never_knows(case).predicted)
        for name, case in known.items()
    }
    counts = {name: case.times.size for name, case in known.items()}
    runs = course.run_all(out / 'cases', names, methods, out / 'answers', counts, study.tell)
    content = {
        'methods': {method: summary(said, truth) for method, said in runs.items()},
        'troubles': {
            method: {name: run.trouble for name, run in said.items() if run.trouble}
            for method, said in runs.items()
        },
        'cases': names,
    }
    return content, page(runs, truth, f'{len(names)} cases.')
