# Copyright 2026 weld_twin contributors
# SPDX-License-Identifier: Apache-2.0
"""
Open the seals, check the commitments, hold verdicts against truths; the score as a page.

What is measured over many judged cases has goals. Displacements of the tool are of shape (M, 3) [m].
"""

from __future__ import annotations

from collections.abc import Callable, Collection, Iterable, Mapping, Sequence
from dataclasses import asdict, dataclass
from operator import attrgetter
from pathlib import Path
from typing import Any, NamedTuple

import numpy as np
from scipy.optimize import linear_sum_assignment
from scipy.stats import binomtest

from weld_twin_core.arm.robot import Robot
from weld_twin_core.arrays import Array
from weld_twin_core.diagnosis.algebra.problem import Model, Problem, usable
from weld_twin_core.diagnosis.frames.alignment import initial_frames, refined
from weld_twin_core.diagnosis.result import NAMING
from weld_twin_core.effects.effect import Effect
from weld_twin_core.errors import DataError
from weld_twin_core.recording import Measurements, Recording
from weld_twin_msgs_py.files import markdown
from weld_twin_msgs_py.files.diagnosis_model import read_diagnosis

from ..study import tabled
from . import seal
from .cause_sizes import Site


def rigid(points: Array, off: Array) -> Array:
    """Return the part of a displacement (M, 3) that a moved base explains."""
    return explained(moves_of(points - points.mean(axis=0)), off)


def moves_of(points: Array) -> list[Array]:
    """Return how points (M, 3) move where they turn about, and are shifted along, each axis."""
    shifts = [np.tile(axis, (len(points), 1)) for axis in np.eye(3)]
    return [*(np.cross(axis, points) for axis in np.eye(3)), *shifts]


def explained(ways: Sequence[Array], off: Array) -> Array:
    """Return the part of a displacement (M, 3) that ways of its shape explain."""
    design = np.stack([way.ravel() for way in ways], axis=1)
    fitted, *_ = np.linalg.lstsq(design, off.ravel(), rcond=None)
    return np.asarray((design @ fitted).reshape(off.shape))


def rms(off: Array) -> float:
    """Return the RMS length of vectors (M, 3)."""
    return float(np.sqrt((off**2).sum(axis=1).mean()))


def correlation(a: Array, b: Array) -> float:
    """Return the absolute correlation of two deviations, shape (M, 3) each."""
    size = float(np.linalg.norm(a) * np.linalg.norm(b))
    return abs(float((a * b).sum())) / max(size, 1e-300)


NORMAL_90 = 1.6448536269514722
"""Half-width of a normal 90 % interval in standard deviations."""
TO_90 = NORMAL_90 / 1.959963984540054
"""Half-width of a normal 90 % interval over that of a 95 % one."""


def nominal_on(
    robot: Robot, known: tuple[Effect, ...], recording: Recording, align: Collection[str]
) -> Model:
    """Return the nominal model with the frames that a diagnosis of this recording starts from."""
    model = Model(robot, (robot.T_world_base,), known)
    if not align:
        return model
    problem = Problem((usable(recording),), frozenset(align))
    return refined(problem, initial_frames(problem, model))


def gap_on(model: Model, recording: Recording) -> Array:
    """Return measured minus predicted position, shape (M, 3) [m]."""
    measured = measured_of(recording)
    return np.asarray(measured.position - model.twin(0).poses(recording, measured.t).position)


def counted(recording: Recording, outliers: list[int]) -> Array:
    """Return the samples to count: no outliers, none outside the joint stream, shape (M,)."""
    t, joints = measured_of(recording).t, recording.joints
    good = (t >= joints.t[0]) & (t <= joints.t[-1])
    good[np.asarray(outliers, dtype=int)] = False
    return np.asarray(good)


def measured_of(recording: Recording) -> Measurements:
    """Return what was measured; raises DataError where nothing was."""
    if recording.measured is None:
        raise DataError(f'the recording {recording.name!r} of a case holds no measurements')
    return recording.measured


