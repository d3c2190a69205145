# Copyright 2026 weld_twin contributors
# SPDX-License-Identifier: Apache-2.0
"""One sealed cell, investigated."""

from __future__ import annotations

import json
import time
from collections.abc import Mapping, Sequence
from contextlib import suppress
from dataclasses import replace
from functools import cached_property
from typing import Any

import numpy as np
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
from weld_twin_nodes.offline.investigation import STATED, decided, question, short, signs, weighed
from weld_twin_nodes.offline.set_up_changes import FRAMES, SetUpChange, set_up_change, with_changes
from weld_twin_report.report.diagnosis_files import diagnosis_text

from ..blind.blind_cell import WAYS, as_recording, of_motion, record
from ..blind.deck import Lot
from ..blind.making import SealedCase, draw_case, one_arm
from ..blind.recorded_motion import RATE, Motion
from ..blind.scoring import Judged, judge
from ..blind.seal import text_digest
from ..gate.mistakes import seen_from

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
    """Return what came of one cell that was investigated after a first diagnosis."""
    rounds, end, answer = investigated(cell, cell.first, diagnosis, dict(first))
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


def investigated(
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
STAY = 15.0
"""A station with the way to it [s], as experiments are planned."""


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


def stations(q: Array) -> Motion:
    return Motion(STAY * np.arange(len(q), dtype=float), q, static=True)
