# Copyright 2026 weld_twin contributors
# SPDX-License-Identifier: Apache-2.0
"""
Every family of effects on every kind of arm, from well below the noise to far above it.

A case is made, diagnosed and judged in one task, and only what it was worth is kept.
"""

from __future__ import annotations

import json
import time
from collections.abc import Sequence
from dataclasses import replace
from pathlib import Path
from tempfile import TemporaryDirectory
from typing import Any

import numpy as np

from weld_twin_core.errors import DataError, PathError
from weld_twin_msgs_py.files.whole_files import write_text
from weld_twin_nodes.offline.task_pool import Runner, Task

from . import layout
from .achieved import achieved
from .blind_cell import again, draw_cell, take
from .cause_sizes import FAMILIES, MOVING, draw
from .deck import MOTIONS, ROBOTS, Lot
from .diagnosing import diagnose_case, engine_digest
from .displacement import rms
from .judging import NAMING, judge
from .making import SealedCase, write_case, write_truth
from .sizing import NotVisible, sized

ARMS = ('ur5', 'kuka_kr6_r900', 'franka_panda')
"""A wrist of parallel axes, a spherical wrist, seven joints."""
SIZES = (0.5, 1.0, 3.0, 10.0)
"""Effect RMS over measurement noise."""
SECONDS = 30.0
"""Length [s] of the recording that is diagnosed."""
TRIES = 12
"""Cells and motions drawn for a row of the table before it is given up."""
NAME = 'case'


def recover(
    runner: Runner,
    seed: int,
    arms: Sequence[str] = ARMS,
    families: Sequence[str] = FAMILIES,
    sizes: Sequence[float] = SIZES,
    motion: str = 'free',
) -> list[dict[str, Any]]:
    """
    Return what the diagnosis made of every family on every arm at every size.

    Parameters
    ----------
    runner : Runner
        Its store makes the work resumable; another engine is asked anew.
    seed : int
    arms, families : sequence of str
    sizes : sequence of float
        Effect RMS over noise.
    motion : str
        'free', 'seams' or 'stations'.

    Raises
    ------
    DataError
        An unknown arm, family or motion, or a negative seed.

    """
    for what, given, known in (
        ('arm', arms, ROBOTS),
        ('family', families, FAMILIES),
        ('motion', (motion,), MOTIONS),
    ):
        for name in given:
            if name not in known:
                raise DataError(f'there is no {what} {name!r}; choose among {", ".join(known)}')
    if seed < 0:
        raise DataError(f'the seed must not be negative, got {seed}')
    engine = engine_digest()
    return runner.run(
        [
            Task(
                recover_one,
                (seed, family, arm, size, _motion(family, motion), engine),
                f'{family} on {arm}, {size:g} times the noise',
            )
            for family in families
            for arm in arms
            for size in sizes
        ]
    )


def _motion(family: str, wanted: str) -> str:
    """Return the motion; at rest nothing lags."""
    return 'free' if wanted == 'stations' and family in MOVING else wanted


def recover_one(
    seed: int, family: str, arm: str, size: float, motion: str, engine: str
) -> dict[str, Any]:
    """
    Return what the diagnosis made of one case.

    What cannot be shown as large as wanted says so in ``not_shown``; the digest of the engine
    only tells this task from others.
    """
    asked = {'family': family, 'arm': arm, 'size': size, 'motion': motion}
    try:
        case = _case(seed, family, arm, size, motion)
    except NotVisible as error:
        return {**asked, 'not_shown': str(error)}
    with TemporaryDirectory() as place:
        return {**asked, 'not_shown': None, 'causes': case.causes, **_worth(case, Path(place))}


def _case(seed: int, family: str, arm: str, size: float, motion: str) -> SealedCase:
    """
    Return a case of one cause, its frames given, its recordings all of the same motion.

    Raises
    ------
    NotVisible
        No plausible cause is that large on any motion drawn.

    """
    own = [seed, FAMILIES.index(family), ROBOTS.index(arm), round(1000.0 * size)]
    reason: Exception = NotVisible(family)
    for attempt in range(TRIES):
        rng = np.random.default_rng([*own, attempt])
        cell = replace(draw_cell(arm, motion, (family,), rng), align=())
        try:
            train = take(cell, motion, SECONDS, rng)
            span = float(train.command.t[-1])
            cause, off = sized(cell, draw(family, cell.robot, span, rng), train, size)
        except (NotVisible, PathError, FloatingPointError) as error:
            reason = error
            continue
        lot = Lot('single', arm, motion, (family,), ())
        return SealedCase(
            lot,
            cell,
            [cause],
            [],
            [rms(off) / cell.noise],
            (),
            train,
            again(train, rng),
            again(train, rng),
            fresh=False,
        )
    raise NotVisible(str(reason))


def _worth(case: SealedCase, place: Path) -> dict[str, Any]:
    """Write the case as any other, diagnose it, and return what the verdict was worth."""
    cases, truths = place / 'cases', place / 'truths'
    write_case(cases / NAME, NAME, case)
    write_truth(truths / NAME, NAME, case)
    truth = layout.read(truths / NAME / layout.TRUTH)
    before = time.process_time()
    verdict = diagnose_case(str(cases / NAME), '', '', with_holdout=True)
    processor = time.process_time() - before
    diagnosis = verdict['diagnosis']
    judged = judge(truth, diagnosis)
    shrink = None
    if diagnosis and judged.status in NAMING:
        file = place / layout.DIAGNOSIS
        write_text(file, json.dumps(diagnosis))
        shrink = achieved(cases, truths, truth, file, diagnosis['shrink'])._asdict()
    return {
        'ratio': case.ratios[0],
        'richness': case.cell.richness,
        'orientation': case.cell.tracker.orientation,
        'judged': judged.as_dict(),
        'shrink': shrink,
        'error': verdict['error'],
        'seconds': verdict['seconds'],
        'processor_seconds': processor,
    }
