# Copyright 2026 weld_twin contributors
# SPDX-License-Identifier: Apache-2.0
"""
Global sensitivity: which errors matter at all (Morris), and what the scatter comes from (Sobol).

Designs, estimators and intervals are those of SALib as whole-array operations. SALib builds the designs
run by run, and resamples input by input; with a model that is fast that would be most of the time.
Results that are not numbers are refused.

References
----------
.. [1] M. D. Morris, "Factorial sampling plans for preliminary computational experiments",
   Technometrics 33(2), 1991.
.. [2] F. Campolongo, J. Cariboni, A. Saltelli, "An effective screening design for sensitivity
   analysis of large models", Environmental Modelling & Software 22, 2007: mu star.
.. [3] A. Saltelli et al., "Variance based sensitivity analysis of model output", Computer Physics
   Communications 181, 2010.
.. [4] G. Archer, A. Saltelli, I. Sobol, "Sensitivity measures, ANOVA-like techniques and the use
   of bootstrap", Journal of Statistical Computation and Simulation 58, 1997.

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
"""Of all intervals."""
_RESAMPLES = 100
"""Of the bootstrap behind them."""
_WIDTH = float(ndtri(0.5 + 0.5 * _CONFIDENCE))
"""Half of an interval over the standard deviation."""
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
        _refuse_negative(self.seed)

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
        half = _WIDTH * again.std(axis=1, ddof=1)
        return Screening(
            self.names,
            size.mean(axis=1),
            half,
            effects.std(axis=1, ddof=1),
            self.trajectories,
            values.size,
            self.seed,
        )


def _refuse_negative(seed: int) -> None:
    if seed < 0:
        raise DataError(f'a seed must not be negative, got {seed}')


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


_SETTLED = 0.05
"""Half-width and change of a total index below which a study counts as converged."""
_CONSTANT = np.finfo(np.float64).eps
"""Variance of standardised results that counts as none."""


@dataclass(frozen=True, eq=False)
class SobolIndices:
    """First-order and total indices of G inputs or groups of inputs."""

    names: tuple[str, ...]
    first: Array
    first_half: Array
    total: Array
    total_half: Array
    """Both indices with the half-widths of their 95 % intervals, shape (G,) each."""
    base_samples: int
    runs: int
    mean: float
    std: float
    """Of the result over the runs."""
    change: float
    """Largest change of a total index from half to all of the base samples."""
    converged: bool
    """Whether the change and every half-width of a total index are below `_SETTLED`."""
    seed: int

    def as_dict(self) -> dict[str, Any]:
        """Return plain numbers and lists."""
        columns = {'S1': self.first, 'S1_half': self.first_half}
        columns |= {'ST': self.total, 'ST_half': self.total_half}
        rows = [
            {'name': name, **{key: float(column[k]) for key, column in columns.items()}}
            for k, name in enumerate(self.names)
        ]
        return {
            'base_samples': self.base_samples,
            'runs': self.runs,
            'seed': self.seed,
            'confidence': _CONFIDENCE,
            'mean': self.mean,
            'std': self.std,
            'sum_S1': float(self.first.sum()),
            'converged': self.converged,
            'largest_ST_half': float(self.total_half.max()),
            'largest_ST_change': self.change,
            'indices': rows,
        }


@dataclass(frozen=True)
class SobolDesign:
    """Which runs Sobol indices need."""

    names: tuple[str, ...]
    base_samples: int = 1024
    """A power of two."""
    groups: tuple[str, ...] | None = None
    """Inputs of one group are drawn together and get one index."""
    seed: int = 0

    def __post_init__(self) -> None:
        n = self.base_samples
        if n < 16 or n & (n - 1):
            raise DataError(f'Sobol indices need a power of two of at least 16 samples, got {n}')
        _refuse_negative(self.seed)
        if len(set(self.names)) != len(self.names):
            raise DataError('two inputs of a sensitivity study have the same name')
        if self.groups is not None and len(self.groups) != len(self.names):
            raise DataError(
                f'{len(self.names)} inputs need as many groups, got {len(self.groups)}'
            )

    @property
    def labels(self) -> tuple[str, ...]:
        """Return what gets an index: the inputs, or the groups in order of appearance."""
        return tuple(dict.fromkeys(self.groups)) if self.groups else self.names

    def samples(self) -> Array:
        """Return probabilities of every input, shape (N (G + 2), P)."""
        inputs = len(self.names)
        first, second = _base_pair(inputs, self.base_samples, self.seed)
        return _mixed(first, second, self.groups).reshape(-1, inputs)

    def indices(self, results: Array) -> SobolIndices:
        """Return the indices of results in the order of `samples`; DataError for wrong or equal ones."""
        block = len(self.labels) + 2
        values = np.asarray(results, dtype=np.float64)
        if values.shape != (self.base_samples * block,):
            raise DataError(
                f'{self.base_samples * block} samples need as many results, got {values.shape}'
            )
        refuse_unfinite(values, 'Sobol indices')
        if np.ptp(values) == 0.0:
            raise DataError('the result is the same in all runs; there is no scatter to share out')
        runs = values.reshape(self.base_samples, block)
        first, total = _estimates(runs)
        rng = np.random.default_rng(self.seed)
        first_half, total_half = _half_widths(runs, rng)
        before = _estimates(runs[: self.base_samples // 2])[1]
        change = float(np.abs(total - before).max())
        settled = max(change, float(total_half.max())) < _SETTLED
        return SobolIndices(
            self.labels,
            first,
            first_half,
            total,
            total_half,
            self.base_samples,
            values.size,
            float(values.mean()),
            float(values.std()),
            change,
            settled,
            self.seed,
        )


def sobol_indices(
    function: Function,
    names: Sequence[str],
    base_samples: int = 1024,
    *,
    groups: Sequence[str] | None = None,
    seed: int = 0,
) -> SobolIndices:
    """
    Return the Sobol indices of a function of independent inputs.

    Parameters
    ----------
    function : callable
        Probabilities of every input, shape (D, P), to results, shape (D,).
    names, groups, base_samples, seed
        See `SobolDesign`.

    Raises
    ------
    DataError
        A result is not a number; see `SobolDesign.indices`.

    """
    design = SobolDesign(
        tuple(names), base_samples, None if groups is None else tuple(groups), seed
    )
    return design.indices(function(design.samples()))


def _base_pair(inputs: int, base: int, seed: int) -> tuple[Array, Array]:
    """Return two independent sets of probabilities (base, inputs), base a power of two."""
    from scipy.stats import qmc  # half a second, for nothing but this

    pair = qmc.Sobol(2 * inputs, scramble=True, seed=seed).random(base)
    return pair[:, :inputs], pair[:, inputs:]


def _mixed(first: Array, second: Array, groups: Sequence[str] | None = None) -> Array:
    """
    Return the runs of Saltelli's design, shape (base, G + 2, inputs), of the sets of `_base_pair`.

    Of the runs of one base sample the first is that of ``first``, the last that of ``second``, and
    run 1 + g is the first with the inputs of group g from the second. Every input is a group of
    its own unless ``groups`` names that of each; they count in order of appearance.
    """
    base, inputs = first.shape
    names = list(range(inputs)) if groups is None else list(groups)
    run = {name: 1 + g for g, name in enumerate(dict.fromkeys(names))}
    out = np.empty((base, len(run) + 2, inputs))
    out[:, :-1] = first[:, None]
    out[:, -1] = second
    out[:, [run[name] for name in names], np.arange(inputs)] = second
    return out


def _estimates(results: Array) -> tuple[Array, Array]:
    """Return first-order and total indices, shape (G,), of results (base, G + 2)."""
    own, total, ends = _terms(results)
    weights = np.full((1, len(results)), 1.0 / len(results))
    first, whole = _indices(weights, own, total, ends)
    return first[0], whole[0]


def _half_widths(results: Array, rng: np.random.Generator) -> tuple[Array, Array]:
    """Return half-widths of both indices' intervals, (G,), by the bootstrap [4]_."""
    base = len(results)
    picks = rng.integers(base, size=(base, _RESAMPLES)) + base * np.arange(_RESAMPLES)
    counts = np.bincount(picks.ravel(), minlength=base * _RESAMPLES).reshape(_RESAMPLES, base)
    first, total = _indices(counts / base, *_terms(results))
    return _WIDTH * first.std(axis=0, ddof=1), _WIDTH * total.std(axis=0, ddof=1)


def _terms(results: Array) -> tuple[Array, Array, Array]:
    """Return what is averaged over base samples: both indices' terms (base, G), and A and B."""
    values = (results - results.mean()) / results.std()
    ends = values[:, [0, -1]]
    change = values[:, 1:-1] - ends[:, :1]
    return ends[:, 1:] * change, 0.5 * change * change, ends


def _indices(weights: Array, own: Array, total: Array, ends: Array) -> tuple[Array, Array]:
    """Return both indices, shape (R, G), of base samples weighted (R, base)."""
    mean = (weights @ ends).mean(axis=1)
    scatter = ((weights @ (ends * ends)).mean(axis=1) - mean * mean)[:, None]
    some = scatter > _CONSTANT
    first, whole = weights @ own, weights @ total
    return (
        np.divide(first, scatter, out=np.zeros_like(first), where=some),
        np.divide(whole, scatter, out=np.zeros_like(whole), where=some),
    )
