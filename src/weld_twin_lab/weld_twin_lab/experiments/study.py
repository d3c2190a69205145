# Copyright 2026 weld_twin contributors
# SPDX-License-Identifier: Apache-2.0
"""Sealed cells, investigated several at a time, each kept as soon as it is done."""

from __future__ import annotations

import json
import time
from collections import Counter
from collections.abc import Callable, Iterator, Mapping, Sequence
from contextlib import suppress
from dataclasses import replace
from functools import cached_property
from pathlib import Path
from typing import Any, NamedTuple

import numpy as np
from numpy.typing import NDArray
from scipy.interpolate import CubicSpline
from scipy.spatial.transform import Rotation

from weld_twin_core.arm.robot import Robot
from weld_twin_core.arm.rotation import transform
from weld_twin_core.arrays import Array
from weld_twin_core.diagnosis import diagnose
from weld_twin_core.diagnosis.advice import Limits
from weld_twin_core.diagnosis.advice.candidates import LONGER
from weld_twin_core.effects import effects_from_list
from weld_twin_core.effects.effect import Effect
from weld_twin_core.errors import DataError, TwinError
from weld_twin_core.recording import Recording
from weld_twin_msgs_py.files import markdown
from weld_twin_nodes.offline.investigation import (
    SAID,
    STATED,
    decided,
    question,
    short,
    signs,
    weighed,
)
from weld_twin_nodes.offline.set_up_changes import FRAMES, SetUpChange, set_up_change, with_changes
from weld_twin_nodes.offline.task_pool import Runner, Task
from weld_twin_report.report.diagnosis_files import diagnosis_text

from ..belief.learning import Weights, fitted
from ..blind.blind_cell import RATE, WAYS, Motion, as_recording, of_motion, record
from ..blind.making import Lot, SealedCase, draw_case, lots, one_arm
from ..blind.scoring import Judged, in_words, judge
from ..blind.seal import text_digest
from ..gate.mistakes import seen_from
from ..study import Study, engine_digest, head, require_simulator, tabled

ROUNDS = 3
"""Experiments at most."""
MINUTES = 5.0
"""Of robot motion at most, all experiments together."""
VISIT = 60.0
"""Minutes at most, all experiments together, with what has to be set up for them."""
Content = Mapping[str, Any]
"""The content of a diagnosis.json."""
LEAST = 0.25
"""Minutes that an experiment is planned with where hardly any are left."""
ASKED = (
    *('kind', 'minutes', 'robot_minutes', 'stations'),
    *('expected_sigma', 'between', 'promise', 'changes'),
)
"""What is kept of every experiment."""


def said(cell: SealedCell, diagnosis: Mapping[str, Any], why: str) -> dict[str, Any]:
    """Return a diagnosis in short, judged by the truth; why it closes the question, if it does."""
    judged = cell.judged(diagnosis)
    return {
        'status': judged.status,
        'confidence': judged.confidence,
        'said': judged.said,
        'right': judged.right,
        'sure': bool(why),
    }


def answered(
    cell: SealedCell, first: Recording, later: Sequence[Recording], limits: Limits
) -> tuple[Content, str, dict[str, Any]]:
    """
    Return the answer from the first recording and later ones, why it closes the question, and how.

    How: what the two diagnoses were weighed by, and their worth; empty where there was one.
    limits: what the next experiment may take.
    """
    by_itself = not later or cell.seen_anew(later)
    asked = replace(limits, confirm=by_itself)
    together = cell.diagnosed([first, *later], limits=asked)
    if by_itself:
        return *weighed(together), {}
    # Too few stations cannot be diagnosed by themselves.
    with suppress(TwinError):
        alone = cell.diagnosed(list(later), limits=limits)
        pairs = {'together': (together, alone), 'alone': (alone, together)}
        heard = {name: _weight(cell, *pair) for name, pair in pairs.items()}
        return *weighed(together, alone), heard
    return *weighed(together), {}


def _weight(cell: SealedCell, diagnosis: Content, other: Content) -> dict[str, Any]:
    return {
        'signs': signs(diagnosis, other),
        'stated': diagnosis['verdict']['status'] in STATED,
        'right': cell.judged(diagnosis).right,
    }


