# Copyright 2026 weld_twin contributors
# SPDX-License-Identifier: Apache-2.0
"""All that is promised of recordings, cases, programs, touches, years and plans, and what it came to."""

from __future__ import annotations

from collections.abc import Callable
from functools import lru_cache
from pathlib import Path
from typing import Any

import numpy as np

from weld_twin_core.arm import catalog
from weld_twin_core.arrays import Array
from weld_twin_core.diagnosis import Diagnosis, diagnose
from weld_twin_core.errors import TwinError
from weld_twin_core.recording import Recording
from weld_twin_nodes.offline.task_pool import Task

from ..blind.displacement import rms
from ..programs.cells import CELLS
from ..real_arms.splits import TUNED_ON, Split, all_splits
from ..real_arms.unseen import ALIGN, plain_fit, residual
from ..study import require_simulator
from .held import held
from .others import of_seam, of_touches, of_years
from .planned import carried_out
from .sealed import of_case, told_shrink

APART = 10_000
"""How far apart the seeds of what is drawn by one number are."""
UR5_NOISE = 2e-5
"""A GTS3800 is good to 15 um + 6 um/m, a metre or two away [m]."""


@lru_cache(maxsize=1)
def _splits(ur5: str, ur10: str) -> dict[str, Split]:
    return {split.name: split for split in all_splits(Path(ur5), Path(ur10))}


def tasks_of(args: Any) -> list[Task]:
    """
    Return what is to be tried, in the order that it is told.

    args: the options of the study.

    Raises DataError: data are missing or cannot be read, or the simulator is not there.
    """
    seed, asked = args.seed, list[tuple[str, Callable[..., Any], tuple[Any, ...]]]()
    for name in _splits(args.ur5, args.ur10) if args.ur5 else ():
        asked.append((name, _of_split, (args.ur5, args.ur10, name)))
    arms = len(asked)
    asked += [(f'case {k}', of_case, (seed, k)) for k in range(args.cases)]
    asked += [
        (f'{language} {k}', of_seam, (language, seed, k))
        for k in range(args.seams)
        for language in CELLS
    ]
    asked += [(f'touches {k}', of_touches, (APART * seed + k,)) for k in range(args.touches)]
    asked += [(f'years {k}', of_years, (seed, k)) for k in range(args.cells)]
    asked += [(f'plan {k}', carried_out, (APART * seed + k,)) for k in range(args.plans)]
    if len(asked) > arms:
        require_simulator()
    return [Task(simulated, (make, given), label) for label, make, given in asked]


def simulated(make: Callable[..., Any], given: tuple[Any, ...]) -> Any:
    """Return what is made; None where the plant's springs are too stiff to be simulated."""
    try:
        return make(*given)
    except FloatingPointError:
        return None


def _of_split(ur5: str, ur10: str, name: str) -> dict[str, Any]:
    """Return what the regions of one poor recording hold, inside and outside of it."""
    split = _splits(ur5, ur10)[name]
    group = 'tuned on' if split.robot == 'ur5' and split.kind in TUNED_ON else 'unseen'
    entry: dict[str, Any] = {'name': split.name, 'source': split.robot, 'group': group}
    found = _tried(lambda: diagnose([split.train], catalog.load(split.robot), align=ALIGN), entry)
    if found is None:
        return entry
    for region, other in (('inside', split.inside), ('outside', split.outside)):
        if other is not None and other.measured is not None and other.measured.t.size:
            entry[region] = held(found, split.train, other, _noise(other))
            told = _of_shrink(split, other, found, region)
            entry.setdefault('promises', {})[f'shrink on the real arms, {region} (95 %)'] = [told]
    return entry


def _of_shrink(split: Split, other: Recording, found: Diagnosis, region: str) -> dict[str, Any]:
    """Return the shrink that is told of a split, and that on stations that were not fitted."""
    assert found.shrink is not None
    bare = plain_fit(split.train, catalog.load(split.robot), (), frozenset(ALIGN))
    before, after = (
        rms(residual(model, split.train, other)[:3].T) for model in (bare, found.model)
    )
    told = told_shrink(found.shrink, after / before, region)
    return {**told, 'ci90': told['ci95']}


def _tried(work: Callable[[], Diagnosis], entry: dict[str, Any]) -> Diagnosis | None:
    """Return a diagnosis with a posterior; None, and why in the entry, where there is none."""
    try:
        found = work()
    except TwinError as error:
        entry['refused'] = str(error)
        return None
    entry['status'] = found.status
    return found if found.posterior is not None else None


def _noise(other: Recording) -> Array:
    assert other.measured is not None
    if other.measured.sigma is not None:
        return other.measured.sigma
    return np.full(other.measured.t.size, UR5_NOISE)