DRAWS = 2000
"""Bootstrap samples; fifty of them lie beyond either end of a 95 % interval."""
BINS = 10
"""Bins of confidence in which hits are counted, a tenth wide each."""


class Estimate(NamedTuple):
    """A number, its 95 % interval, and how many ``cases`` it rests on."""

    value: float | None
    low: float | None
    high: float | None
    cases: int

    def __str__(self) -> str:
        if self.value is None:
            return 'none'
        return f'{self.value:.3f} ({self.low:.3f} to {self.high:.3f}; {self.cases})'


def share(hits: Sequence[bool]) -> Estimate:
    n, right = len(hits), sum(map(bool, hits))
    if n == 0:
        return Estimate(None, None, None, 0)
    ends = binomtest(right, n).proportion_ci(0.95, 'wilson')
    return Estimate(right / n, float(ends.low), float(ends.high), n)


def bootstrap(
    values: Sequence[float] | Array, statistic: Callable[..., Array] = np.median
) -> Estimate:
    """Return a statistic of rows (N, k) and an ``axis`` with its percentile bootstrap interval."""
    rows = np.asarray(values, dtype=float)
    n = rows.shape[0]
    if n == 0:
        return Estimate(None, None, None, 0)
    picks = np.random.default_rng(0).integers(0, n, (DRAWS, n))
    low, high = np.quantile(statistic(rows[picks], axis=1), [0.025, 0.975])
    return Estimate(float(statistic(rows, axis=0)), float(low), float(high), n)


def brier(confidence: Sequence[float], right: Sequence[bool]) -> Estimate:
    squares = (np.asarray(confidence, dtype=float) - np.asarray(right, dtype=float)) ** 2
    return bootstrap(squares, np.mean)


def calibration_error(confidence: Sequence[float], right: Sequence[bool]) -> Estimate:
    pairs = np.array([confidence, right], dtype=float).T
    return bootstrap(pairs, _calibration_error)


def calibration_error_by_chance(confidence: Sequence[float]) -> float:
    """Return the calibration error that confidences have on average where each is exactly right."""
    sure = np.asarray(confidence, dtype=float)
    right = np.random.default_rng(0).random((DRAWS, sure.size)) < sure
    pairs = np.stack([np.broadcast_to(sure, right.shape), right], axis=-1)
    return float(_calibration_error(pairs, axis=1).mean())


def _calibration_error(pairs: Array, axis: int) -> Array:
    """Return the error of every resample; pairs (..., N, 2), ``axis`` that of the cases."""
    sure, true = pairs[..., 0], pairs[..., 1]
    cases = axis if axis < 0 else axis - sure.ndim
    place = np.minimum((sure * BINS).astype(int), BINS - 1)
    off = [np.abs(((true - sure) * (place == k)).sum(axis=cases)) for k in range(BINS)]
    return np.asarray(sum(off) / sure.shape[cases])


NUMBERS = frozenset({'ece', 'seconds', 'fia', 'fia_shared'})
"""Measures that are numbers; the others are shares of cases."""
HEADS = ('measure', 'value', '95 % interval', 'cases', 'goal', 'reached')
REACHED = {None: '', True: 'yes', False: 'no'}


@dataclass(frozen=True)
class Measure:
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
        return {**asdict(self), 'estimate': self.estimate._asdict(), 'reached': self.reached}


def measure_table(measures: Sequence[Mapping[str, Any]]) -> str:
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


CONFIDENT = 0.8
"""Probability above which what says no more of itself counts as sure: older answers, other methods."""
IN_LIBRARY = frozenset({'single', 'double', 'triple', 'ambiguous'})
NOT_IN_LIBRARY = frozenset({'outside', 'withheld'})
NAMED = {'station_step': 'instrument_knock'}
"""What the twin calls a cause that the plant calls otherwise."""


