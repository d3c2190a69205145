# Copyright 2026 weld_twin contributors
# SPDX-License-Identifier: Apache-2.0
"""
A case as plain files, and an answer to it: all that a method sees, and all that it gives.

A directory of a case holds ``robot.yaml`` (DH rows in m and rad), ``case.json`` and tables with a
header line: ``train_joints.csv``, ``train_measured.csv``, ``ask_joints.csv`` and ``ask_times.csv``,
and ``train_wrench.csv`` or ``train_temperature.csv`` (with ``ask_...``) where there are any. An
answer is ``answer.json`` and ``predicted.csv``.
"""

from __future__ import annotations

import json
from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from pathlib import Path
from typing import Any

import numpy as np

from weld_twin_core.arm.robot import Robot
from weld_twin_core.arm.rotation import matrix_from_quaternion, quaternion_from_matrix
from weld_twin_core.arrays import Array
from weld_twin_core.errors import DataError
from weld_twin_core.recording import JointMotion, Measurements, Recording, Signal
from weld_twin_msgs_py.files.whole_files import write_json
from weld_twin_msgs_py.robots import load_robot

from ..blind.displacement import measured_of

ANSWER, PREDICTED = 'answer.json', 'predicted.csv'
_CASE, _ROBOT, _KNOWN = 'case.json', 'robot.yaml', 'known.yaml'
_SLACK = 1e-6
"""By how much probabilities may exceed one in sum: rounding of printed numbers."""


Name = tuple[str, str | None, float]
"""Effect, joint, probability."""
Cause = tuple[Name, ...]
"""Names of which one is meant, and nothing more is known."""


@dataclass(frozen=True)
class ContestCase:
    """What a method may know."""

    robot: Robot
    """As its maker describes it."""
    train: Recording
    """What was commanded and measured."""
    ask: Recording
    """What was commanded on another occasion; nothing of what was measured then."""
    times: Array
    """When the tool's position is asked for, shape (M,) [s]."""
    align: tuple[str, ...]
    """Frames that nobody measured: 'base', 'tool'."""
    exclude: tuple[str, ...]
    """Families of effects that are known not to be at work."""
    folder: Path
    """Where the case lies."""

    @property
    def measured(self) -> Measurements:
        return measured_of(self.train)

    @property
    def known(self) -> Path | None:
        """Return the file of effects that are known, if there are any."""
        file = self.folder / _KNOWN
        return file if file.exists() else None


@dataclass(frozen=True)
class ContestAnswer:
    """What a method says."""

    predicted: Array
    """Where the tool was at the times asked for, shape (M, 3) [m]."""
    causes: tuple[Cause, ...] = ()
    """What is at work; each is told as names that may stand for it: effect, joint, and how likely
    it is that one."""
    unknown: float = 0.0
    none: float = 0.0
    """How likely something unnamed is at work, and nothing at all."""
    sure: tuple[bool, ...] | None = None
    """Whether each cause is told as sure, then whether the whole is; left out, what is likelier
    than `blind.judging.CONFIDENT` counts as sure."""
    sigma: Array | None = None
    """Standard deviation of what will be measured of each coordinate, noise included, shape (M, 3)
    [m]."""


def write_case(
    folder: Path, robot: Path, recordings: tuple[Recording, Recording], said: Mapping[str, Any]
) -> None:
    """
    Write a case into a new folder, by recordings to learn from and to be asked about.

    said: ``align`` and ``exclude``; ``known``, the text of a file of effects, or empty.
    """
    folder.mkdir(parents=True)
    (folder / _ROBOT).write_text(robot.read_text(encoding='utf-8'), encoding='utf-8')
    if said['known']:
        (folder / _KNOWN).write_text(said['known'], encoding='utf-8')
    train, ask = recordings
    content = {
        'align': said['align'],
        'exclude': said['exclude'],
        'stations': train.joints.static,
        'wrench_frame': train.wrench_frame,
    }
    write_json(folder / _CASE, content)
    for use, recording in (('train', train), ('ask', ask)):
        _write_inputs(folder, use, recording)
    measured, asked = measured_of(train), measured_of(ask)
    columns, names = [measured.t, measured.position], ['t', 'x', 'y', 'z']
    if measured.rotation is not None:
        columns.append(quaternion_from_matrix(measured.rotation))
        names += ['qx', 'qy', 'qz', 'qw']
    _write(folder / 'train_measured.csv', names, columns)
    _write(folder / 'ask_times.csv', ['t'], [asked.t])