def _limits(minutes: float, visit: float = VISIT) -> Limits:
    return Limits(minutes=max(visit, LEAST), moving=max(minutes, LEAST))


def poor_at_first(cell: SealedCell) -> tuple[dict[str, Any], dict[str, Any]] | None:
    """Return the first diagnosis and what it is worth; None where it is right or finds a mistake."""
    diagnosis, why, _ = answered(cell, cell.first, [], _limits(MINUTES))
    first = said(cell, diagnosis, why)
    wrong = first['status'] in ('ambiguous', 'unknown') or not first['right']
    # What cannot be told apart by any motion is no question for an experiment; nor is one that only
    # confirms what is right already.
    confirms = bool((diagnosis['next_experiment'] or {}).get('confirms'))
    closed = first['right'] and (first['sure'] or confirms)
    return (dict(diagnosis), first) if wrong and not closed else None


def looped(
    cell: SealedCell, diagnosis: Mapping[str, Any], first: Mapping[str, Any]
) -> dict[str, Any]:
    rounds, end, answer = _looped(cell, cell.first, diagnosis, dict(first))
    return {
        'name': cell.name,
        'seal': cell.seal,
        'poor': cell.poor,
        'still': cell.still,
        'truth': {**cell.opened(), 'causes': None},
        'first': dict(first),
        'rounds': rounds,
        'end': end,
        'minutes': sum(step['robot_minutes'] for step in rounds),
        'loop': answer,
    }


def _looped(
    cell: SealedCell, start: Recording, diagnosis: Mapping[str, Any], answer: dict[str, Any]
) -> tuple[list[dict[str, Any]], str, dict[str, Any]]:
    """Return the rounds of the loop, the word that it ended with, and its last answer."""
    later: list[Recording] = []
    rounds: list[dict[str, Any]] = []
    remaining, visit, why = MINUTES, VISIT, None
    while True:
        asked = question(diagnosis, visit, [step['kind'] for step in rounds], why)
        if not isinstance(asked, dict):
            # What the visit would allow, the minutes of motion may not.
            spent = asked[0] == 'nothing would part them' and not why and short(remaining)
            return rounds, 'minutes spent' if spent else asked[0], answer
        if len(rounds) == ROUNDS or asked['robot_minutes'] > remaining:
            return rounds, 'rounds spent' if len(rounds) == ROUNDS else 'minutes spent', answer
        name = f'experiment {len(rounds) + 1}'
        motion = as_motion(asked['motion'], cell.robot)
        later.append(cell.made(name, motion, 100 + len(rounds), asked['changes']))
        remaining, visit = remaining - asked['robot_minutes'], visit - asked['minutes']
        begun = time.perf_counter()
        try:
            diagnosis, why, heard = answered(cell, start, later, _limits(remaining, visit))
        except TwinError as error:
            return rounds, f'refused: {error}', answer
        answer = said(cell, diagnosis, why)
        rounds.append(
            {
                **{key: asked[key] for key in ASKED},
                'decided': decided(asked, diagnosis),
                'seconds': time.perf_counter() - begun,
                'found': answer,
                'heard': heard,
            }
        )


FOLLOWING, STATES = 30.0, 62.5
"""Rates [Hz] of an instrument that follows the tool in an experiment, and of the joint states beside it.
Twice as many say hardly more, for neighbours err alike, and a diagnosis then takes longer."""
SECONDS = (12.0, 25.0)
"""Shortest and longest first recording [s], where the arm moves: what is poor stays poor."""
ELSEWHERE = transform(
    Rotation.from_rotvec([0.05, -0.03, 0.7]).as_matrix(), np.array([1.2, -0.9, 0.1])
)
"""The frame of before in that of an instrument at another place, turned another way."""


