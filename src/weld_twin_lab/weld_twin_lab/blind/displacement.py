# Copyright 2026 weld_twin contributors
# SPDX-License-Identifier: Apache-2.0
"""Displacements of the tool over a recording, shape (M, 3) [m]: their size, and what is alike."""

from __future__ import annotations

import numpy as np

from weld_twin_core.arrays import Array


def rigid(points: Array, off: Array) -> Array:
    """Return the part of a displacement (M, 3) that a moved base explains."""
    centred = points - points.mean(axis=0)
    turn = [np.cross(axis, centred) for axis in np.eye(3)]
    columns = [column.ravel() for column in turn]
    columns += [np.tile(axis, len(points)) for axis in np.eye(3)]
    design = np.stack(columns, axis=1)
    fitted, *_ = np.linalg.lstsq(design, off.ravel(), rcond=None)
    return np.asarray((design @ fitted).reshape(off.shape))


def rms(off: Array) -> float:
    """Return the RMS length of vectors (M, 3)."""
    return float(np.sqrt((off**2).sum(axis=1).mean()))


def correlation(a: Array, b: Array) -> float:
    """Return the absolute correlation of two deviations, shape (M, 3) each."""
    size = float(np.linalg.norm(a) * np.linalg.norm(b))
    return abs(float((a * b).sum())) / max(size, 1e-300)
