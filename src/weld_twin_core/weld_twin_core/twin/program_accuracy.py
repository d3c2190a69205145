# Copyright 2026 weld_twin contributors
# SPDX-License-Identifier: Apache-2.0
"""How far the real tool will be from where a program means it, and how sure that is."""

from __future__ import annotations

from collections.abc import Sequence
from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray

from ..arrays import Array
from .posterior import Drawn
from .program_correction import ProgramCorrection

_SPAN = (5.0, 95.0)
"""Percentiles between which nine of ten draws lie."""
SURE = 0.95
"""Probability from which on a tolerance counts as kept, or as not kept: what a guard band of ISO 14253-1
leaves to chance, five in a hundred."""


class Accuracy(NamedTuple):
    """Distance of the real tool from where it is wanted [m]."""

    rms: float
    """Expected; what the model is not sure of adds to it."""
    worst: float
    """By the model's own prediction."""
    low: float | None = None
    high: float | None = None
    """Nine of ten models that the recordings allow, and the one found, have their RMS between
    these, in the set-up recorded and in the robot's own base; None where the model says nothing of
    how sure it is."""
    same: tuple[float, float] | None = None
    """The same in the set-up that was recorded."""
    worsts: Array | None = None
    """Largest distance under every model, by set-up and by the robot's own base, (2, D) [m]."""

    def within(self, tolerance: float) -> float | None:
        """Return the probability that the tool stays within a tolerance [m] all the way."""
        if self.worsts is None:
            return None
        return float((self.worsts <= tolerance).mean(axis=1).min())

    def likely_within(self, probability: float) -> float | None:
        """Return the least tolerance [m] that is kept all the way with a probability."""
        if self.worsts is None:
            return None
        return float(np.quantile(self.worsts, probability, axis=1).max())

    @property
    def sure_within(self) -> float | None:
        """Return the least tolerance [m] that is kept all the way with `SURE` probability."""
        return self.likely_within(SURE)


def conforms(probability: float) -> str:
    """Return 'kept', 'not kept' or, within the guard band of ISO 14253-1, 'open' by a probability."""
    if probability >= SURE:
        return 'kept'
    return 'not kept' if probability <= 1.0 - SURE else 'open'


def accuracy(
    gaps: Sequence[Array], drawn: Sequence[Drawn | None], ways: Sequence[Array] | None = None
) -> Accuracy | None:
    """
    Return the accuracy over samples, or None without any.

    By the gaps (N, 6) [m, rad] of the model and what is drawn of the same samples, each of which
    stands for so much of the way (N,) [m]; all alike without.
    """
    gap = np.concatenate([np.zeros((0, 3)), *(g[:, :3] for g in gaps)])
    if not len(gap):
        return None
    share = np.ones(len(gap)) if ways is None else np.concatenate(ways)
    share = share / share.sum()
    square = (gap**2).sum(axis=1)
    rms, worst = float(np.sqrt(share @ square)), float(np.sqrt(square.max()))
    known = [d for d in drawn if d is not None]
    if len(known) < len(drawn):
        return Accuracy(rms, worst)
    pairs = [(g[:, :3], d) for g, d in zip(gaps, known, strict=True)]
    same, own = (
        _drawn([(g, d.near, d.off[:, where]) for g, d in pairs], share) for where in (0, 1)
    )
    # Drawn models are off by something everywhere. The one that was found, which may be off by
    # nothing, is allowed as well.
    low, high = np.percentile([same[0], own[0]], _SPAN, axis=1)
    low, high = np.minimum(low, rms), np.maximum(high, rms)
    return Accuracy(
        float(np.sqrt((same[0] ** 2).mean())),
        worst,
        float(low.min()),
        float(high.max()),
        (float(low[0]), float(high[0])),
        np.stack([same[1], own[1]]),
    )


def _drawn(
    parts: Sequence[tuple[Array, NDArray[np.int_], Array]], share: Array
) -> tuple[Array, Array]:
    """Return RMS and largest distance under every model drawn, shape (D,) each [m]."""
    squares = np.concatenate(
        [
            [((gap - off[near, k]) ** 2).sum(axis=1) for k in range(off.shape[1])]
            for gap, near, off in parts
        ],
        axis=1,
    )
    return np.sqrt(squares @ share), np.sqrt(squares.max(axis=1))


def along_seams(result: ProgramCorrection) -> tuple[Accuracy | None, Accuracy | None]:
    """Return the accuracy along corrected seams, before and after; of all moves without any."""
    pieces = result.looks
    ways = [_along(result, k) for k in range(len(pieces))]
    if not any(way.any() for way in ways):
        ways = [_ends(piece.motion.t.size, piece.ends) for piece in pieces]
    chosen = [way > 0.0 for way in ways]
    drawn = [
        None if d is None else d.where(keep) for d, keep in zip(result.drawn, chosen, strict=True)
    ]
    shares = [way[keep] for way, keep in zip(ways, chosen, strict=True)]
    before, after = (
        accuracy([g[keep] for g, keep in zip(gaps, chosen, strict=True)], drawn, shares)
        for gaps in (result.before, result.after)
    )
    return before, after


def _along(result: ProgramCorrection, k: int) -> Array:
    """Return how much of the way along corrected seams the samples of a piece stand for, (N,) [m]."""
    piece = result.looks[k]
    seams = [move.kind != 'joint' and move.seam not in result.left for move in piece.moves]
    steps = np.where(np.array(seams, dtype=bool)[piece.move], result.ways[k], 0.0)
    # A seam begins where the move before it ends.
    return np.asarray(0.5 * (steps + np.append(steps[1:], 0.0)))


def _ends(count: int, ends: np.ndarray) -> Array:
    out = np.zeros(count)
    out[ends] = 1.0
    return out