class SealedCell:
    """One cell with causes at work that only `opened` tells; seed and number decide what is random."""

    def __init__(self, lot: Lot, seed: int, number: int) -> None:
        rng = np.random.default_rng([seed, number])
        self.name = f'{seed}-{number:04d}'
        # Few stations are poor; of a path there is no few.
        self.poor = str(rng.choice([w for w in WAYS if w != 'few' or lot.motion == 'stations']))
        self._case: SealedCase = one_arm(draw_case(lot, rng, SECONDS, poor=self.poor))
        self._changed: dict[str, SetUpChange] = {}
        self._salt = int(rng.integers(2**62))
        self.robot: Robot = self._case.cell.robot
        self.still = self._case.lot.motion == 'stations'

    @property
    def seal(self) -> str:
        """Return the hash of the truth and a salt."""
        return text_digest(json.dumps([self._salt, self._case.causes], default=float))

    @cached_property
    def _known(self) -> tuple[Effect, ...]:
        return tuple(effects_from_list(list(self._case.cell.known), self.robot))

    @cached_property
    def first(self) -> Recording:
        """The poor recording that everything begins with."""
        return as_recording('first', record(self._case.cell, self._case.causes, self._case.train))

    def made(self, name: str, motion: Motion, seed: int, changed: str = '') -> Recording:
        """Return the recording of a motion, with a change in the cell as `set_up_change` reads it."""
        rng = np.random.default_rng([seed, *name.encode()])
        cell = self._case.cell
        if not motion.static:
            # The same where an instrument that follows had to be set up first.
            slower = replace(cell.tracker, rate=FOLLOWING, joint_rate=STATES)
            cell = replace(cell, tracker=slower)
        if changed:
            self._changed[name] = set_up_change(changed)
            cell = replace(cell, robot=_changed(cell.robot, self._changed[name]))
        taken = of_motion(cell, motion, rng)
        made = as_recording(name, record(cell, self._case.causes, taken))
        return seen_from(made, ELSEWHERE) if changed == 'instrument' else made

    def seen_anew(self, recordings: Sequence[Recording]) -> bool:
        """Return whether tool or instrument was changed for one of the recordings."""
        return any(
            r.name in self._changed and self._changed[r.name].kind in FRAMES for r in recordings
        )

    def diagnosed(self, recordings: list[Recording], **options: Any) -> dict[str, Any]:
        """Return the content of diagnosis.json; it is told what was changed for which recording."""
        names = [recording.name for recording in recordings]
        changes = {names.index(name): c for name, c in self._changed.items() if name in names}
        recordings, may_change = with_changes(recordings, changes, self.robot)
        diagnosis = diagnose(
            recordings,
            self.robot,
            align=self._case.cell.align,
            known=self._known,
            may_change=may_change,
            **options,
        )
        return dict(json.loads(diagnosis_text(diagnosis, ())))

    def opened(self) -> dict[str, Any]:
        return self._case.told(self.name)

    def judged(self, diagnosis: Mapping[str, Any]) -> Judged:
        return judge(self.opened(), diagnosis)


def _changed(robot: Robot, change: SetUpChange) -> Robot:
    """Return the arm with another load, or with a longer tool."""
    if change.kind == 'load':
        return replace(robot, payload_mass=robot.payload_mass + change.numbers[0])
    if change.kind == 'tool':
        longer = transform(np.eye(3), np.array([0.0, 0.0, LONGER]))
        return robot.with_frames(tool=robot.T_flange_tool @ longer)
    return robot


def as_motion(asked: Mapping[str, Any], robot: Robot) -> Motion:
    """Return a motion of an experiment as the controller runs it; raises DataError for other joints."""
    if list(asked['joint_names']) != list(robot.joint_names):
        raise DataError(f'the experiment is not for {robot.name}')
    t, q = np.array(asked['t'], dtype=float), np.array(asked['q'], dtype=float)
    if asked['static']:
        return Motion(t - t[0], q, static=True)
    even = np.arange(0.0, t[-1] - t[0], 1.0 / RATE)
    return Motion(even, np.asarray(CubicSpline(t - t[0], q)(even)))


SIGNS = ('own', 'same', 'against')
"""Log odds of the answer, and those of the other diagnosis that speak for it, or against it."""
COUNTS = np.array([1.0, 1.0, -1.0])
"""Which way each may change belief."""
RIDGE = 1.0
"""Towards the log odds of the answer alone, in log loss: as much as one answer."""
FOLDS = 10
"""Parts of the cells of which each is judged by weights learned from the others."""
TRIED = (0.9, 0.93, 0.95, 0.98)
"""Beliefs from which a question could be closed."""


