# Copyright 2026 weld_twin contributors
# SPDX-License-Identifier: Apache-2.0
"""
Which causes of a case show at all, and what share of the gap each has, by the plant alone.

A cause is taken out of the truth; all others and the frames may then change so that the
recordings look as they did. What still differs, there and on another motion, shows. On the
recordings too: a fit that has to reach far beyond them differs elsewhere for no cause.
"""

from __future__ import annotations

from collections.abc import Iterator, Sequence
from dataclasses import replace

import numpy as np
from scipy.spatial.transform import Rotation, Slerp

from weld_twin_core.arm.rotation import matrix_from_quaternion
from weld_twin_core.arrays import Array

from ..blind.blind_cell import BlindCell, Take, deviation, exact, floor, record
from ..blind.cause_sizes import SIZES, Cause
from ..blind.making import SealedCase
from ..plant.plant_recording import PlantRecording

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
    """
    Return how far causes move what is measured on all recordings, over its noise, (rows,).

    Of each recording the positions, and then the turns where the cell measures them.
    """
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
