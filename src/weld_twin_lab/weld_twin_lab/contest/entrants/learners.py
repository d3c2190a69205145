# Copyright 2026 weld_twin contributors
# SPDX-License-Identifier: Apache-2.0
"""Learners of scikit-learn, from joints to error: black boxes that name nothing."""

from __future__ import annotations

import warnings

import numpy as np
from sklearn.ensemble import HistGradientBoostingRegressor
from sklearn.exceptions import ConvergenceWarning
from sklearn.gaussian_process import GaussianProcessRegressor
from sklearn.gaussian_process.kernels import RBF, WhiteKernel
from sklearn.linear_model import BayesianRidge
from sklearn.pipeline import make_pipeline
from sklearn.preprocessing import StandardScaler

from weld_twin_core.arrays import Array

from ..course import ContestAnswer, ContestCase
from .geometry import answer_of

MOST = 300
"""Samples that a Gaussian process keeps, spread evenly: the work grows with their cube."""


def bayesian_linear(case: ContestCase) -> ContestAnswer:
    """Return the nominal arm plus what a linear regression adds, and how sure it says it is."""

    def learn(known: Array, error: Array, asked: Array) -> tuple[Array, Array]:
        predictions = []
        # In millimetres: what is believed of precisions beforehand is meant for numbers about one.
        for column in 1e3 * error.T:
            each = make_pipeline(StandardScaler(), BayesianRidge()).fit(known, column)
            predictions.append(each.predict(asked, return_std=True))
        added, sigma = 1e-3 * np.transpose(predictions, (1, 2, 0))
        return added, sigma

    return answer_of(case, learn)


def boosted_trees(case: ContestCase) -> ContestAnswer:
    """Return the nominal arm plus what three sets of trees add, with early stopping as advised."""
    trees = HistGradientBoostingRegressor(early_stopping=True, random_state=0)

    def learn(known: Array, error: Array, asked: Array) -> tuple[Array, None]:
        return np.stack([trees.fit(known, part).predict(asked) for part in error.T], axis=1), None

    return answer_of(case, learn)


def gaussian_process(case: ContestCase) -> ContestAnswer:
    """Return the nominal arm plus what a process adds; its scales by likelihood, as advised."""
    kernel = 1.0 * RBF(3.0) + WhiteKernel(0.1)
    process = make_pipeline(
        StandardScaler(), GaussianProcessRegressor(kernel, normalize_y=True, random_state=0)
    )

    def learn(known: Array, error: Array, asked: Array) -> tuple[Array, Array]:
        with warnings.catch_warnings():
            warnings.simplefilter('ignore', ConvergenceWarning)
            process.fit(known, error)
        added, sigma = process.predict(asked, return_std=True)
        return added, sigma

    return answer_of(case, learn, MOST)