class Heard(NamedTuple):
    """Every answer that was heard in the rounds of many cells."""

    signs: NDArray[Any]
    """Shape (N, 3)."""
    right: NDArray[Any]
    """Shape (N,)."""
    cell: NDArray[Any]
    turn: NDArray[Any]
    """Which cell, and which of its rounds, shape (N,)."""

    def only(self, rows: NDArray[Any]) -> Heard:
        return Heard(*(column[rows] for column in self))


def heard(cases: Sequence[Mapping[str, Any]]) -> Heard:
    """Return the answers that say what the causes are, of cells as in investigate.json."""
    rows = [
        (answer['signs'], answer['right'], k, turn)
        for k, case in enumerate(cases)
        for turn, step in enumerate(case['rounds'])
        for answer in (step.get('heard') or {}).values()
        if answer['stated']
    ]
    columns = zip(*rows, strict=True) if rows else ([], [], [], [])
    signs, right, cell, turn = (np.array(column) for column in columns)
    return Heard(signs.reshape(-1, len(SIGNS)), right.astype(bool), cell, turn)


def weights(taught: Heard) -> Weights:
    ones = np.ones(len(taught.right))
    prior = np.array([1.0, 0.0, 0.0])
    return fitted(taught.signs, taught.right, COUNTS, RIDGE, ones, prior)


def unseen(all_: Heard) -> Array:
    """Return the belief in each answer by weights learned from other cells, shape (N,)."""
    out = np.zeros(len(all_.right))
    for fold in range(FOLDS):
        here = all_.cell % FOLDS == fold
        bias, slopes = weights(all_.only(~here))
        out[here] = 1.0 / (1.0 + np.exp(-(bias + all_.signs[here] @ slopes)))
    return out


def reached(all_: Heard, probability: Array, least: float) -> tuple[int, int]:
    """Return in how many cells the first answer believed by so much is right, and in how many wrong."""
    counts = [0, 0]
    for cell in np.unique(all_.cell):
        own = np.flatnonzero((all_.cell == cell) & (probability >= least))
        if own.size:
            first = own[all_.turn[own] == all_.turn[own].min()]
            counts[0 if all_.right[first[np.argmax(probability[first])]] else 1] += 1
    return counts[0], counts[1]


def closing_page(cases: Sequence[Mapping[str, Any]]) -> str:
    """Return what was learned, and its worth on other cells; raises DataError without two diagnoses."""
    all_ = heard(cases)
    if not len(all_.right):
        raise DataError('none of the cells has two diagnoses of the same round; give other tables')
    fit, probability = weights(all_), unseen(all_)
    learned = zip((*SIGNS, 'added'), (*fit.slopes, fit.bias), strict=True)
    rows = [(f'{least:.2f}', *map(str, reached(all_, probability, least))) for least in TRIED]
    parts = (
        f'{len(all_.right)} answers of {len(np.unique(all_.cell))} cells',
        markdown.table(('sign', 'counts'), *((name, f'{v:.2f}') for name, v in learned)),
        markdown.table(('believed from', 'right', 'wrong'), *rows),
    )
    return '\n\n'.join(parts) + '\n'


Case = dict[str, Any]


def summary(cases: Sequence[Case]) -> dict[str, Any]:
    if not cases:
        return {'cells': 0}
    ends = [case['loop'] for case in cases]
    minutes = [case['minutes'] for case in cases if case['loop']['right'] and case['loop']['sure']]
    rounds = [step for case in cases for step in case['rounds']]
    # How often experiments decided, beside what they had said.
    judged = [step for step in rounds if step['decided'] is not None]
    promised = [step for step in judged if (step['promise'] or 0.0) >= SAID]
    return {
        'cells': len(cases),
        'first': dict(sorted(Counter(str(c['first']['status']) for c in cases).items())),
        'right_and_sure': len(minutes),
        'right': sum(bool(end['right']) for end in ends),
        'sure_and_wrong': sum(bool(end['sure'] and not end['right']) for end in ends),
        'minutes_to_certainty': float(np.median(minutes)) if minutes else None,
        'experiments': len(rounds),
        'that_compared': len(judged),
        'foreseen': sum(step['promise'] or 0.0 for step in judged),
        'decided': sum(bool(step['decided']) for step in judged),
        'said_they_would': len(promised),
        'of_these_decided': sum(bool(step['decided']) for step in promised),
        'seconds': max((step['seconds'] for step in rounds), default=0.0),
    }


