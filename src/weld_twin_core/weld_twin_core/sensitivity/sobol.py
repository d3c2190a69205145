# Copyright 2026 weld_twin contributors
# SPDX-License-Identifier: Apache-2.0
"""
Sobol indices: which error the scatter of the deviation comes from, alone and with the others.

Design, estimators and intervals are those of SALib as whole-array operations. SALib builds the
design run by run, and resamples input by input; with a model that is fast that would be most of the
time. Results that are not numbers are refused.

References
----------
.. [1] A. Saltelli et al., "Variance based sensitivity analysis of model output", Computer Physics
   Communications 181, 2010.
.. [2] G. Archer, A. Saltelli, I. Sobol, "Sensitivity measures, ANOVA-like techniques and the use
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

_CONFIDENCE = 0.95
"""Of the intervals of the indices."""
_SETTLED = 0.05
"""Half-width and change of a total index below which a study counts as converged."""
_RESAMPLES = 100
"""Of the bootstrap."""
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
        if self.seed < 0:
            raise DataError(f'a seed must not be negative, got {self.seed}')
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
        first_half, total_half = _half_widths(runs, _CONFIDENCE, rng)
        before = _estimates(runs[: self.base_samples // 2])[1]
        change = float(np.abs(total - before).max())
        settled = max(change, float(total_half.max())) < _SETTLED
        return SobolIndices(
            names=self.labels,
            first=first,
            first_half=first_half,
            total=total,
            total_half=total_half,
            base_samples=self.base_samples,
            runs=values.size,
            mean=float(values.mean()),
            std=float(values.std()),
            change=change,
            converged=settled,
            seed=self.seed,
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


def _half_widths(
    results: Array, confidence: float, rng: np.random.Generator
) -> tuple[Array, Array]:
    """Return half-widths of both indices' intervals, (G,), by the bootstrap [2]_."""
    base = len(results)
    picks = rng.integers(base, size=(base, _RESAMPLES)) + base * np.arange(_RESAMPLES)
    counts = np.bincount(picks.ravel(), minlength=base * _RESAMPLES).reshape(_RESAMPLES, base)
    width = float(ndtri(0.5 + confidence / 2.0))
    first, total = _indices(counts / base, *_terms(results))
    return width * first.std(axis=0, ddof=1), width * total.std(axis=0, ddof=1)


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
