# Copyright 2026 weld_twin contributors
# SPDX-License-Identifier: Apache-2.0
"""
What a diagnosis, and what anybody would do, predict on stations that they have not seen.

Plain fits are of the frames, of the geometry, or of geometry and gravity, all at once.
"""

from __future__ import annotations

import re
import traceback
from collections.abc import Callable, Sequence
from dataclasses import dataclass, replace
from time import perf_counter
from typing import Any

import numpy as np
from numpy.typing import NDArray

from weld_twin_core.arm.robot import Robot
from weld_twin_core.arrays import Array
from weld_twin_core.diagnosis import Diagnosis, diagnose
from weld_twin_core.diagnosis.algebra.fit import fit, robust_scale
from weld_twin_core.diagnosis.algebra.problem import Model, Problem, usable
from weld_twin_core.diagnosis.frames.alignment import initial_frames
from weld_twin_core.effects import REGISTRY
from weld_twin_core.effects.dated import seen_from
from weld_twin_core.effects.effect import Effect
from weld_twin_core.effects.plausible import spreads
from weld_twin_core.errors import DataError, ModelError
from weld_twin_core.recording import Recording
from weld_twin_core.twin.domain import as_seen
from weld_twin_core.twin.posterior import Posterior
from weld_twin_msgs_py.files.input_files import hashed
from weld_twin_msgs_py.files.whole_files import write_text
from weld_twin_msgs_py.tables import read_table
from weld_twin_report.report.diagnosis_files import RESULT, write_results

from ..blind.scoring import in_words
from ..study import Study, tabled
from .sources import alone

ALIGN = frozenset({'base', 'tool'})
GEOMETRY = ('joint_offset', 'link_length', 'link_offset', 'link_twist', 'axis_parallelism')
PLAIN: dict[str, tuple[str, ...]] = {
    'frames': (),
    'geometry': GEOMETRY,
    'gravity': (*GEOMETRY, 'joint_compliance'),
}
"""The plain fits by name: the families that are fitted, all members of each."""
ROUNDS = 4
"""Gauss-Newton steps; there is no test of convergence."""