def page(result: dict[str, Any]) -> str:
    totals, cases = result['summary'], result['cases']
    if not cases:
        return 'No cell was left open.\n'
    lines = [f'- {key}: {value}' for key, value in totals.items() if not isinstance(value, dict)]
    return '\n'.join([*lines, '', tabled(COLUMNS, cases), ''])


def _in_words(answer: dict[str, Any]) -> str:
    right = 'right' if answer['right'] else 'wrong'
    sure = 'sure' if answer['sure'] else 'open'
    return f'{answer["status"]}, {right}, {sure}'


COLUMNS: dict[str, Callable[[Case], object]] = {
    'cell': lambda case: case['name'],
    'robot': lambda case: case['truth']['robot'],
    'first motion': lambda case: f'{case["truth"]["motion"]}, {case["poor"]}',
    'causes': lambda case: in_words(case['truth']['sites']),
    'first': lambda case: _in_words(case['first']),
    'asked': lambda case: ', '.join(
        f'{s["kind"]} {s["robot_minutes"]:.1f} min' for s in case['rounds']
    ),
    'loop': lambda case: _in_words(case['loop']),
    'ended': lambda case: case['end'],
}
"""Columns of the table of cells."""


KINDS = ('single', 'double', 'triple')
"""Cases with their causes in the library: of the others no experiment can make anybody sure."""
MOST_DRAWN = 40
"""Cells drawn for each that is wanted: most are diagnosed rightly from a poor motion."""
BATCH = 8
"""Cells drawn at a time: a run that has to end in between ends after some, whatever came of them."""


def investigated(
    seed: int, wanted: int, runner: Runner, tell: Callable[[str], None], *, minutes: float
) -> dict[str, Any]:
    """Investigate as many cells as wanted that poor motions leave open, begun within some minutes."""
    end = time.monotonic() + 60.0 * minutes
    drawn: list[dict[str, Any]] = []
    cases: list[dict[str, Any]] = []
    for tasks in _batches(seed, wanted):
        drawn += runner.run(tasks)
        cases = [entry for entry in drawn if entry['open']][:wanted]
        tell(f'{len(drawn)} drawn, {len(cases)} left open at first')
        if len(cases) == wanted or time.monotonic() > end:
            break
    return head(
        'investigate/2',
        engine=engine_digest(),
        seed=seed,
        drawn=drawn.index(cases[-1]) + 1 if len(cases) == wanted else len(drawn),
        summary=summary(cases),
        cases=cases,
    )


def _batches(seed: int, wanted: int) -> Iterator[list[Task]]:
    most = MOST_DRAWN * wanted
    for begin in range(0, most, BATCH):
        numbers = range(begin, min(begin + BATCH, most))
        yield [Task(investigated_cell, (seed, k), f'cell {k}') for k in numbers]


def investigated_cell(seed: int, number: int) -> dict[str, Any]:
    """Return what came of one cell, in plain values; the simulator is loaded where it is needed."""
    require_simulator()

    begun = time.process_time()
    try:
        cell = SealedCell(lots(seed, number + 1, KINDS)[number], seed, number)
    except TwinError as error:
        return {'open': False, 'why': str(error)}
    made = time.process_time()
    first = poor_at_first(cell)
    spent = {'making': made - begun, 'first': time.process_time() - made}
    if first is None:
        return {'open': False, 'why': 'right from the first', 'spent': spent}
    entry = looped(cell, *first)
    spent['loop'] = time.process_time() - begun - sum(spent.values())
    return {'open': True, **entry, 'spent': spent}


def run(study: Study) -> None:
    args = study.args
    if args.learn_from:
        study.write('closing', page=closing_page(_kept(args.learn_from)))
        return
    with study.runner('investigating') as runner:
        result = investigated(args.seed, args.cells, runner, study.tell, minutes=args.minutes)
    study.write('investigate', result, page(result))


def _kept(tables: Sequence[str]) -> list[Case]:
    out: list[Case] = []
    for table in tables:
        try:
            out += json.loads(Path(table).read_text(encoding='utf-8'))['cases']
        except (OSError, ValueError, KeyError, TypeError) as error:
            raise DataError(f"'{table}' is no table of investigated cells: {error}") from None
    return out
