# Copyright 2026 weld_twin contributors
# SPDX-License-Identifier: Apache-2.0
"""
Logistic regression with a ridge and with signs that weights may not change.

A sign that should raise belief may not lower it because of chance in a few hundred cases: weights
are bounded on one side of zero, which makes belief monotone in what is known to be good or bad
news.
"""

from __future__ import annotations

from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray
from scipy.optimize import minimize

from weld_twin_core.arrays import Array


class Weights(NamedTuple):
    """Bias and weights, on columns of mean zero and spread one."""

    bias: float
    slopes: Array


def fitted(
    columns: Array,
    right: Array | NDArray[np.bool_],
    signs: Array,
    ridge: float,
    weight: Array,
    prior: Array | None = None,
    near: Weights | None = None,
) -> Weights:
    """
    Return the weights of least penalised log loss.

    columns: standardised, shape (N, P).
    right: shape (N,).
    signs: 1 where a weight may not be negative, -1 where it may not be positive, 0 where it is
    free, shape (P,).
    ridge: of half the squared distance from the prior, against log loss in nats.
    weight: of every example, shape (N,).
    prior: weights that the ridge pulls to, shape (P,); zeros when left out.
    near: weights to begin with, where those of nearly the same examples are known.
    """
    prior = np.zeros(columns.shape[1]) if prior is None else prior
    # One more case of each outcome, with every sign at its middle: few cases are never certain.
    columns = np.concatenate([columns, np.zeros((2, columns.shape[1]))])
    target = np.concatenate([np.asarray(right, dtype=float), [0.0, 1.0]])
    weight = np.concatenate([weight, [1.0, 1.0]])
    share = float(np.clip((weight * target).sum() / weight.sum(), 0.02, 0.98))

    def loss(x: Array) -> tuple[float, Array]:
        odds = x[0] + columns @ x[1:]
        off = x[1:] - prior
        value = (weight * (np.logaddexp(0.0, odds) - target * odds)).sum()
        error = weight * (1.0 / (1.0 + np.exp(-odds)) - target)
        slope = np.concatenate([[error.sum()], columns.T @ error + ridge * off])
        return float(value + 0.5 * ridge * off @ off), slope

    bounds = [(None, None)] + [
        (0.0 if sign > 0 else None, 0.0 if sign < 0 else None) for sign in signs
    ]
    near = near or Weights(float(np.log(share / (1.0 - share))), prior)
    start = np.concatenate([[near.bias], near.slopes])
    solution = minimize(loss, start, jac=True, bounds=bounds, method='L-BFGS-B')
    return Weights(float(solution.x[0]), np.asarray(solution.x[1:]))


def log_loss(probability: Array, right: Array | NDArray[np.bool_], weight: Array) -> float:
    """
    Return the mean log loss in nats.

    probability, right, weight: shape (N,).
    """
    clipped = np.clip(probability, 1e-4, 1.0 - 1e-4)
    loss = -np.where(np.asarray(right, dtype=bool), np.log(clipped), np.log(1.0 - clipped))
    return float((weight * loss).sum() / weight.sum())
