# Copyright 2026 weld_twin contributors
# SPDX-License-Identifier: Apache-2.0
"""
Parts of the data that take turns in being unseen, and what a model gains on them.

Parts are stretches of time (`Problem.block_labels`) and regions of posture: neighbouring samples err
alike, and what carries over to the next minute need not carry over to where the arm has not been.
"""

from __future__ import annotations

from collections.abc import Sequence
from typing import Any, NamedTuple

import numpy as np
from numpy.typing import NDArray
from scipy.special import stdtrit

from ...arrays import Array
from ..algebra.problem import PLACES, Problem
from ..negligible import EMPTY, NANOMETRE

STRETCHES = 8
"""Folds in time: enough for a standard error, few enough that each shows much."""
COVERED = 0.9
"""Share of what is told with an interval that it shall hold."""


def ways_to_divide(problem: Problem) -> list[Array]:
    """
    Return the part of every row, int, shape (rows,), for each way to divide the rows.

    Stretches of time, then regions of posture; these not where places of contacts are the parts, as
    a place would lie on both sides.
    """
    by_time = problem.block_labels(STRETCHES)
    if problem.untracked and problem.places >= PLACES:
        return [by_time]
    return [by_time, posture_regions(problem)]


def posture_regions(problem: Problem) -> Array:
    """
    Return the region of posture of every row, int, shape (rows,).

    The measurements are halved at the median of the joint that spreads most among them, and the
    halves again, so that every region holds as many and lies in one part of the joint space. Where
    recordings have bases of their own, one that lies in one region for the most part is dealt out
    over all of them: its base could not be told from the other regions.
    """
    postures = np.concatenate([r.joints.at(r.seen.t)[0] for r in problem.recordings])
    # Where a joint stands alike, what was measured decides: not which recording was given first.
    seen = np.concatenate([r.seen.position.T for r in problem.recordings], axis=1)
    labels = np.zeros(postures.shape[0], dtype=int)
    for _ in range(int(np.log2(STRETCHES))):
        after = labels * 2
        for name in np.unique(labels):
            here = np.flatnonzero(labels == name)
            spread = np.ptp(postures[here], axis=0)
            order = np.lexsort((*seen[:, here], postures[here, int(np.argmax(spread))]))
            after[here[order[here.size // 2 :]]] += 1
        labels = after
    if problem.own_bases:
        labels = _keeping_bases(labels, problem.samples)
    return np.repeat(labels, np.repeat(problem.rows, problem.samples))


def _keeping_bases(labels: Array, samples: Sequence[int]) -> Array:
    """Return regions without a recording that lies in one of them for the most part."""
    out, at, count = labels.copy(), 0, int(labels.max()) + 1
    for m in samples:
        own = labels[at : at + m]
        if np.bincount(own).max() > m / 2.0:
            out[at : at + m] = np.arange(m) * count // m
        at += m
    return np.asarray(out)


def student(share: float) -> float:
    """Return between how many standard errors to either side a share lies, by the folds' spread."""
    return float(stdtrit(STRETCHES - 1, (1.0 + share) / 2.0))


class Gain(NamedTuple):
    """What one model takes off the squared error of another on unseen parts."""

    share: float  # share of it
    steady: float  # the same in standard errors between parts
    rms_m: float  # what is left, RMS [m]


def gain(before: Array, after: Array, labels: Array, after_labels: Array | None = None) -> Gain:
    """Return what is gained by squared errors (samples,) [m^2], in parts that both have."""
    others = labels if after_labels is None else after_labels
    names = np.intersect1d(labels, others)
    one, two = means(before, labels)[names], means(after, others)[names]
    was, remaining = float(before.mean()), float(after.mean())
    share = (was - remaining) / max(was, EMPTY)
    return Gain(share, steadiness(one, two), float(np.sqrt(remaining)))


def means(values: Array, labels: NDArray[Any]) -> Array:
    """Return the mean of every part, by its number; those of parts that are not there mean nothing."""
    return np.asarray(np.bincount(labels, values) / np.maximum(np.bincount(labels), 1))


def steadiness(before: Array, after: Array) -> float:
    fall = before - after
    error = float(fall.std(ddof=1) / np.sqrt(fall.size)) if fall.size > 1 else np.inf
    return float(fall.mean() / max(error, EMPTY))


def parts_of(labels: Sequence[Array]) -> NDArray[np.intp]:
    """Return the part of every sample, way after way; two neighbours of eight are one, and steadier."""
    parts, first = [], 0
    for each in labels:
        names, own = np.unique(each, return_inverse=True)
        parts.append(first + (own // 2 if names.size >= STRETCHES else own))
        first = int(parts[-1].max()) + 1
    return np.concatenate(parts)


def growth(before: Array, after: Array, parts: NDArray[np.intp]) -> Array:
    """Return by what share the RMS of every part grows, chance aside, by squares (samples,) [m^2]."""
    was, now, mean = (means(values, parts) for values in (before, after, after - before))
    out = np.sqrt(now) / np.maximum(np.sqrt(was), NANOMETRE) - 1.0
    spread = means((after - before - mean[parts]) ** 2, parts)
    error = np.sqrt(spread / np.maximum(np.bincount(parts) - 1, 1))
    return np.where((out < 0.0) & (mean > -error), 0.0, out)


def jackknife(tries: Array) -> Array:
    """Return the variance of a figure by what it is with each part left out, (parts, ...)."""
    count = len(tries)
    return np.asarray((count - 1) / count * ((tries - tries.mean(axis=0)) ** 2).sum(axis=0))
