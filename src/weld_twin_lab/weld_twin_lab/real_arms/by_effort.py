# Copyright 2026 weld_twin contributors
# SPDX-License-Identifier: Apache-2.0
"""Springs by measured efforts and by statics, both judged on stretches of time that were not fitted."""

from __future__ import annotations

from collections.abc import Callable, Sequence
from dataclasses import dataclass, replace

import numpy as np

from weld_twin_core.arm.robot import Robot
from weld_twin_core.arrays import Array
from weld_twin_core.diagnosis import diagnose
from weld_twin_core.diagnosis.algebra.problem import Model
from weld_twin_core.errors import DataError, ModelError
from weld_twin_core.recording import Recording
from weld_twin_msgs_py.files import markdown
from weld_twin_msgs_py.files.input_files import hashed
from weld_twin_msgs_py.files.whole_files import write_text
from weld_twin_msgs_py.tables import read_table
from weld_twin_report.report.diagnosis_files import RESULT, write_results

from ..study import Study
from .sources import alone
from .unseen import ALIGN, PLAIN, plain_fit, residual

WAYS = ('frames', 'geometry', 'statics', 'efforts')
"""Plain fits of the frames and of the geometry; diagnoses with springs by statics and by efforts."""


@dataclass(frozen=True, eq=False)
class Fold:
    """One stretch of time that was not fitted."""

    away: dict[str, Array]
    """Distance of measured from predicted, for each of `WAYS`, shape (M,) [m]."""
    names: tuple[str, ...]
    """What was found with efforts, one text each."""


def folds(
    recording: Recording, robot: Robot, count: int, tell: Callable[[str], None]
) -> list[Fold]:
    """
    Return every stretch predicted by models of all the others.

    recording: stations with measured poses and efforts.
    count: stretches, of equal numbers of stations in the order of time.
    tell: told of each fold that is done.

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
        names = tuple(f'{e.name} of {e.site}' if e.site else e.name for e in by_efforts.found)
        out.append(Fold(away, names))
        tell(f'stretch {len(out)} of {count}: efforts {away["efforts"].mean() * 1e3:.3f} mm')
    return out


def table(name: str, done: Sequence[Fold]) -> str:
    """Return means and maxima of all stretches as a page of Markdown."""
    each = {way: np.concatenate([fold.away[way] for fold in done]) for way in WAYS}
    start = float(each['frames'].mean())
    words = {
        'frames': 'frames alone, plain fit',
        'geometry': 'frames and geometry, plain fit',
        'statics': "diagnosis, springs by the model's statics",
        'efforts': 'diagnosis, springs by measured efforts (`--use-effort`)',
    }
    lines = [
        f'# Springs by measured efforts: {len(each["frames"])} {name}',
        '',
        f'Position on stations that were not fitted, {len(done)} stretches of time left out in turn.',
        '',
        markdown.table(
            ('model', 'mean mm', 'max mm', 'mean over frames alone'),
            *(
                (
                    words[way],
                    f'{away.mean() * 1e3:.3f}',
                    f'{away.max() * 1e3:.3f}',
                    f'{away.mean() / start:.3f}',
                )
                for way, away in each.items()
            ),
        ),
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
