# Copyright 2026 weld_twin contributors
# SPDX-License-Identifier: Apache-2.0
"""A real welding arm told from the pixels of two cameras alone, judged by a laser tracker."""

from __future__ import annotations

import csv
from collections.abc import Mapping, Sequence
from dataclasses import replace
from pathlib import Path
from typing import Any

import numpy as np
from numpy.typing import NDArray

from weld_twin_core.arm.robot import Robot
from weld_twin_core.arrays import Array
from weld_twin_core.bundle import seen_by
from weld_twin_core.diagnosis import diagnose
from weld_twin_core.diagnosis.algebra.fit import fit
from weld_twin_core.diagnosis.algebra.problem import Model, Problem, usable
from weld_twin_core.diagnosis.frames.alignment import initial_frames
from weld_twin_core.effects.effect import Effect
from weld_twin_core.recording import Measurements, Recording
from weld_twin_msgs_py.files import markdown
from weld_twin_msgs_py.tables import read_camera, read_pixels, read_target
from weld_twin_nodes.offline.task_pool import Task

from ..blind.displacement import rms
from ..real_arms.sources import motoman
from ..real_arms.unseen import ALIGN, PLAIN, plain_fit, residual
from ..study import Study, head, require_simulator
from .case import KINDS, beside_a_camera, sealed

PARTS = 5
"""Stretches of time, each left out in turn."""
CAMERAS = {'1': 'camera_1.yaml', '2': 'camera_2.yaml'}


def part(data: str, which: int) -> dict[str, object]:
    """
    Return what is left on a stretch of time that was not fitted, by the tracker [mm RMS].

    Frames of base and tool are the tracker's, of the other stretches; all else is told from their
    pixels alone, or from their tracker by a plain fit of the geometry.

    data: folder of published recordings; holds motoman_left.
    which: the stretch left out, counted from 0.
    """
    folder = Path(data)
    robot = motoman(folder, masses=False).robot
    here = folder / 'motoman_left'
    cameras = [read_camera(name, here / file) for name, file in CAMERAS.items()]
    target = read_target('hand', here / 'left_markers.csv')
    seen = read_pixels(here / 'left_hand.csv', robot, cameras, [target]).recording
    assert seen.images is not None
    place = _tracked(here / 'left_hand.csv')
    test = np.array_split(np.arange(len(place)), PARTS)[which]
    rest = np.setdiff1d(np.arange(len(place)), test)
    bare = replace(seen, measured=None, images=None, notes=())
    pixels = seen_by(bare, seen.images.take(np.isin(seen.images.image, rest)))
    diagnosis = diagnose(pixels, robot, align=ALIGN, experiment=False)
    train, judged = (_of(bare, place, rows) for rows in (rest, test))
    geometry = plain_fit(train, robot, PLAIN['geometry'], ALIGN).found
    models = {'frames': (), 'pixels': diagnosis.model.found, 'tracker': geometry}
    remaining = {name: _left(train, judged, robot, effects) for name, effects in models.items()}
    return {'part': which, 'status': diagnosis.status, **remaining}


def _tracked(path: Path) -> Array:
    """Return where the tracker saw the hand, pose by pose, (M, 3) [m]; NaN where it did not."""
    with path.open(newline='') as stream:
        rows = {row['pose']: row for row in csv.DictReader(stream)}
    texts = [[row[f'leica_{axis} [m]'] or 'nan' for axis in 'xyz'] for row in rows.values()]
    return np.array(texts, dtype=float)


def _of(bare: Recording, place: Array, rows: NDArray[np.intp]) -> Recording:
    kept = rows[np.isfinite(place[rows]).all(axis=1)]
    return replace(bare, measured=Measurements(bare.joints.t[kept], place[kept]))


