# Copyright 2026 weld_twin contributors
# SPDX-License-Identifier: Apache-2.0
"""The tolerance stack by Monte Carlo: how far off the seam, and how often inside the weld's."""

from __future__ import annotations

from dataclasses import asdict, dataclass
from typing import Any

import numpy as np
from numpy.typing import NDArray
from scipy.special import bdtr, bdtrik, betaincinv

from ..arrays import Array
from ..errors import DataError
from .seam_study import Outcomes, refuse_unfinite

_PERCENTILES = (5.0, 25.0, 50.0, 75.0, 90.0, 95.0, 99.0)
"""Percentiles by which the distribution is reported [%]."""
_COVERAGE = 0.95
"""Confidence of the intervals of the percentiles."""


@dataclass(frozen=True)
class WeldTolerance:
    """How far off a weld may be."""

    across_m: float = 5e-4
    """Most to either side of the seam [m]; half a wire diameter suits MIG."""
    stickout_m: float = 1e-3
    """Most along the work normal, which changes the wire's free length [m]."""

    def __post_init__(self) -> None:
        if not (self.across_m > 0.0 and self.stickout_m > 0.0):
            raise DataError(
                f'weld tolerances must be positive, got {self.across_m} m across and '
                f'{self.stickout_m} m of stick-out'
            )


@dataclass(frozen=True)
class _Probability:
    """A frequency with its 95 % Clopper-Pearson interval."""

    value: float
    low: float
    high: float


@dataclass(frozen=True, eq=False)
class ToleranceStack:
    """What the tolerances add up to."""

    runs: int
    seed: int
    percentiles: dict[str, Array]
    """Value and 95 % interval at `_PERCENTILES`, by the number of `Outcomes`, shape (K, 3)."""
    inside_across: _Probability
    inside_stickout: _Probability
    inside_both: _Probability
    """That the whole seam stays inside the weld's tolerance."""
    tolerance: WeldTolerance

    @property
    def half(self) -> float:
        """Return the half-width of the widest of the three intervals: whether there were enough runs."""
        all_three = (self.inside_across, self.inside_stickout, self.inside_both)
        return max(0.5 * (p.high - p.low) for p in all_three)

    def as_dict(self) -> dict[str, Any]:
        """Return plain numbers and lists."""
        return {
            'runs': self.runs,
            'seed': self.seed,
            'tolerance': asdict(self.tolerance),
            'percentiles': {
                key: [
                    {'percent': p, 'value': float(v), 'low': float(a), 'high': float(b)}
                    for p, (v, a, b) in zip(_PERCENTILES, rows, strict=True)
                ]
                for key, rows in self.percentiles.items()
            },
            'inside': {
                'across': asdict(self.inside_across),
                'stickout': asdict(self.inside_stickout),
                'both': asdict(self.inside_both),
                'widest_half': self.half,
            },
        }


def probabilities(runs: int, inputs: int, seed: int = 0) -> Array:
    """
    Return independent probabilities, shape (runs, inputs).

    Parameters
    ----------
    runs : int
        At least 20.
    inputs : int
        Number of tolerances.
    seed : int

    Raises
    ------
    DataError
        Fewer than 20 runs.

    """
    if runs < 20:
        raise DataError(f'a tolerance stack needs at least 20 runs, got {runs}')
    return np.random.default_rng(seed).random((runs, inputs))


def tolerance_stack(
    result: Outcomes, tolerance: WeldTolerance | None = None, *, seed: int = 0
) -> ToleranceStack:
    """
    Return what independent runs say about the weld.

    Parameters
    ----------
    result : Outcomes
        Of runs at `probabilities`.
    tolerance : WeldTolerance, optional
        Left out, 0.5 mm across and 1 mm of stick-out.
    seed : int
        The runs' own, for the record.

    Raises
    ------
    DataError
        A result is not a number.

    """
    refuse_unfinite(np.stack(result, axis=1), 'tolerance stack')
    limits = tolerance or WeldTolerance()
    across, stickout = result.across_m <= limits.across_m, result.stickout_m <= limits.stickout_m
    keys = ('d_norm', 'max_m', 'across_m', 'stickout_m')
    return ToleranceStack(
        len(result.d_norm),
        seed,
        {key: _percentiles(getattr(result, key)) for key in keys},
        _frequency(across),
        _frequency(stickout),
        _frequency(across & stickout),
        limits,
    )


def _frequency(inside: np.ndarray) -> _Probability:
    hits, runs, tail = int(inside.sum()), inside.size, 0.5 * (1.0 - _COVERAGE)
    low = float(betaincinv(hits, runs - hits + 1, tail)) if hits else 0.0
    high = float(betaincinv(hits + 1, runs - hits, 1.0 - tail)) if hits < runs else 1.0
    return _Probability(hits / runs, low, high)


def _percentiles(values: Array) -> Array:
    """Return percentiles with the interval that order statistics give without a model."""
    ordered, runs, tail = np.sort(values), values.size, 0.5 * (1.0 - _COVERAGE)
    out = []
    for percent in _PERCENTILES:
        chance = np.array([tail, 1.0 - tail])
        low, high = np.clip(_ranks(chance, runs, percent / 100.0), 0, runs - 1)
        out.append([float(np.percentile(ordered, percent)), ordered[low], ordered[high]])
    return np.array(out)


def _ranks(chance: Array, runs: int, share: float) -> NDArray[np.intp]:
    """Return the least numbers of hits, of so many runs, that are exceeded with at most a chance."""
    # What scipy's distribution returns, without the half second that importing it takes.
    result = np.ceil(bdtrik(chance, runs, share))
    below = np.maximum(result - 1.0, 0.0)
    enough = bdtr(below, runs, share) >= chance
    return np.asarray(np.where(enough, below, result), dtype=np.intp)