@dataclass(frozen=True)
class Judged:
    name: str
    kind: str
    robot: str
    motion: str
    """Of the case."""
    truth: str
    said: str
    """Both in words."""
    status: str
    """Of the verdict, or 'error'."""
    confidence: float
    sure: bool
    stratum: float
    """Effect RMS over noise, of the weakest cause."""
    named: bool
    """Whether every cause at work is in a set of its own."""
    right: bool
    """What the confidence is about: the set is exact, or nothing was to be found and nothing was
    said, or the library lacks the cause and the verdict is 'unknown'."""

    @property
    def confidently_wrong(self) -> bool:
        """Return whether it names what is wrong, or denies what is there, and is sure of it."""
        return self.sure and not self.right and self.status != 'unknown'

    def as_dict(self) -> dict[str, Any]:
        return {**asdict(self), 'confidently_wrong': self.confidently_wrong}


def judge(truth: Mapping[str, Any], diagnosis: Mapping[str, Any] | None) -> Judged:
    verdict = diagnosis['verdict'] if diagnosis else {}
    status = str(verdict.get('status', 'error'))
    groups = [
        {(item['effect'], item['joint']) for item in group}
        for group in verdict.get('indistinguishable', ())
    ]
    answers = answers_of(truth)
    answer = min(
        answers,
        key=lambda at: (-_matched(at, groups) / max(len(at), 1), abs(len(groups) - len(at))),
    )
    whole = _matched(answer, groups) == len(answer)
    kind = str(truth['kind'])
    exact = whole and len(groups) == len(answer)
    return Judged(
        truth['name'],
        kind,
        truth['robot'],
        truth['motion'],
        in_words(truth['sites']) or 'nothing',
        ' + '.join(in_words(sorted(group, key=str), ' or ') for group in groups),
        status,
        float(verdict.get('confidence') or 0.0),
        is_sure(verdict),
        float(min(truth['ratios'], default=0.0)),
        whole and bool(answer) and status != 'error',
        _right(kind, status, exact),
    )


def is_sure(verdict: Mapping[str, Any]) -> bool:
    """
    Return whether an answer is reported as sure.

    verdict: as diagnosis.json has it; the first schema tells only a confidence, and 0.8 at the
    most of what is not sure.
    """
    sure = verdict.get('sure')
    return float(verdict.get('confidence') or 0.0) > CONFIDENT if sure is None else bool(sure)


def _matched(answer: Sequence[Site], groups: Sequence[set[Site]]) -> int:
    """Return how many causes have a set of their own that holds them."""
    if not answer or not groups:
        return 0
    contained = np.array([[at in group for group in groups] for at in answer], dtype=float)
    return int(contained[linear_sum_assignment(-contained)].sum())


def _right(kind: str, status: str, exact: bool) -> bool:
    if kind == 'none':
        return status == 'none'
    if kind in NOT_IN_LIBRARY:
        # What gave way at an instant may be dated, and is then named; so may be what no motion
        # tells from the cause, in a set with it.
        return status == 'unknown' or (exact and status in NAMING)
    return exact and status in NAMING


def answers_of(truth: Mapping[str, Any]) -> list[list[Site]]:
    """Return every list of sites that is as right as a truth, by the library's names."""
    answers = (truth['sites'], *truth['alike'])
    return [[(NAMED.get(str(e), str(e)), joint) for e, joint in answer] for answer in answers]


def in_words(sites: Iterable[Sequence[Any]], between: str = ' + ') -> str:
    return between.join(' of '.join(filter(None, at)) for at in sites)


MIB = 1 << 20
"""Bytes."""
KINDS = {
    'single': 'one cause',
    'double': 'two causes',
    'triple': 'three causes',
    'ambiguous': 'ambiguous by construction',
    'none': 'no cause',
    'outside': 'cause outside the library',
    'withheld': 'family withheld',
}
"""Kinds of cases in words."""


