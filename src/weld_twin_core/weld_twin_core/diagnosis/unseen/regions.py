# Copyright 2026 weld_twin contributors
# SPDX-License-Identifier: Apache-2.0
"""Regions of posture: what was measured with the arm in one part of its joint space."""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np

from ...arrays import Array
from ..algebra.problem import Problem

MOST = 0.5
"""Share of a recording in one region from which on the others do not tell its base."""


def posture_regions(problem: Problem, halvings: int = 3) -> Array:
    """
    Return the region of posture of every row, int, shape (rows,).

    The measurements are halved at the median of the joint that spreads most among them, and the
    halves again, so that every region holds as many and lies in one part of the joint space. Where
    recordings have bases of their own, one that lies in one region for the most part is dealt out
    over all of them: its base could not be told from the other regions.

    Parameters
    ----------
    problem : Problem
    halvings : int
        2 to this power is the number of regions.

    """
    postures = np.concatenate(
        [r.joints.at(r.measured.t)[0] for r in problem.recordings if r.measured is not None]
    )
    # Where a joint stands alike, what was measured decides: not which recording was given first.
    seen = np.concatenate(
        [r.measured.position.T for r in problem.recordings if r.measured is not None], axis=1
    )
    labels = np.zeros(postures.shape[0], dtype=int)
    for _ in range(halvings):
        after = labels * 2
        for name in np.unique(labels):
            here = np.flatnonzero(labels == name)
            spread = np.ptp(postures[here], axis=0)
            order = np.lexsort((*seen[:, here], postures[here, int(np.argmax(spread))]))
            after[here[order[here.size // 2 :]]] += 1
        labels = after
    if problem.own_bases:
        labels = _keeping_bases(labels, problem.samples)
    rows, at = [], 0
    for c, m in zip(problem.rows, problem.samples, strict=True):
        rows.append(np.repeat(labels[at : at + m], c))
        at += m
    return np.concatenate(rows)


def _keeping_bases(labels: Array, samples: Sequence[int]) -> Array:
    """Return regions without a recording that lies in one of them for the most part."""
    out, at, count = labels.copy(), 0, int(labels.max()) + 1
    for m in samples:
        own = labels[at : at + m]
        if np.bincount(own).max() > MOST * m:
            out[at : at + m] = np.arange(m) * count // m
        at += m
    return np.asarray(out)