def plain_fit(
    train: Recording,
    robot: Robot,
    families: tuple[str, ...],
    align: frozenset[str],
    known: tuple[Effect, ...] = (),
) -> Model:
    """
    Return the robot with frames and all members of some families fitted; none for the frames alone.

    Least squares with the priors of `weld_twin_core.effects.plausible`, the noise estimated from
    what is left; nothing is chosen and nothing is judged.
    """
    problem = Problem((usable(train),), align)
    start = initial_frames(problem, Model(robot, (robot.T_world_base,), known))
    model = fit(problem, start, problem.unit_scale()).model
    effects: tuple[Effect, ...] = tuple(
        REGISTRY[family](joint)  # type: ignore[call-arg]
        for family in families
        if family != 'joint_compliance' or robot.mass is not None
        for joint in robot.joint_names
    )
    if not effects:
        return model
    model = model.with_found(effects)
    prior = 1.0 / np.concatenate([spreads(robot, effect) for effect in effects]) ** 2
    for _ in range(ROUNDS):
        freedom = float(min(prior.size, problem.size // 2))
        scale = robust_scale(problem, problem.residuals(model), freedom=freedom)
        model = fit(problem, model, scale, prior, iterations=6).model
    return model


def residual(
    model: Model, train: Recording, other: Recording, posterior: Posterior | None = None
) -> Array:
    """
    Return measured minus predicted, shape (3 or 6, M) [m, rad]; nothing is fitted.

    model: fitted on ``train``.
    posterior: models allowed about it, whose middle predicts, as `weld-twin predict` has it.
    """
    effects = seen_from(model.found, train.epoch_ns, train.span_ns, other)
    there = Model(model.robot, model.bases[:1], model.known, effects)
    problem = Problem((usable(other),), ALIGN)
    out = problem.residuals(there)[0]
    if posterior is None:
        return out
    shift = posterior.expected(problem.features(there)[0]).shift.T
    return np.asarray(out - shift[: len(out)])


def flagged(posterior: Posterior, other: Recording, t: Array) -> NDArray[np.bool_]:
    """Return which poses a prediction flags as outside what was recorded, shape (M,)."""
    outside = posterior.domain.outside(*as_seen(other, t))
    out = np.zeros(t.size, dtype=bool)
    for first, last, _ in outside:
        out[first : last + 1] = True
    return out


def tried(
    recording: Recording, robot: Robot, **options: Any
) -> tuple[Diagnosis | None, dict[str, Any]]:
    """Return the diagnosis or None, the seconds it took, and the traceback that came instead."""
    start, diagnosis, trouble = perf_counter(), None, None
    try:
        diagnosis = diagnose([recording], robot, **options)
    except Exception:  # what is counted here is exactly what nobody expected
        trouble = traceback_text()
    return diagnosis, {'seconds': round(perf_counter() - start, 2), 'traceback': trouble}


_BEFORE = re.compile(r'(?<=File ").*?(?=(?:weld_twin_\w+|site-packages)/)')
"""What stands before a package in the path of its file: of this machine alone."""


def traceback_text() -> str:
    """Return the traceback of the exception being handled, files as from their package on."""
    return _BEFORE.sub('', traceback.format_exc())


WAYS = {
    'frames': 'frames alone, plain fit',
    'geometry': 'frames and geometry, plain fit',
    'statics': "diagnosis, springs by the model's statics",
    'efforts': 'diagnosis, springs by measured efforts (`--use-effort`)',
}
"""The models that predict, in words."""


@dataclass(frozen=True, eq=False)
class Fold:
    away: dict[str, Array]
    """Distance of measured from predicted, for each of `WAYS`, shape (M,) [m]."""
    names: tuple[str, ...]
    """What was found with efforts, one text each."""


def folds(
    recording: Recording, robot: Robot, count: int, tell: Callable[[str], None]
) -> list[Fold]:
    """
    Return every stretch of stations with measured poses and efforts, predicted by models of all others.

    Raises DataError: no efforts, no measurements, or no stations.
    """
    if recording.effort is None or recording.measured is None or not recording.joints.static:
        raise DataError(f'{recording.name} needs stations with measured poses and efforts')
    rows = np.arange(recording.joints.t.size)
    out = []
    for rows_out in np.array_split(rows, count):
        train, test = (alone(recording, part) for part in (np.setdiff1d(rows, rows_out), rows_out))
        plain = replace(train, effort=None)
        by_efforts = diagnose(train, robot, align=ALIGN, experiment=False).model
        models: dict[str, Model] = {
            'frames': plain_fit(plain, robot, PLAIN['frames'], ALIGN),
            'geometry': plain_fit(plain, robot, PLAIN['geometry'], ALIGN),
            'statics': diagnose(plain, robot, align=ALIGN, experiment=False).model,
            'efforts': by_efforts,
        }
        away = {
            name: np.linalg.norm(residual(model, train, test)[:3], axis=0)
            for name, model in models.items()
        }
        out.append(Fold(away, tuple(in_words([(e.name, e.site)]) for e in by_efforts.found)))
        tell(f'stretch {len(out)} of {count}: efforts {away["efforts"].mean() * 1e3:.3f} mm')
    return out


def table(name: str, done: Sequence[Fold]) -> str:
    each = {way: np.concatenate([fold.away[way] for fold in done]) for way in WAYS}
    start = float(each['frames'].mean())
    columns: dict[str, Callable[[str], object]] = {
        'model': lambda way: WAYS[way],
        'mean mm': lambda way: f'{each[way].mean() * 1e3:.3f}',
        'max mm': lambda way: f'{each[way].max() * 1e3:.3f}',
        'mean over frames alone': lambda way: f'{each[way].mean() / start:.3f}',
    }
    lines = [
        f'# Springs by measured efforts: {len(each["frames"])} {name}',
        '',
        f'Position on stations that were not fitted, {len(done)} stretches of time left out in turn.',
        '',
        tabled(columns, WAYS),
        'Found with efforts, stretch by stretch:',
        '',
        *(f'* {", ".join(fold.names) or "nothing"}' for fold in done),
    ]
    return '\n'.join(lines) + '\n'


def run(study: Study) -> None:
    args = study.args
    if args.folds < 2:
        raise ModelError(f'--folds {args.folds}: give two stretches or more')
    robot = args.load_robot()
    recording = read_table(args.table, robot).recording
    with args.output(RESULT) as place:
        page = table(recording.name, folds(recording, robot, args.folds, study.tell))
        write_text(place / 'efforts.md', page)
        whole = diagnose(recording, robot, align=ALIGN)
        write_results(place, whole, [hashed('recording', args.table)], args.find_urdf())
    print(page, end='')
