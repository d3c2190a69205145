# Copyright 2026 weld_twin contributors
# SPDX-License-Identifier: Apache-2.0
"""
How much of what an answer says of an arm is there, where the arm is off by a little everywhere.

Every name is at work on such an arm. So a cause is asked how far it says that it moves the tool on a
motion that was not recorded, beside what fitted frames take up, and how much of that the errors
named really do, by the plant.
"""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import replace
from typing import Any

import numpy as np

from weld_twin_core.arrays import Array
from weld_twin_core.diagnosis import Diagnosis
from weld_twin_core.diagnosis.result import NAMING
from weld_twin_core.diagnosis.result import Cause as Told

from ..blind.ambiguous import Site
from ..blind.blind_cell import as_recording, deviation, exact, record
from ..blind.cause_sizes import site
from ..blind.making import SealedCase
from .levels_of_truth import Levels, alike_by_structure, levels_of
from .visible import fitted, frame_columns

HALF = 0.5
"""Part of what is said of a cause that has to be there."""
LARGE = 0.1
"""Share of the squared gap that may be missing where it is more than noise."""


def there(case: SealedCase, found: Diagnosis) -> list[dict[str, float] | None]:
    """
    Return for every cause told what part of it is there: by its names, places and dependences.

    case: with all its errors. None of what has no name, or a name that the model does not hold.
    """
    cell = replace(case.cell, align=(), tracker=replace(case.cell.tracker, orientation=False))
    frames = np.array(frame_columns(cell, [case.test], case.cell.align)).T

    def shown(off: Array) -> Array:
        """Return a displacement (M, 3) without what fitted frames take up, in units of noise."""
        rows = off.ravel() / cell.tracker.sigma
        return np.asarray(rows - frames @ fitted(frames, rows) if frames.size else rows)

    seen = as_recording('test', record(cell, case.causes, case.test, exact(cell.tracker)))
    assert seen.measured is not None
    model, t = found.model, seen.measured.t
    whole = model.twin(0).poses(seen, t).position
    real = [shown(deviation(cell, [own], case.test)) for own in case.causes]
    sites = [site(own) for own in case.causes]
    words = [_levels(case, own) for own in sites]

    def part_of(told: Told) -> dict[str, float] | None:
        kind = told.name[0][0].effect if told.name and not told.rest else None
        names = [(str(own.effect), own.joint) for own, _ in told.name]
        gone = [e for e in model.found if e.name == kind and (e.name, e.site) in names]
        if not gone:
            return None
        rest = model.with_found(tuple(e for e in model.found if e not in gone))
        said = shown(whole - rest.twin(0).poses(seen, t).position)

        def share(meant: Sequence[bool]) -> float:
            off = [rows for rows, own in zip(real, meant, strict=True) if own]
            return float(said @ np.sum(off, axis=0) / (said @ said)) if off else 0.0

        places, dependences = _listed(told.place), _listed(told.dependence)
        return {
            'name': max(share([own in kind for own in sites]) for kind in _kinds(case, names)),
            'place': share([bool(own.places & places) for own in words]),
            'dependence': share([bool(own.dependences & dependences) for own in words]),
        }

    return [part_of(told) for told in found.causes]


def _kinds(case: SealedCase, names: Sequence[Site]) -> list[set[Site]]:
    """Return the sites named of every kind, with all that are the same error."""
    robot = case.lot.robot
    return [
        set[Site]().union(*(alike_by_structure(robot, own) for own in names if own[0] == kind))
        for kind in dict.fromkeys(own[0] for own in names)
    ]


def _levels(case: SealedCase, own: Site) -> Levels:
    truth = {'sites': [own], 'construction': None, 'robot': case.lot.robot}
    return levels_of(truth)[0]


def _listed(told: Sequence[tuple[Any, float]]) -> set[str]:
    return {str(word) for word, _ in told}


def _complete(row: Mapping[str, Any]) -> bool:
    """Return whether what a model misses on a sealed motion is noise, or a tenth of the gap."""
    left, floor, gap = (row['sealed'][key] for key in ('after', 'floor', 'before'))
    return bool(left**2 - floor**2 <= max(floor**2, LARGE * gap**2))


def right(row: Mapping[str, Any]) -> bool:
    """Return whether an answer is right as a whole: all that it names is there, and no more."""
    named = [own['name'] >= HALF for own in row['there'] if own is not None]
    return row['verdict']['status'] in NAMING and all(named) and _complete(row)
