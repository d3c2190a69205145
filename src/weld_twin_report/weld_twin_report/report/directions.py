# Copyright 2026 weld_twin contributors
# SPDX-License-Identifier: Apache-2.0
"""Along the seam, across it, along the tool: the same three directions everywhere on the page."""

from __future__ import annotations

import numpy as np

from weld_twin_core.arrays import Array
from weld_twin_core.diagnosis.result import Diagnosis
from weld_twin_core.twin.twin import Twin
from weld_twin_nodes.wording.quantities import millimetres
from weld_twin_nodes.wording.switches import as_it_is, trusted

from .page_data import static

_STILL = 1e-9
"""Travel [m] between samples below which there is no direction of travel."""
_SIDES = (
    ('ahead', 'behind'),
    ('to the left', 'to the right'),
    ('out along the tool', 'back along the tool'),
)
"""What the sign of each direction is called: left as seen from the tool, out is its axis z."""
_SEEN = 5e-7
"""Length [m] that would read 0.000 mm."""


def components(diagnosis: Diagnosis, k: int, vectors: Array) -> Array | None:
    """
    Return vectors of a recording along the seam, across it and along the tool, (M, 3) [m].

    As the bars of the gap have them: along is the direction of travel, the tool's axis z is made
    square to it. None for stations at rest, which have no direction of travel.

    ``k``: the recording. ``vectors`` (shape (M, 3) [m]): one at every stamp of its traces.
    """
    traces, model = diagnosis.traces, diagnosis.model
    if static(diagnosis, k) or k >= len(diagnosis.recordings) or len(vectors) < 3:
        return None
    robot = model.robot.with_frames(base=model.bases[k]) if k < len(model.bases) else model.robot
    tool = Twin(robot).poses(diagnosis.recordings[k], traces.t[k]).rotation[:, :, 2]
    along, out = _travel(traces.measured[k] - traces.before[k]), tool
    if along is None:
        return None
    out = _unit(out - along * (out * along).sum(axis=1, keepdims=True))
    axes = np.stack([along, np.cross(along, out), out], axis=1)
    return np.asarray(np.einsum('mij,mj->mi', axes, vectors))


def _travel(position: Array) -> Array | None:
    """Return the direction of travel; of samples at rest that of the nearest that moves."""
    along = _unit(np.gradient(position, axis=0))
    moves = np.flatnonzero(along.any(axis=1))
    if not moves.size:
        return None
    samples = np.arange(len(along))
    after = np.clip(np.searchsorted(moves, samples), 0, moves.size - 1)
    before = np.maximum(after - 1, 0)
    nearer = np.abs(moves[before] - samples) < np.abs(moves[after] - samples)
    return np.asarray(along[moves[np.where(nearer, before, after)]])


def _unit(vectors: Array) -> Array:
    size = np.linalg.norm(vectors, axis=1, keepdims=True)
    return np.asarray(
        np.divide(vectors, size, out=np.zeros_like(vectors), where=size > _STILL), dtype=float
    )


def rms_words(parts: Array) -> str:
    """Return the RMS along each direction, in words; parts are (M, 3) [m]."""
    along, across, tool = np.sqrt((parts**2).mean(axis=0))
    return (
        f'{millimetres(along)} along the seam, {millimetres(across)} across it, '
        f'{millimetres(tool)} along the tool'
    )


def sides_words(part: Array) -> str:
    """Return to which side and how far, in words; a part is (3,) [m]."""
    reported = [
        f'{millimetres(abs(float(value)))} {side[int(value < 0.0)]}'
        for value, side in zip(part, _SIDES, strict=True)
        if abs(value) >= _SEEN
    ]
    return ', '.join(reported)


def worst(diagnosis: Diagnosis) -> tuple[int, int, float] | None:
    """Return the recording, the sample and the size [m] of the largest trusted deviation."""
    best: tuple[int, int, float] | None = None
    for k in range(len(diagnosis.traces.t)):
        size = np.linalg.norm(as_it_is(diagnosis, k), axis=1) * trusted(diagnosis, k)
        if size.size and (best is None or size.max() > best[2]):
            best = k, int(np.argmax(size)), float(size.max())
    return best
