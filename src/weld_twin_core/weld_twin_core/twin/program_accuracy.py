# Copyright 2026 weld_twin contributors
# SPDX-License-Identifier: Apache-2.0
"""How far the real tool will be from where a program means it, and how sure that is."""

from __future__ import annotations

from collections.abc import Sequence
from typing import NamedTuple

import numpy as np

from ..arrays import Array
from .program_correction import ProgramCorrection

DRAWS = 400
"""Enough for the 5th and 95th of a hundred to be steady within a few per cent."""
SPAN = (5.0, 95.0)
"""Percentiles between which nine of ten draws lie."""


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
        Nine of ten models that the recordings allow have their RMS between these; None where the
        model says nothing of how sure it is.
    same : (float, float) or None
        The same in the set-up that was recorded. Frames that were fitted to a recording take up
        much of an arm's errors there, which are seen again where the robot's own base counts.

    """

    rms: float
    worst: float
    low: float | None = None
    high: float | None = None
    same: tuple[float, float] | None = None


def accuracy(gaps: Sequence[Array], covariances: Sequence[Array | None]) -> Accuracy | None:
    """
    Return the accuracy over samples, or None without any.

    A model that is off is off alike over a seam, so one draw is the same at every sample.

    Parameters
    ----------
    gaps : sequence of array, each of shape (N, 6) [m, rad]
        What is missing by the model.
    covariances : sequence of array or None, each of shape (N, 6, 6)

    """
    gap = np.concatenate([np.zeros((0, 3)), *(g[:, :3] for g in gaps)])
    if not len(gap):
        return None
    rms, worst = _rms(gap), float(np.linalg.norm(gap, axis=1).max())
    if any(c is None for c in covariances):
        return Accuracy(rms, worst)
    factor = np.concatenate([_root(c[:, :3, :3]) for c in covariances if c is not None])
    low, high = np.percentile(_drawn_rms(gap, factor), SPAN)
    return Accuracy(
        float(np.hypot(rms, _rms(factor.reshape(-1, 9)))), worst, float(low), float(high)
    )


def likely_rms(gap: Array, covariances: Array, share: float) -> float:
    """
    Return the RMS distance [m] that stays within for a share of the models the recordings allow.

    Parameters
    ----------
    gap : array, shape (N, 6) [m, rad]
        What is missing by the model.
    covariances : array, shape (N, 6, 6)
    share : float
        Between 0 and 1.

    """
    return float(np.quantile(_drawn_rms(gap[:, :3], _root(covariances[:, :3, :3])), share))


def _drawn_rms(gap: Array, factor: Array) -> list[float]:
    """Return the RMS distance under drawn models, each off alike at all samples."""
    drawn = np.random.default_rng(0).standard_normal((DRAWS, 3))
    return [_rms(gap + factor @ z) for z in drawn]


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
    sure, own = (
        [None if c is None else c[keep] for c, keep in zip(each, chosen, strict=True)]
        for each in (found.covariances, found.of_the_arm)
    )
    before, after = (
        _widened(
            *(
                accuracy([g[keep] for g, keep in zip(gaps, chosen, strict=True)], each)
                for each in (sure, own)
            )
        )
        for gaps in (found.before, found.after)
    )
    return before, after


def _widened(same: Accuracy | None, own: Accuracy | None) -> Accuracy | None:
    """Return an accuracy whose interval holds in the set-up recorded and in the robot's own base."""
    if same is None or own is None or same.low is None or same.high is None:
        return same
    assert own.low is not None and own.high is not None
    low, high = min(same.low, own.low), max(same.high, own.high)
    return same._replace(low=low, high=high, same=(same.low, same.high))


def _ends(count: int, ends: np.ndarray) -> np.ndarray:
    out = np.zeros(count, dtype=bool)
    out[ends] = True
    return out


def _rms(gap: Array) -> float:
    return float(np.sqrt((gap**2).sum(axis=1).mean()))


def _root(covariance: Array) -> Array:
    """Return symmetric square roots, shape (N, 3, 3)."""
    values, vectors = np.linalg.eigh(covariance)
    size = np.sqrt(np.maximum(values, 0.0))
    return np.asarray((vectors * size[:, None, :]) @ np.swapaxes(vectors, -1, -2))
