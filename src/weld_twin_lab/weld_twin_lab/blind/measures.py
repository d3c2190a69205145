# Copyright 2026 weld_twin contributors
# SPDX-License-Identifier: Apache-2.0
"""What is measured over many judged cases, with goals; displacements of the tool, shape (M, 3) [m]."""

from __future__ import annotations

from collections.abc import Callable, Collection, Mapping, Sequence
from dataclasses import asdict, dataclass
from typing import Any, NamedTuple

import numpy as np
from scipy.stats import binomtest

from weld_twin_core.arm.robot import Robot
from weld_twin_core.arrays import Array
from weld_twin_core.diagnosis.algebra.problem import Model, Problem, usable
from weld_twin_core.diagnosis.frames.alignment import initial_frames, refined
from weld_twin_core.effects.effect import Effect
from weld_twin_core.errors import DataError
from weld_twin_core.recording import Measurements, Recording
from weld_twin_msgs_py.files import markdown


def rigid(points: Array, off: Array) -> Array:
    """Return the part of a displacement (M, 3) that a moved base explains."""
    centred = points - points.mean(axis=0)
    turn = [np.cross(axis, centred) for axis in np.eye(3)]
    columns = [column.ravel() for column in turn]
    columns += [np.tile(axis, len(points)) for axis in np.eye(3)]
    design = np.stack(columns, axis=1)
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
        """Return it in words."""
        if self.value is None:
            return 'none'
        return f'{self.value:.3f} ({self.low:.3f} to {self.high:.3f}; {self.cases})'


def share(hits: Sequence[bool]) -> Estimate:
    """Return a share with its Wilson score interval."""
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
    """Return the Brier score, the mean squared error of the confidence."""
    squares = (np.asarray(confidence, dtype=float) - np.asarray(right, dtype=float)) ** 2
    return bootstrap(squares, np.mean)


def calibration_error(confidence: Sequence[float], right: Sequence[bool]) -> Estimate:
    """Return the expected calibration error over ten bins of equal width."""
    pairs = np.array([confidence, right], dtype=float).T
    return bootstrap(pairs, _calibration_error)


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
        return {**asdict(self), 'estimate': self.estimate._asdict(), 'reached': self.reached}


def measure_table(measures: Sequence[Mapping[str, Any]]) -> str:
    """Return measures, as `Measure.as_dict` gives them, beside their goals in Markdown."""
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