def _left(train: Recording, judged: Recording, robot: Robot, known: tuple[Effect, ...]) -> float:
    """Return what a model leaves where its frames were not fitted [mm RMS]."""
    problem = Problem((usable(train),), ALIGN)
    start = initial_frames(problem, Model(robot, (robot.T_world_base,), known))
    model = fit(problem, start, problem.unit_scale()).model
    return 1e3 * rms(residual(model, train, judged)[:3].T)


CellResult = Mapping[str, Any]
AS_TRACKED = 0.8
"""Goal: share of the causes named beside a tracker that pixels name, too."""


def page(
    cases: Sequence[CellResult], pixels: Sequence[CellResult], real: Sequence[CellResult]
) -> str:
    """Return the page of sealed cells, of cases beside a camera, and of a real arm's pixels."""
    lines = ['# Whole cells, and cameras', '']
    if cases:
        lines += ['One cause of 3 to 8 noises, told with the frames of base and tool fitted:', '']
        lines += [_cells(cases), '']
    if pixels:
        lines += ['The same stations told from pixels of two cameras, and from a tracker:', '']
        lines += [_beside(pixels), '']
    if real:
        lines += ['A real arm told from pixels alone, and judged by a tracker [mm RMS]:', '']
        lines += [_real(real), '']
    return '\n'.join(lines)


def named_as_tracked(pixels: Sequence[CellResult]) -> float:
    """Return the share of causes named beside a tracker that pixels name, too."""
    both = [one['pixels']['named'] for one in pixels if one['tracker']['named']]
    return float(np.mean(both)) if both else 1.0


def _cells(cases: Sequence[CellResult]) -> str:
    rows = []
    for kind in dict.fromkeys(case['kind'] for case in cases):
        own = [case for case in cases if case['kind'] == kind]
        rows.append((kind, *_counts(own)))
    return markdown.table(
        ('cell', 'cases', 'named', 'nothing else', 'sure', 'sure and wrong'), *rows
    )


def _beside(pixels: Sequence[CellResult]) -> str:
    rows = [(way, *_counts([one[way] for one in pixels])) for way in ('tracker', 'pixels')]
    head = ('told from', 'cases', 'named', 'nothing else', 'sure', 'sure and wrong')
    share = f'Of what the tracker names, pixels name {100.0 * named_as_tracked(pixels):.0f} %.'
    return f'{markdown.table(head, *rows)}\n{share}'


def _counts(cases: Sequence[CellResult]) -> tuple[str, ...]:
    wrong = sum(one['sure'] and not one['right'] for one in cases)
    each = (sum(bool(one[key]) for one in cases) for key in ('named', 'right', 'sure'))
    return str(len(cases)), *map(str, each), str(wrong)


def _real(real: Sequence[CellResult]) -> str:
    keys = ('frames', 'pixels', 'tracker')
    rows = [(str(k + 1), *(f'{fold[key]:.3f}' for key in keys)) for k, fold in enumerate(real)]
    means = [float(np.mean([fold[key] for fold in real])) for key in keys]
    rows.append(('mean', *(f'{mean:.3f}' for mean in means)))
    rows.append(('over frames', *(f'{mean / means[0]:.2f}' for mean in means)))
    head = ('part', 'frames alone', 'told from pixels', 'told from the tracker itself')
    return markdown.table(head, *rows)


def run(study: Study) -> bool:
    require_simulator()
    args = study.args
    seeds = range(args.seed, args.seed + args.cells)
    kinds = [Task(sealed, (kind, seed), kind) for seed in seeds for kind in KINDS]
    cameras = range(args.seed, args.seed + args.cameras)
    beside = [Task(beside_a_camera, (seed,), 'camera') for seed in cameras]
    parts = [Task(part, (args.data, k), 'pixels') for k in range(PARTS * bool(args.data))]
    with study.runner('telling whole cells') as runner:
        cells, pixels, real = (runner.run(tasks) for tasks in (kinds, beside, parts))
    content = head('cells/1', seed=args.seed, cells=cells, pixels=pixels, real=real)
    study.write('cells', content, page(cells, pixels, real))
    return named_as_tracked(pixels) >= AS_TRACKED
