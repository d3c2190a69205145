# Copyright 2026 weld_twin contributors
# SPDX-License-Identifier: Apache-2.0
"""
Saltelli's design, the estimators of Sobol indices and their intervals as whole-array operations.

The same as SALib's, which builds the design run by run, and _RESAMPLES input by input; with a model
as fast as `draws` that would be most of the time. The tests hold them against SALib.

References
----------
.. [1] A. Saltelli et al., "Variance based sensitivity analysis of model output", Computer Physics
   Communications 181, 2010.
.. [2] G. Archer, A. Saltelli, I. Sobol, "Sensitivity measures, ANOVA-like techniques and the use
   of bootstrap", Journal of Statistical Computation and Simulation 58, 1997.

"""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np
from scipy.special import ndtri

from ..arrays import Array

_RESAMPLES = 100
"""Of the bootstrap."""
_CONSTANT = np.finfo(np.float64).eps
"""Variance of standardised results that counts as none."""


def base_pair(inputs: int, base: int, seed: int) -> tuple[Array, Array]:
    """Return two independent sets of probabilities (base, inputs), base a power of two."""
    from scipy.stats import qmc  # half a second, for nothing but this

    pair = qmc.Sobol(2 * inputs, scramble=True, seed=seed).random(base)
    return pair[:, :inputs], pair[:, inputs:]


def mixed(first: Array, second: Array, groups: Sequence[str] | None = None) -> Array:
    """
    Return the runs of Saltelli's design, shape (base, G + 2, inputs), of the sets of `base_pair`.

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


def sobol_estimates(results: Array) -> tuple[Array, Array]:
    """Return first-order and total indices, shape (G,), of results (base, G + 2)."""
    own, total, ends = _terms(results)
    weights = np.full((1, len(results)), 1.0 / len(results))
    first, whole = _indices(weights, own, total, ends)
    return first[0], whole[0]


def sobol_half_widths(
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
