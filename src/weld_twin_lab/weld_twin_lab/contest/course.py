# Copyright 2026 weld_twin contributors
# SPDX-License-Identifier: Apache-2.0
"""
Sealed cases put into an open form, and every method run on them, each in its own process.

A directory of a case holds ``robot.yaml`` (DH rows in m and rad), ``case.json`` and tables with a
header line: ``train_joints.csv``, ``train_measured.csv``, ``ask_joints.csv`` and ``ask_times.csv``,
and ``train_wrench.csv`` or ``train_temperature.csv`` (with ``ask_...``) where there are any. An
answer is ``answer.json`` and ``predicted.csv``: all that a method sees, and all that it gives.
"""

from __future__ import annotations

import json
import shlex
import shutil
import sys
from collections.abc import Callable, Mapping, Sequence
from dataclasses import dataclass, replace
from pathlib import Path
from tempfile import TemporaryDirectory
from typing import Any

import numpy as np

from weld_twin_core.arm import catalog
from weld_twin_core.arm.robot import Robot
from weld_twin_core.arm.rotation import matrix_from_quaternion, quaternion_from_matrix
from weld_twin_core.arrays import Array
from weld_twin_core.errors import DataError
from weld_twin_core.recording import JointMotion, Measurements, Recording, Signal
from weld_twin_msgs_py.bags import read_recording
from weld_twin_msgs_py.files.markdown import table
from weld_twin_msgs_py.files.whole_files import read_json, write_json, write_text
from weld_twin_msgs_py.files.yaml_file import yaml_text
from weld_twin_msgs_py.robots import load_robot

from ..benchmark.race import cost_of
from ..blind import seal
from ..blind.scoring import measured_of
from ..real_arms.sources import Split, all_splits
from ..real_arms.unseen import ALIGN, plain_fit
from .entrants import ENTRANTS, entrant

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
    columns, names = [motion.t], ['t']
    for key, values in (('q', motion.q), ('qd', motion.qd)):
        if values is not None:
            columns.append(values)
            names += [f'{key}{k + 1}' for k in range(values.shape[1])]
    _write(folder / f'{use}_joints.csv', names, columns)
    for key, signal, heads in (
        ('wrench', recording.wrench, ('fx', 'fy', 'fz', 'mx', 'my', 'mz')),
        ('temperature', recording.temperature, ('celsius',)),
    ):
        if signal is not None:
            _write(folder / f'{use}_{key}.csv', ['t', *heads], [signal.t, signal.value])


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
        **({} if answer.sure is None else {'sure': answer.sure}),
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
        known = said.get('sure')
        told = None if known is None else tuple(bool(each) for each in known)
        predicted = _read(folder / PREDICTED)
    except (OSError, ValueError, KeyError, TypeError) as error:
        raise DataError(f"'{folder}' holds no answer: {error}") from None
    likely = [unknown, none, *(p for cause in causes for *_, p in cause)]
    if not all(0.0 <= value <= 1.0 + _SLACK for value in likely):
        raise DataError(f"'{folder / ANSWER}' has a probability that is not between 0 and 1")
    if told is not None and len(told) != len(causes) + 1:
        raise DataError(
            f"'{folder / ANSWER}' must say of each cause and of the whole if it is sure"
        )
    if predicted.shape not in ((count, 3), (count, 6)) or not np.isfinite(predicted).all():
        raise DataError(
            f"'{folder / PREDICTED}' must have {count} rows of three or six finite numbers, it has "
            f'{predicted.shape[0]} of {predicted.shape[1]}'
        )
    sigma = predicted[:, 3:] if predicted.size > 3 * count else None
    if sigma is not None and (sigma <= 0.0).any():
        raise DataError(f"'{folder / PREDICTED}' has a standard deviation that is not positive")
    return ContestAnswer(predicted[:, :3], causes, unknown, none, told, sigma)