def _write_inputs(folder: Path, use: str, recording: Recording) -> None:
    motion = recording.joints
    columns, names = (
        [motion.t, motion.q],
        ['t', *(f'q{k}' for k in range(1, motion.q.shape[1] + 1))],
    )
    if motion.qd is not None:
        columns.append(motion.qd)
        names += [f'qd{k}' for k in range(1, motion.q.shape[1] + 1)]
    _write(folder / f'{use}_joints.csv', names, columns)
    if recording.wrench is not None:
        names = ['t', 'fx', 'fy', 'fz', 'mx', 'my', 'mz']
        signal = recording.wrench
        _write(folder / f'{use}_wrench.csv', names, [signal.t, signal.value])
    if recording.temperature is not None:
        signal = recording.temperature
        _write(folder / f'{use}_temperature.csv', ['t', 'celsius'], [signal.t, signal.value])


def _write(path: Path, names: Sequence[str], columns: Sequence[Array]) -> None:
    head = ','.join(names)
    np.savetxt(path, np.column_stack(columns), '%.17g', ',', header=head, comments='')


def read_case(folder: Path) -> ContestCase:
    """Return a case; raises DataError where a file is missing or no table."""
    try:
        said = json.loads((folder / _CASE).read_text(encoding='utf-8'))
        measured = _read(folder / 'train_measured.csv')
        times = _read(folder / 'ask_times.csv')[:, 0]
        train, ask = (_read_inputs(folder, use, said) for use in ('train', 'ask'))
    except (OSError, ValueError, KeyError) as error:
        raise DataError(f"'{folder}' is no case of a contest: {error}") from None
    rotation = None
    if measured.shape[1] > 4:
        rotation = matrix_from_quaternion(measured[:, 4:], 'measured orientation')
    seen = train.with_measured(Measurements(measured[:, 0], measured[:, 1:4], rotation))
    robot = load_robot(str(folder / _ROBOT))
    return ContestCase(
        robot, seen, ask, times, tuple(said['align']), tuple(said['exclude']), folder
    )


def _read(path: Path) -> Array:
    return np.loadtxt(path, delimiter=',', skiprows=1, ndmin=2)


def _read_inputs(folder: Path, use: str, said: Mapping[str, Any]) -> Recording:
    names = (folder / f'{use}_joints.csv').open(encoding='utf-8').readline().strip().split(',')
    table = _read(folder / f'{use}_joints.csv')
    n = sum(name[1:].isdigit() for name in names)
    qd = table[:, n + 1 :] if table.shape[1] > n + 1 else None
    motion = JointMotion(table[:, 0], table[:, 1 : n + 1], qd, static=bool(said['stations']))
    wrench = _read_signal(folder / f'{use}_wrench.csv', motion.static)
    temperature = _read_signal(folder / f'{use}_temperature.csv', motion.static)
    return Recording(use, motion, None, wrench, str(said['wrench_frame']), temperature)


def _read_signal(path: Path, static: bool) -> Signal | None:
    if not path.exists():
        return None
    table = _read(path)
    value = table[:, 1:] if table.shape[1] > 2 else table[:, 1]
    return Signal(table[:, 0], value, held=not static)


def write_answer(folder: Path, answer: ContestAnswer) -> None:
    folder.mkdir(parents=True, exist_ok=True)
    content = {
        'causes': [
            [{'effect': effect, 'joint': joint, 'probability': p} for effect, joint, p in cause]
            for cause in answer.causes
        ],
        'unknown': answer.unknown,
        'none': answer.none,
    }
    write_json(folder / ANSWER, content, overwrite=True)
    parts = [answer.predicted, *([] if answer.sigma is None else [answer.sigma])]
    _write(folder / PREDICTED, ['x', 'y', 'z', 'sx', 'sy', 'sz'][: 3 * len(parts)], parts)


def read_answer(folder: Path, count: int) -> ContestAnswer:
    """Return an answer to so many questions; raises DataError where it is missing or out of form."""
    try:
        said = json.loads((folder / ANSWER).read_text(encoding='utf-8'))
        causes = tuple(
            tuple((str(x['effect']), x['joint'], float(x['probability'])) for x in cause)
            for cause in said['causes']
        )
        unknown, none = float(said['unknown']), float(said['none'])
        predicted = _read(folder / PREDICTED)
    except (OSError, ValueError, KeyError, TypeError) as error:
        raise DataError(f"'{folder}' holds no answer: {error}") from None
    likely = [unknown, none, *(p for cause in causes for *_, p in cause)]
    if not all(0.0 <= value <= 1.0 + _SLACK for value in likely):
        raise DataError(f"'{folder / ANSWER}' has a probability that is not between 0 and 1")
    if predicted.shape not in ((count, 3), (count, 6)) or not np.isfinite(predicted).all():
        raise DataError(
            f"'{folder / PREDICTED}' must have {count} rows of three or six finite numbers, it has "
            f'{predicted.shape[0]} of {predicted.shape[1]}'
        )
    sigma = predicted[:, 3:] if predicted.size > 3 * count else None
    if sigma is not None and (sigma <= 0.0).any():
        raise DataError(f"'{folder / PREDICTED}' has a standard deviation that is not positive")
    return ContestAnswer(predicted[:, :3], causes, unknown, none, sigma=sigma)
