# Copyright 2026 weld_twin contributors
# SPDX-License-Identifier: Apache-2.0
"""All that is promised of recordings, cases, programs, touches, years and plans, and what it came to."""

from __future__ import annotations

from collections.abc import Callable, Iterator
from functools import partial
from pathlib import Path
from typing import Any, NamedTuple

import numpy as np

from weld_twin_core.arm import catalog
from weld_twin_core.arrays import Array
from weld_twin_core.diagnosis import Diagnosis, diagnose
from weld_twin_core.errors import TwinError
from weld_twin_core.recording import Recording

from ..programs.cells import CELLS
from ..real_arms.splits import TUNED_ON, Split, all_splits
from ..real_arms.unseen import ALIGN, plain_fit, residual
from ..study import Parts, require_simulator
from .held import held
from .others import of_seam, of_touches, of_years
from .planned import carried_out
from .sealed import of_case, told_shrink

NAME, PARTS = 'coverage', 'parts'
APART = 10_000
"""How far apart the seeds of what is drawn by one number are."""
UR5_NOISE = 2e-5
"""A GTS3800 is good to 15 um + 6 um/m, a metre or two away [m]."""


class Wanted(NamedTuple):
    """What is asked for."""

    arms: tuple[Path, Path] | None
    """Directories with the published tables of the UR5 and the UR10."""
    seed: int
    """Of all that is drawn."""
    cases: int
    seams: int
    touches: int
    cells: int
    plans: int
    """Sealed cases; seams of each language of programs; arms that touch things; cells that live
    through years; plans that are carried out."""


def entries_of(wanted: Wanted, part: Parts) -> list[dict[str, Any]]:
    """
    Return what every promise came to.

    part: keeps every recording's result.

    Raises DataError: data are missing or cannot be read, or the simulator is not there.
    """
    if any(wanted[2:]):
        require_simulator()
    entries = [part(name, partial(_simulated, make)) for name, make in _asked(wanted)]
    return [entry for entry in entries if entry is not None]


def _simulated(make: Callable[[], Any]) -> Any:
    """Return what is made; None where the plant's springs are too stiff to be simulated."""
    try:
        return make()
    except FloatingPointError:
        return None


def _asked(wanted: Wanted) -> Iterator[tuple[str, Callable[[], Any]]]:
    """Yield the name of every part, and what makes it."""
    seed = wanted.seed
    for split in all_splits(*wanted.arms) if wanted.arms else ():
        yield split.name, partial(_of_split, split)
    for k in range(wanted.cases):
        yield f'{seed}_{k:04d}', partial(of_case, seed, k)
    for k in range(wanted.seams):
        for language in CELLS:
            yield f'{seed}_{language}_{k:03d}', partial(of_seam, language, seed, k)
    for k in range(wanted.touches):
        yield f'{seed}_touches_{k:04d}', partial(of_touches, APART * seed + k)
    for k in range(wanted.cells):
        yield f'{seed}_years_{k:03d}', partial(of_years, seed, k)
    for k in range(wanted.plans):
        yield f'{seed}_plan_{k:03d}', partial(carried_out, APART * seed + k)


def _of_split(split: Split) -> dict[str, Any]:
    """Return what the regions of one poor recording hold, inside and outside of it."""
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
        float(np.sqrt((residual(model, split.train, other)[:3] ** 2).sum(axis=0).mean()))
        for model in (bare, found.model)
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
