# Copyright 2026 weld_twin contributors
# SPDX-License-Identifier: Apache-2.0
"""
Morris screening: which of many errors matter at all, in a few runs for each.

Design, measures and intervals are those of SALib, in whole-array form.

References
----------
.. [1] M. D. Morris, "Factorial sampling plans for preliminary computational experiments",
   Technometrics 33(2), 1991.
.. [2] F. Campolongo, J. Cariboni, A. Saltelli, "An effective screening design for sensitivity
   analysis of large models", Environmental Modelling & Software 22, 2007: mu star.

"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
from typing import Any

import numpy as np
from scipy.special import ndtri

from ..arrays import Array
from ..errors import DataError
from .evaluate import Function
from .seam_study import refuse_unfinite

_LEVELS = 8
"""Levels of the grid of each input; even, as the method wants, so that all are visited alike."""
_STEP = _LEVELS / (2.0 * (_LEVELS - 1.0))
"""How far an input moves at a time, as a part of the grid: as the method wants [1]_."""
_CONFIDENCE = 0.95
"""Of the intervals of mu star."""
_RESAMPLES = 100
"""Of the bootstrap behind them."""
_MARGIN = 0.02
"""Probability left out at either end, where a normal distribution is infinitely far out."""


@dataclass(frozen=True, eq=False)
class Screening:
    """Elementary effects of P inputs over the range of their tolerance."""

    names: tuple[str, ...]
    mu_star: Array
    mu_star_half: Array
    sigma: Array
    """Mean size of the effect with the half-width of its 95 % interval, and its scatter, shape
    (P,); in the unit of the result."""
    trajectories: int
    runs: int
    seed: int

    def as_dict(self) -> dict[str, Any]:
        """Return plain numbers and lists."""
        columns = ('mu_star', 'mu_star_half', 'sigma')
        rows = [
            {'name': name, **{key: float(getattr(self, key)[k]) for key in columns}}
            for k, name in enumerate(self.names)
        ]
        counts = {key: getattr(self, key) for key in ('trajectories', 'runs', 'seed')}
        return {**counts, 'indices': rows}


@dataclass(frozen=True)
class MorrisDesign:
    """Which runs Morris screening needs."""

    names: tuple[str, ...]
    trajectories: int = 50
    """Every one costs P + 1 runs."""
    seed: int = 0

    def __post_init__(self) -> None:
        if self.trajectories < 2:
            raise DataError(
                f'Morris screening needs at least 2 trajectories, got {self.trajectories}'
            )
        if self.seed < 0:
            raise DataError(f'a seed must not be negative, got {self.seed}')

    def samples(self) -> Array:
        """Return probabilities of every input, shape (trajectories (P + 1), P)."""
        rng = _numbers(self.seed, 0)
        each = [_trajectory(len(self.names), rng) for _ in range(self.trajectories)]
        return np.concatenate(each) * (1.0 - 2.0 * _MARGIN) + _MARGIN

    def screening(self, results: Array) -> Screening:
        """Return the measures of results in the order of `samples`; DataError for no number."""
        values = np.asarray(results, dtype=np.float64)
        refuse_unfinite(values, 'Morris screening')
        inputs = len(self.names)
        steps = np.diff(self.samples().reshape(self.trajectories, inputs + 1, inputs), axis=1)
        change = np.diff(values.reshape(self.trajectories, inputs + 1), axis=1)
        # One input moves at a time: its step says at which place of the trajectory, and whereto.
        effects = np.einsum('tk,tkp->pt', change, np.sign(steps)) / _STEP
        rng = _numbers(self.seed, 1)
        picks = rng.integers(self.trajectories, size=(inputs, _RESAMPLES, self.trajectories))
        size = np.abs(effects)
        again = np.take_along_axis(size[:, None], picks, axis=-1).mean(axis=-1)
        half = float(ndtri(0.5 + 0.5 * _CONFIDENCE)) * again.std(axis=1, ddof=1)
        return Screening(
            self.names,
            size.mean(axis=1),
            half,
            effects.std(axis=1, ddof=1),
            self.trajectories,
            values.size,
            self.seed,
        )


def _numbers(seed: int, which: int) -> np.random.Generator:
    """Return the generator that SALib 1.6 makes of one with this seed."""
    return np.random.default_rng([seed, which]).spawn(1)[0]


def _trajectory(inputs: int, rng: np.random.Generator) -> Array:
    """Return one way through the grid, shape (P + 1, P), on which every input moves once."""
    order = np.eye(inputs)
    rng.shuffle(order)
    way = rng.choice([-1, 1], inputs)
    start = rng.choice(np.linspace(0.0, 1.0 - _STEP, _LEVELS // 2), inputs)
    moved = np.tril(np.ones((inputs + 1, inputs)), -1) @ order.T
    out: Array = start + 0.5 * _STEP * ((2.0 * moved - 1.0) * way + 1.0)
    return out


def morris_screening(
    function: Function, names: Sequence[str], trajectories: int = 50, *, seed: int = 0
) -> Screening:
    """
    Return the Morris measures of a function of independent inputs.

    Parameters
    ----------
    function : callable
        Probabilities of every input, shape (D, P), to results, shape (D,).
    names, trajectories, seed
        See `MorrisDesign`.

    Raises
    ------
    DataError
        A result is not a number, or fewer than two trajectories.

    """
    design = MorrisDesign(tuple(names), trajectories, seed)
    return design.screening(function(design.samples()))