SAID = 'said.txt'
"""What a method printed while it worked."""
LIMIT = 300.0
"""Seconds an answer may take; a fit that has not ended by then has lost its way."""
RUN = 'run.json'
"""What a run took, beside its answer: a contest that was stopped goes on from there."""


@dataclass(frozen=True)
class Run:
    answer: ContestAnswer | None
    """None where it gave none."""
    seconds: float
    """Of processor time, the start of the interpreter and its imports included [s]."""
    memory_bytes: int
    trouble: str = ''
    """Why there is no answer: the last that it said where it failed."""


def opened(cases: Path, truths: Path, out: Path) -> list[str]:
    """
    Put sealed cases into the open form, where they are not there already; return their names.

    Of the truths, only what was commanded while the tool was measured is used.
    """
    names = [str(entry['name']) for entry in seal.read(cases / seal.CASES)['cases']]
    for name in names:
        if (out / name).exists():
            continue
        said = seal.read(cases / name / seal.CASE)
        file = cases / name / seal.ROBOT
        robot = load_robot(str(file))
        train = read_recording(cases / name / seal.TRAIN, robot)
        ask = read_recording(truths / name / seal.TEST, robot)
        known = (cases / name / seal.KNOWN).read_text(encoding='utf-8') if said['known'] else ''
        write_case(
            out / name,
            file,
            (train, ask),
            {'align': said['align'], 'exclude': said['exclude'], 'known': known},
        )
    return names


def commands(names: list[str], entered: list[str]) -> dict[str, list[str]]:
    """
    Return the command of every entrant, and of others entered as NAME=COMMAND, with {case} and {out}.

    Raises DataError: there is no such entrant, it cannot be loaded, or a command lacks a place.
    """
    out: dict[str, list[str]] = {}
    for name in names:
        if name not in ENTRANTS:
            raise DataError(f'no entrant is called {name!r}; there are {", ".join(ENTRANTS)}')
        try:
            entrant(name)
        except ImportError as error:
            raise DataError(
                f'the method {name!r} cannot be loaded ({error}); run '
                "pip install 'weld-twin[bench,contest]', or leave it out of --entrants"
            ) from None
        out[name] = [sys.executable, '-m', str(__package__), name, '{case}', '{out}']
    for text in entered:
        name, _, command = text.partition('=')
        if not name or '{case}' not in command or '{out}' not in command:
            raise DataError(f'--enter takes NAME=COMMAND with {{case}} and {{out}}, got {text!r}')
        out[name] = shlex.split(command)
    return out


def run_all(
    cases: Path,
    names: list[str],
    methods: Mapping[str, Sequence[str]],
    out: Path,
    counts: Mapping[str, int],
    tell: Callable[[str], None],
) -> dict[str, dict[str, Run]]:
    """Return what every method said of every case; all take turns, and ``out`` keeps what came of it."""
    runs: dict[str, dict[str, Run]] = {method: {} for method in methods}
    for name in names:
        for method, words in methods.items():
            place = out / method / name
            if not (place / RUN).exists():
                shutil.rmtree(place, ignore_errors=True)
                place.mkdir(parents=True)
                write_json(place / RUN, ended(words, cases / name, place))
            runs[method][name] = _kept(place, counts[name])
        tell(name)
    return runs


def _kept(place: Path, count: int) -> Run:
    """Return what came of a run; an answer out of form is none."""
    run = Run(None, **read_json(place / RUN))
    try:
        return run if run.trouble else replace(run, answer=read_answer(place, count))
    except DataError as error:
        return replace(run, trouble=str(error))


def ended(words: Sequence[str], case: Path, place: Path) -> dict[str, Any]:
    """Have a command answer a case; return what a `Run` says of it beside the answer."""
    filled = [word.replace('{case}', str(case)).replace('{out}', str(place)) for word in words]
    with (place / SAID).open('w', encoding='utf-8') as said:
        code, cost = cost_of(filled, said=said, limit=LIMIT)
    last = (place / SAID).read_text(encoding='utf-8').strip().rpartition('\n')[2]
    trouble = (last or f'exit code {code}') if code else ''
    return {'seconds': cost.cpu, 'memory_bytes': int(cost.peak), 'trouble': trouble}


