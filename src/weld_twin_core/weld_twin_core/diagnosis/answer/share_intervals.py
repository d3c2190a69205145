# Copyright 2026 weld_twin contributors
# SPDX-License-Identifier: Apache-2.0
"""
How sure the shares of named causes are, for the motion that was recorded.

Three doubts are drawn together: the coordinates of all causes, which hang together as their columns
do; how much of what is left above the noise belongs to the causes; and how large the noise is and how
it happens to lie along the gap. Members of a set move the tool alike: which of them it is changes no
share. Every draw is parted as the shares themselves are.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import replace

import numpy as np

from ...arrays import Array
from ..algebra.fit import trusted
from ..algebra.independent_rows import effective_share
from ..algebra.problem import Problem, Scale
from ..hypotheses.search import Search
from ..levels.causes import covering
from ..result import Cause
from ..unseen.unseen_stretches import Unseen
from ..verdict.decision import Verdict
from .named_effects import covariance, idealised

_DRAWS = 1000
"""Enough for the ends of an interval to be good to a few per cent of its width."""
_SEED = 1
"""Of the draws: the same recordings give the same intervals."""
_ENDS = (0.05, 0.95)
"""Quantiles between which nine draws of ten lie."""
TOLD = 5e-4
"""Half of the last digit of a share as pages tell it, 0.1 %: no interval is finer."""


def with_intervals(
    reported: Sequence[Cause], result: Search, unseen: Unseen, verdict: Verdict, floor: float
) -> tuple[Cause, ...]:
    """
    Return causes with the 90 % intervals of their shares, above a noise of RMS ``floor`` [m].

    Where curves or many small errors stand for the causes, intervals are those that stretches
    tell.
    """
    curved = len(result.slots) != len(unseen.parts)
    if verdict.status == 'unknown' or curved or not any(result.slots) or not unseen.parts:
        return tuple(covering(cause) for cause in reported)
    tries = _tries(result, unseen, floor)
    return tuple(
        covering(cause) if cause.rest else _held(cause, tries[:, list(cause.members)].sum(axis=1))
        for cause in reported
    )


def _held(cause: Cause, tries: Array) -> Cause:
    """Return a cause whose interval holds its own share and nine tries of ten."""
    low, high = np.quantile(tries, _ENDS)
    low, high = min(low, cause.share) - TOLD, max(high, cause.share) + TOLD
    return replace(cause, share_ci90=(float(max(low, 0.0)), float(min(high, 1.0))))


def _tries(result: Search, unseen: Unseen, floor: float) -> Array:
    """Return draws of the share of every effect, (_DRAWS, K)."""
    rng = np.random.default_rng(_SEED)
    before = float(unseen.squares(unseen.bare).mean())
    after = float(unseen.squares(unseen.whole).mean())
    noise = min(floor**2, after)
    moved = _coordinates(rng, result, (after - noise) / max(after, 1e-300))
    parted = _parted(_along(unseen, moved))
    unsure = _noise_unsure(result, unseen, noise, before, after)
    # Of what is left above the noise any part may be the causes'.
    remaining = rng.uniform(noise, after, _DRAWS) + unsure * rng.standard_normal(_DRAWS)
    explained = 1.0 - remaining[:, None] / before
    return parted * explained


def _coordinates(rng: np.random.Generator, result: Search, missed: float) -> Array:
    """
    Return how far the coordinates of all effects may be off, (DRAWS, K).

    A share of what is left is missed and no noise: it spreads over as many directions as what
    formulas are believed to miss.
    """
    rows = result.small.residual.size
    doubt = (
        1.0 / max(result.effective(result.small), 1.0)
        + missed / result.work.beliefs.misfit_directions
    )
    model = result.final.model
    spread = covariance(
        result.problem, model, result.scale, result.precision, 1.0 / (rows * doubt)
    )
    # A coordinate on a bound, or that the data do not show, stays.
    spread = np.nan_to_num(spread) + np.diag(
        np.concatenate([idealised(effect) for effect in model.found]) ** 2
    )
    variances, ways = np.linalg.eigh(spread)
    unit = rng.standard_normal((_DRAWS, variances.size))
    return np.asarray(unit @ (ways * np.sqrt(np.maximum(variances, 0.0))).T)


def _along(unseen: Unseen, moved: Array) -> Array:
    """Return how far each effect moves the tool along with all of them, (_DRAWS, K) [m^2]."""
    count, first = len(unseen.parts), unseen.frames
    own_columns = unseen.columns.chosen(np.arange(first, unseen.columns.count)).written_out()
    rows = (*unseen.targets[1:], *own_columns)
    each = np.array([_positions(unseen.problem, unseen.scale, row) for row in rows])
    products = each @ each.T
    together = np.hstack([np.ones((len(moved), count)), moved]) @ products
    out = together[:, :count].copy()
    for k, part in enumerate(unseen.parts):
        own = slice(part.start - first, part.stop - first)
        out[:, k] += (together[:, count:][:, own] * moved[:, own]).sum(axis=1)
    return np.asarray(out)


def _parted(along: Array) -> Array:
    """Return the part of every effect in what all explain; none where one works against them."""
    sizes = np.maximum(along, 0.0)
    return np.asarray(sizes / np.maximum(sizes.sum(axis=-1, keepdims=True), 1e-300))


def _noise_unsure(
    result: Search, unseen: Unseen, noise: float, before: float, after: float
) -> float:
    """Return how far off the noise's part of the gap may be, standard deviation [m^2]."""
    share = effective_share(result.final.residual, result.problem.rows, result.problem.samples)
    count = 3.0 * share * unseen.trusted_labels().size
    # It happens to lie along the gap or against it; and its square is known from so many rows.
    along = 2.0 * np.sqrt(noise * before / count) * after / before
    return float(np.hypot(along, noise * np.sqrt(2.0 / count)))


def _positions(problem: Problem, scale: Scale, rows: Array) -> Array:
    """Return the position part of whitened rows in every trusted sample, (3 samples,) [m]."""
    parts = zip(problem.measured_rows(rows, scale), trusted(scale.weights), strict=True)
    return np.concatenate([part[good, :3].ravel() for part, good in parts])
