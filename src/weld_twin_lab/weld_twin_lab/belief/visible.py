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

from weld_twin_core.arm.rotation import matrix_from_quaternion
from weld_twin_core.arrays import Array

from ..blind.blind_cell import BlindCell, Take, deviation, exact, floor, record
from ..blind.cause_sizes import SIZES, Cause
from ..blind.making import SealedCase

STEP = 0.1
"""Share of a parameter by which it is changed for its column; angles by as much [rad]."""
TURNING = {'transmission_ripple': ('phase',), 'bearing_tilt': ('phase',)}
"""Parameters beside the sizes that bend a cause."""


def shown(case: SealedCase) -> list[float]:
    """
    Return for each cause by how much chi-square rises without it, the least of both kinds of motion.

    Causes are taken as linear in their parameters about the truth.
    """
    cell = replace(case.cell, align=())
    takes = (case.train, *case.also, case.test)
    whole = _moved(cell, case.causes, takes)
    frames = _frames(cell, takes, case.cell.align)
    columns = [
        [(_moved(cell, new, takes) - whole) / STEP for new in changed(case.causes, k)]
        for k in range(len(case.causes))
    ]
    unseen = np.arange(whole.size) >= whole.size - 3 * _samples(cell, case.test)
    out = []
    for k in range(len(case.causes)):
        others = [own for j, part in enumerate(columns) if j != k for own in part]
        design = np.array([*others, *frames]).T
        gone = whole - _moved(cell, [*case.causes[:k], *case.causes[k + 1 :]], takes)
        left = gone - design @ _fitted(design[~unseen], gone[~unseen]) if design.size else gone
        rises = [float((left[part] ** 2).sum()) for part in (unseen, ~unseen)]
        out.append(min(rises) / cell.tracker.sigma**2)
    return out


def _fitted(design: Array, target: Array) -> Array:
    """Return least-squares coefficients; columns differ in size by orders of magnitude."""
    size = np.maximum(np.linalg.norm(design, axis=0), 1e-300)
    return np.asarray(np.linalg.lstsq(design / size, target, rcond=1e-9)[0] / size)


def _moved(cell: BlindCell, causes: Sequence[Cause], takes: Sequence[Take]) -> Array:
    """Return how far causes move the measured positions on all recordings, (rows,) [m]."""
    return np.concatenate([deviation(cell, causes, taken).ravel() for taken in takes])


def _samples(cell: BlindCell, taken: Take) -> int:
    return len(record(cell, (), taken, exact(cell.tracker)).position)


def _frames(cell: BlindCell, takes: Sequence[Take], align: Sequence[str]) -> list[Array]:
    """Return the columns of the frames that are fitted; of the tool its shift alone."""
    seen = [record(cell, (), taken, exact(cell.tracker)) for taken in takes]
    out: list[Array] = []
    for axis in np.eye(3):
        if 'base' in align:
            out.append(np.concatenate([np.cross(axis, own.position).ravel() for own in seen]))
            out.append(np.concatenate([np.tile(axis, len(own.position)) for own in seen]))
        if 'tool' in align:
            turns = [matrix_from_quaternion(np.asarray(own.quaternion)) for own in seen]
            out.append(np.concatenate([(turn @ axis).ravel() for turn in turns]))
    return out


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
