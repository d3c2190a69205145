# Copyright 2026 weld_twin contributors
# SPDX-License-Identifier: Apache-2.0
"""How far the real tool will be from where a program means it, and how sure that is."""

from __future__ import annotations

from collections.abc import Sequence
from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray

from ..arrays import Array
from .drawn import Drawn
from .program_correction import ProgramCorrection

SPAN = (5.0, 95.0)
"""Percentiles between which nine of ten draws lie."""
SURE = 0.95
"""Probability from which on a tolerance counts as kept, or as not kept: what a guard band of ISO 14253-1
leaves to chance, five in a hundred."""


class Accuracy(NamedTuple):
    """
    Distance of the real tool from where it is wanted [m].

    Attributes
    ----------
    rms : float
        Expected; what the model is not sure of adds to it.
    worst : float
        By the model's own prediction.
    low, high : float or None
        Nine of ten models that the recordings allow have their RMS between these, in the set-up
        recorded and in the robot's own base; None where the model says nothing of how sure it is.
    same : (float, float) or None
        The same in the set-up that was recorded.
    worsts : array, shape (2, D), optional [m]
        Largest distance under every model drawn, in the set-up recorded and in the robot's own base.

    """

    rms: float
    worst: float
    low: float | None = None
    high: float | None = None
    same: tuple[float, float] | None = None
    worsts: Array | None = None

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
    """
    Return 'kept', 'not kept' or 'open' as ISO 14253-1 decides with a probability of conformity.

    Within the guard band neither conformity nor the contrary is proven.
    """
    if probability >= SURE:
        return 'kept'
    return 'not kept' if probability <= 1.0 - SURE else 'open'


def accuracy(gaps: Sequence[Array], drawn: Sequence[Drawn | None]) -> Accuracy | None:
    """
    Return the accuracy over samples, or None without any.

    Parameters
    ----------
    gaps : sequence of array, each of shape (N, 6) [m, rad]
        What is missing by the model.
    drawn : sequence of Drawn or None
        Of the same samples.

    """
    gap = np.concatenate([np.zeros((0, 3)), *(g[:, :3] for g in gaps)])
    if not len(gap):
        return None
    rms, worst = _rms(gap), float(np.linalg.norm(gap, axis=1).max())
    known = [d for d in drawn if d is not None]
    if len(known) < len(drawn):
        return Accuracy(rms, worst)
    pairs = [(g[:, :3], d) for g, d in zip(gaps, known, strict=True)]
    same = _drawn([(g, d.near, d.same) for g, d in pairs])
    own = _drawn([(g, d.near, d.own) for g, d in pairs])
    ends = np.percentile([same[0], own[0]], SPAN, axis=1)
    return Accuracy(
        float(np.sqrt((same[0] ** 2).mean())),
        worst,
        float(ends[0].min()),
        float(ends[1].max()),
        (float(ends[0, 0]), float(ends[1, 0])),
        np.stack([same[1], own[1]]),
    )


def _drawn(parts: Sequence[tuple[Array, NDArray[np.int_], Array]]) -> tuple[Array, Array]:
    """Return RMS and largest distance under every model drawn, shape (D,) each [m]."""
    squares = np.concatenate(
        [
            [((gap - off[near, k]) ** 2).sum(axis=1) for k in range(off.shape[1])]
            for gap, near, off in parts
        ],
        axis=1,
    )
    return np.sqrt(squares.mean(axis=1)), np.sqrt(squares.max(axis=1))


def along_seams(found: ProgramCorrection) -> tuple[Accuracy | None, Accuracy | None]:
    """Return the accuracy along corrected seams, before and after; of all moves without any."""
    chosen = [
        np.array(
            [m.kind != 'joint' and m.seam not in found.left for m in piece.moves], dtype=bool
        )[piece.move]
        for piece in found.travel.pieces
    ]
    if not any(keep.any() for keep in chosen):
        chosen = [_ends(piece.motion.t.size, piece.ends) for piece in found.travel.pieces]
    drawn = [
        None if d is None else d.where(keep) for d, keep in zip(found.drawn, chosen, strict=True)
    ]
    before, after = (
        accuracy([g[keep] for g, keep in zip(gaps, chosen, strict=True)], drawn)
        for gaps in (found.before, found.after)
    )
    return before, after


def _ends(count: int, ends: np.ndarray) -> np.ndarray:
    out = np.zeros(count, dtype=bool)
    out[ends] = True
    return out


def _rms(gap: Array) -> float:
    return float(np.sqrt((gap**2).sum(axis=1).mean()))
