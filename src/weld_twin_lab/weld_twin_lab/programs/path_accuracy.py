# Copyright 2026 weld_twin contributors
# SPDX-License-Identifier: Apache-2.0
"""How far a tool was from the path that it was to go."""

from __future__ import annotations

from typing import NamedTuple

import numpy as np

from weld_twin_core.metrics.iso9283 import nearest_pass

APART = 1e-3
"""Places of the command path are looked at so far apart [m]: what turns around takes a few of them."""


class PathAccuracy(NamedTuple):
    """How far a tool was from a path [m]."""

    at: float
    """AT_p of ISO 9283, clause 8.2: the largest distance, over the points of the command path, of
    where the tool passes the plane square to it. The plant repeats itself exactly, so one cycle is
    the barycentre of ten."""
    rms: float
    """Of the same distances."""


def path_accuracy(attained: np.ndarray, wanted: np.ndarray) -> PathAccuracy:
    """
    Return how far a tool was from a path.

    attained: shape (K, 3) [m].
    wanted: the command path, shape (m, 3) [m]. At its ends, where the tool may not pass the plane,
    the distance to the nearest place of the tool counts.
    """
    fine = _finely(wanted)
    off = []
    for centre, tangent in zip(fine, np.gradient(fine, axis=0), strict=True):
        passed = nearest_pass(attained, centre, tangent)
        nearest = float(np.linalg.norm(attained - centre, axis=1).min())
        off.append(nearest if passed is None else float(np.linalg.norm(passed - centre)))
    return PathAccuracy(max(off), float(np.sqrt(np.mean(np.square(off)))))


def _finely(path: np.ndarray) -> np.ndarray:
    """Return places along straight pieces, shape (m, 3)."""
    way = np.concatenate([[0.0], np.cumsum(np.linalg.norm(np.diff(path, axis=0), axis=1))])
    at = np.linspace(0.0, way[-1], max(int(np.ceil(way[-1] / APART)), 1) + 1)
    return np.stack([np.interp(at, way, column) for column in path.T], axis=1)
