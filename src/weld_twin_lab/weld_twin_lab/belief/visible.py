# Copyright 2026 weld_twin contributors
# SPDX-License-Identifier: Apache-2.0
"""
Which causes of a case show at all, and what share of the gap each has, by the plant alone.

A cause is taken out of the truth; all others and the frames may then change so that the
recordings look as they did. What still differs, there and on another motion, shows. On the
recordings too: a fit that has to reach far beyond them differs elsewhere for no cause.

Where an arm is off by a little everywhere, every name is at work. So a cause is asked how far it says
that it moves the tool on a motion that was not recorded, beside what fitted frames take up, and how
much of that the errors named really do.
"""

from __future__ import annotations

from collections.abc import Iterator, Mapping, Sequence
from dataclasses import replace
from typing import Any

import numpy as np
from scipy.spatial.transform import Rotation, Slerp

from weld_twin_core.arm.rotation import matrix_from_quaternion
from weld_twin_core.arrays import Array
from weld_twin_core.diagnosis import Diagnosis
from weld_twin_core.diagnosis.result import NAMING
from weld_twin_core.diagnosis.result import Cause as Told

from ..blind.blind_cell import BlindCell, Take, as_recording, deviation, exact, floor, record
from ..blind.cause_sizes import SIZES, Cause, Site, site
from ..blind.making import SealedCase
from ..plant.exponentials import PlantRecording
from .levels_of_truth import alike_by_structure, levels_of

STEP = 0.1
"""Share of a parameter by which it is changed for its column; angles by as much [rad]."""
TURNING = {'transmission_ripple': ('phase',), 'bearing_tilt': ('phase',)}
"""Parameters beside the sizes that bend a cause."""


def shown(case: SealedCase) -> list[float]:
    """
    Return for each cause by how much chi-square rises without it, the least of both kinds of motion.

    Causes are taken as linear in their parameters about the truth.
    """
    positions = replace(case.cell.tracker, orientation=False)
    cell = replace(case.cell, align=(), tracker=positions)
    takes = (case.train, *case.also, case.test)
    whole = moved(cell, case.causes, takes)
    frames = frame_columns(cell, takes, case.cell.align)
    columns = [
        [(moved(cell, new, takes) - whole) / STEP for new in changed(case.causes, k)]
        for k in range(len(case.causes))
    ]
    unseen = np.arange(whole.size) >= whole.size - moved(cell, (), takes[-1:]).size
    out = []
    for k in range(len(case.causes)):
        others = [own for j, part in enumerate(columns) if j != k for own in part]
        design = np.array([*others, *frames]).T
        gone = whole - moved(cell, [*case.causes[:k], *case.causes[k + 1 :]], takes)
        remaining = gone - design @ fitted(design[~unseen], gone[~unseen]) if design.size else gone
        out.append(min(float((remaining[part] ** 2).sum()) for part in (unseen, ~unseen)))
    return out


def fitted(design: Array, target: Array) -> Array:
    """Return least-squares coefficients; columns differ in size by orders of magnitude."""
    size = np.maximum(np.linalg.norm(design, axis=0), 1e-300)
    return np.asarray(np.linalg.lstsq(design / size, target, rcond=1e-9)[0] / size)


def moved(cell: BlindCell, causes: Sequence[Cause], takes: Sequence[Take]) -> Array:
    """Return how far causes move positions, then turns where measured, over the noise, (rows,)."""
    out = []
    for taken in takes:
        out.append(deviation(cell, causes, taken).ravel() / cell.tracker.sigma)
        if cell.tracker.orientation:
            real, ideal = (record(cell, own, taken, exact(cell.tracker)) for own in (causes, ()))
            there = Rotation.from_quat(ideal.quaternion)
            if not ideal.static:
                t = np.clip(real.t_measured, ideal.t_measured[0], ideal.t_measured[-1])
                there = Slerp(ideal.t_measured, there)(t)
            turn = (Rotation.from_quat(real.quaternion) * there.inv()).as_rotvec()
            out.append(turn.ravel() / cell.tracker.sigma_orientation)
    return np.concatenate(out)


def frame_columns(cell: BlindCell, takes: Sequence[Take], align: Sequence[str]) -> list[Array]:
    """Return the columns of the frames that are fitted, in the rows of `moved`; none that is zero."""
    seen = [record(cell, (), taken, exact(cell.tracker)) for taken in takes]
    columns = [
        np.concatenate([_frame_column(cell, own, frame, shift, turn) for own in seen])
        for frame in align
        for shift, turn in zip(np.eye(6, 3), np.eye(6, 3, -3), strict=True)
    ]
    return [column for column in columns if column.any()]


def _frame_column(
    cell: BlindCell, seen: PlantRecording, frame: str, shift: Array, turn: Array
) -> Array:
    """Return what a frame's shift or turn, (3,) each, does to one recording, over its noise."""
    if frame == 'tool':
        rotation = matrix_from_quaternion(np.asarray(seen.quaternion))
        along, about = rotation @ shift, rotation @ turn
    else:
        about = np.tile(turn, (len(seen.position), 1))
        along = shift + np.cross(about, seen.position)
    out = (along.ravel() / cell.tracker.sigma, about.ravel() / cell.tracker.sigma_orientation)
    return np.concatenate(out if cell.tracker.orientation else out[:1])


def changed(causes: Sequence[Cause], k: int) -> Iterator[list[Cause]]:
    """Yield all causes with each number of one changed a little."""
    own = causes[k]
    for key in (*SIZES[own['effect']], *TURNING.get(own['effect'], ())):
        if key not in own:
            continue
        value = np.asarray(own[key], dtype=float)
        step = STEP if key in TURNING.get(own['effect'], ()) else STEP * np.abs(value).max()
        for at in np.ndindex(value.shape):
            other = value.copy()
            other[at] += step
            yield [*causes[:k], {**own, key: other.tolist()}, *causes[k + 1 :]]


def true_shares(case: SealedCase) -> list[float]:
    """
    Return the true share of every cause of a case.

    As a diagnosis tells it: of the squared gap with its noise, what is no noise is parted by how
    far each cause moves the tool along with all of them together. One that works against the
    others takes nothing off the gap beside them, and has a share of zero. The noise is all that
    is not the causes': the instrument's, and that of stamps that jitter.
    """
    whole = deviation(case.cell, case.causes, case.train)
    noise, _ = floor(case.cell, case.causes, case.train)
    square = float((whole**2).sum(axis=-1).mean())
    along = [
        max(float((deviation(case.cell, [cause], case.train) * whole).sum(axis=-1).mean()), 0.0)
        for cause in case.causes
    ]
    explained = square / (square + noise**2) / max(sum(along), 1e-300)
    return [explained * part for part in along]


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
    words = levels_of({'sites': sites, 'construction': None, 'robot': case.lot.robot})

    def part_of(told: Told) -> dict[str, float] | None:
        names = [] if told.rest else [(str(own.effect), own.joint) for own, _ in told.name]
        own = [model.found[k] for k in told.members]
        gone = [e for e in own if (e.name, e.site) in names]
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
    """Return the sites named of every kind, and of all, with all that are the same error."""
    robot = case.lot.robot
    alike = [(own[0], alike_by_structure(robot, own)) for own in names]
    kinds = [{kind} for kind, _ in alike]
    return [
        set[Site]().union(*(each for kind, each in alike if kind in among))
        for among in (*kinds, {kind for kind, _ in alike})
    ]


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