KINDS = ('n30', 'wrist_10deg', 'octant_0', 'odd')
"""Splits that are asked: few stations, two narrow regions that are asked about outside, and half
of all."""
MEASURED = 'measured.json'
"""Where the tool was at the times asked for, beside the cases and not in them."""
Errors = dict[str, dict[str, float]]
"""Mean errors [m] by method and case."""


def arm_cases(ur5: Path, ur10: Path, out: Path) -> dict[str, Array]:
    """
    Write the cases of both arms, or keep them; return what was measured where they ask, (M, 3) [m].

    Nobody measured base and tool frame; the nominal arm's are fitted on the stations of the case,
    the same for all methods. They are told as frames that are not known.

    Raises DataError: a table is missing or cannot be read.
    """
    out.mkdir(parents=True, exist_ok=True)
    if (out / MEASURED).exists():
        return {name: np.array(rows) for name, rows in read_json(out / MEASURED).items()}
    measured: dict[str, Array] = {}
    for split in all_splits(ur5, ur10):
        if split.kind in KINDS:
            measured[split.name] = _written(split, out / split.name)
    content = {name: rows.tolist() for name, rows in measured.items()}
    write_text(out / MEASURED, json.dumps(content) + '\n')
    return measured


def _written(split: Split, folder: Path) -> Array:
    """Write a case; return what it asks for. Where a region was left, it is asked outside of it."""
    ask, train = split.outside or split.inside, split.train
    assert ask is not None
    framed = plain_fit(train, catalog.load(split.robot), (), ALIGN)
    robot = framed.robot.with_frames(base=framed.bases[0])
    with TemporaryDirectory() as place:
        file = Path(place) / 'robot.yaml'
        write_text(file, yaml_text(robot.to_mapping()))
        said = {'align': sorted(ALIGN), 'exclude': [], 'known': ''}
        # Without orientations: few methods can use them.
        train = train.with_measured(replace(measured_of(train), rotation=None))
        write_case(folder, file, (train, ask), said)
    return measured_of(ask).position


def lefts(runs: Mapping[str, Mapping[str, Run]], measured: Mapping[str, Array]) -> Errors:
    """Return the mean error [m] of every method on every case that it answered."""
    return {
        method: {
            name: float(np.linalg.norm(measured[name] - run.answer.predicted, axis=1).mean())
            for name, run in said.items()
            if run.answer is not None
        }
        for method, said in runs.items()
    }


def arm_table(by_method: Mapping[str, Mapping[str, float]], names: list[str]) -> str:
    best = {
        name: min((errors[name] for errors in by_method.values() if name in errors), default=0.0)
        for name in names
    }
    rows: list[list[object]] = [['method', *names]]
    for method, errors in by_method.items():
        cells = [_millimetres(errors.get(name), best[name]) for name in names]
        rows.append([method, *cells])
    return table(*rows)


def _millimetres(error: float | None, best: float) -> str:
    """Return an error [m] in millimetres; '-' where there is none, bold where it is the least."""
    if error is None:
        return '-'
    return f'**{1e3 * error:.3f}**' if error == best else f'{1e3 * error:.3f}'


def page(table: str, errors: Errors, measured: Mapping[str, Array]) -> str:
    """Return the page: the table of sealed cases, and errors on measured arms where these were asked."""
    sealed = f'## On sealed cases\n\n{table}'
    if not errors:
        return sealed
    asked = ', '.join(f'{name} {len(rows)}' for name, rows in measured.items())
    return (
        f'{sealed}\n'
        '## On two measured arms\n\nMean error [mm] on the stations asked for; the least on every '
        'split is bold. `n30` is thirty stations, `wrist_10deg` and `octant_0` are narrow regions '
        f'asked about outside of them, `odd` is every second station.\n\n'
        f'{arm_table(errors, list(measured))}\nStations asked for: {asked}.\n'
    )