def _right_of(kind: str, words: str) -> Question:
    return Question(kind, f'{words}: right', lambda case: case.kind == kind, attrgetter('right'))


QUESTIONS = (
    *(_right_of(kind, words) for kind, words in KINDS.items()),
    Question(
        'confident_wrong',
        'sure and wrong',
        lambda case: True,
        attrgetter('confidently_wrong'),
        0.01,
        False,
    ),
)
"""What verdicts are measured by."""


def score(cases: Path, truths: Path, results: Path, *, seal_given: str = '') -> dict[str, Any]:
    """
    Return the score of verdicts in plain values.

    seal_given: the seal as printed before the diagnosis; left out, the one stored holds.

    Raises DataError: a case or truth was changed, or the verdicts are on other cases.
    """
    opened = seal.opened(cases, truths, seal_given)
    about = seal.read(results / seal.VERDICTS)
    if about['seal'] != seal.read(cases / seal.CASES)['seal']:
        raise DataError(f"the verdicts in '{results}' are on other cases than those in '{cases}'")
    verdicts = {verdict['name']: verdict for verdict in about.pop('verdicts')}
    judged = []
    for truth in opened:
        name = truth['name']
        file = results / name / seal.DIAGNOSIS
        judged.append(judge(truth, None if verdicts[name]['error'] else read_diagnosis(file)))
    seed = seal.read(truths / seal.TRUTHS)['seed']
    return {
        'made': {**about, 'seed': seed},
        'count': len(judged),
        'measures': [measure.as_dict() for measure in measures(judged)],
        'costs': _costs(list(verdicts.values())),
        'errors': {name: v['error'] for name, v in verdicts.items() if v['error']},
        'cases': [case.as_dict() for case in judged],
    }


def measures(cases: Sequence[Judged]) -> list[Measure]:
    answered = [case for case in cases if case.status != 'error']
    error = calibration_error([c.confidence for c in answered], [c.right for c in answered])
    return [
        *measured(QUESTIONS, cases),
        Measure('ece', 'expected calibration error', error, 0.03, False),
    ]


def _costs(verdicts: list[dict[str, Any]]) -> dict[str, float]:
    seconds = [verdict['seconds'] for verdict in verdicts]
    memory = [verdict['memory_bytes'] / MIB for verdict in verdicts]
    return {
        'median_seconds': float(np.median(seconds)),
        'most_seconds': float(np.max(seconds)),
        'median_memory_mib': float(np.median(memory)),
        'most_memory_mib': float(np.max(memory)),
    }


def page(score: Mapping[str, Any]) -> str:
    made, costs, count = score['made'], score['costs'], score['count']
    seen = 'could be read' if made['truths_readable'] else 'could not be read'
    missed = [case for case in score['cases'] if not case['right']]
    columns: dict[str, Callable[[Mapping[str, Any]], str]] = {
        'case': lambda case: case['name'],
        'kind': lambda case: f'{case["kind"]}, {case["robot"]}, {case["motion"]}',
        'truth (RMS over noise)': lambda case: f'{case["truth"]} ({case["stratum"]:.1f})',
        'verdict': lambda case: f'{case["status"]}: {case["said"] or "-"}',
        'confidence': lambda case: f'{case["confidence"]:.2f}',
        'why there is none': lambda case: score['errors'].get(case['name'], ''),
    }
    return '\n'.join(
        [
            f'# {count - len(missed)} of {count} cases answered rightly\n',
            f'Seed {made["seed"]}, seal {made["seal"]}, engine {made["engine"][:16]} of version '
            f'{made["version"]}. Truths {seen} from where the cases were diagnosed.\n',
            measure_table(score['measures']),
            f'A diagnosis took {costs["median_seconds"]:.1f} s in the median, '
            f'{costs["most_seconds"]:.1f} s at most, and {costs["most_memory_mib"]:.0f} MiB.\n',
            *([tabled(columns, missed)] if missed else []),
        ]
    )
