# Copyright 2026 weld_twin contributors
# SPDX-License-Identifier: Apache-2.0
"""Black boxes of scikit-learn, from joints to the error of the nominal arm; they name nothing."""

from __future__ import annotations

import warnings
from collections.abc import Callable

import numpy as np

from weld_twin_core.arm.chain import forward
from weld_twin_core.arrays import Array
from weld_twin_core.recording import JointMotion

from ..case import ContestAnswer, ContestCase

Learn = Callable[[Array, Array, Array], Array]
"""
Takes features (N, k), errors of the nominal arm there (N, 3) [m] and the features asked for (M, k);
returns the errors there (M, 3) [m].
"""
MOST = 300
"""Samples that a Gaussian process keeps, spread evenly: the work grows with their cube."""


def never_knows(case: ContestCase) -> ContestAnswer:
    """Return the nominal arm, and that the cause is unknown: the scale of saying nothing."""
    return ContestAnswer(nominal(case, case.ask.joints, case.times), unknown=1.0)


def gaussian_process(case: ContestCase) -> ContestAnswer:
    """Return the nominal arm plus what the process adds; its scales by likelihood, as advised."""
    from sklearn.exceptions import ConvergenceWarning
    from sklearn.gaussian_process import GaussianProcessRegressor
    from sklearn.gaussian_process.kernels import RBF, WhiteKernel
    from sklearn.pipeline import make_pipeline
    from sklearn.preprocessing import StandardScaler

    def learn(known: Array, error: Array, asked: Array) -> Array:
        kernel = 1.0 * RBF(3.0) + WhiteKernel(0.1)
        process = make_pipeline(
            StandardScaler(), GaussianProcessRegressor(kernel, normalize_y=True, random_state=0)
        )
        with warnings.catch_warnings():
            warnings.simplefilter('ignore', ConvergenceWarning)
            process.fit(known, error)
        return np.asarray(process.predict(asked))

    return _answer(case, learn, MOST)


def boosted_trees(case: ContestCase) -> ContestAnswer:
    """Return the nominal arm plus what three sets of trees add, with early stopping as advised."""
    from sklearn.ensemble import HistGradientBoostingRegressor

    def learn(known: Array, error: Array, asked: Array) -> Array:
        trees = HistGradientBoostingRegressor(early_stopping=True, random_state=0)
        return np.stack([trees.fit(known, part).predict(asked) for part in error.T], axis=1)

    return _answer(case, learn)


def _answer(case: ContestCase, learn: Learn, most: int | None = None) -> ContestAnswer:
    """
    Return the nominal arm plus what a learner adds.

    most: samples that it learns from, spread evenly; left out, all.
    """
    count = case.measured.t.size
    rows = np.unique(np.linspace(0, count - 1, most or count).astype(int))
    known = features(case.train.joints, case.measured.t[rows])
    added = learn(known, off(case)[rows], features(case.ask.joints, case.times))
    return ContestAnswer(nominal(case, case.ask.joints, case.times) + added, unknown=1.0)


def nominal(case: ContestCase, motion: JointMotion, t: Array) -> Array:
    """Return where the nominal tool is, shape (M, 3) [m]."""
    q, _ = motion.at(t)
    return np.asarray(forward(case.robot, q)[:, :3, 3])


def off(case: ContestCase) -> Array:
    """Return measured minus nominal position, shape (M, 3) [m]."""
    measured = case.measured
    return np.asarray(measured.position - nominal(case, case.train.joints, measured.t))


def features(motion: JointMotion, t: Array) -> Array:
    """Return sine and cosine of the angles, and, of a motion, velocities and their signs."""
    q, qd = motion.at(t)
    columns = [np.sin(q), np.cos(q)]
    if not motion.static:
        columns += [qd, np.tanh(qd / max(1e-9, 0.02 * float(np.abs(qd).max(initial=0.0))))]
    return np.hstack(columns)
