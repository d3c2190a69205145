# Copyright 2026 weld_twin contributors
# SPDX-License-Identifier: Apache-2.0
"""Sparse regression on joint errors by the optimizer of PySINDy: a library of terms a joint."""

from __future__ import annotations

import warnings
from collections import defaultdict

import numpy as np
from pysindy.optimizers import STLSQ

from weld_twin_core.arm.chain import forward
from weld_twin_core.arrays import Array
from weld_twin_core.recording import JointMotion

from ...blind.scoring import rms
from ..course import ContestAnswer, ContestCase
from .geometry import as_causes, nominal, off

TERMS = ('joint_offset', 'transmission_ripple', 'transmission_ripple', 'servo_lag', 'backlash')
"""What a constant, a sine, a cosine, a velocity and its sign in a joint's error stand for."""
THRESHOLD = 2e-5
"""Terms that turn a joint by less [rad] are dropped: a tracker's noise at half a metre."""
RIDGE = 1e-6
"""PySINDy's damping of the least squares, against terms that are alike."""
STEP = 1e-6
"""Of the differences by which a joint's pull on the tool is found [rad]."""


def sparse_regression(case: ContestCase) -> ContestAnswer:
    """Return the terms that are left, by their share in the error, and what they predict."""
    measured = case.measured
    columns = _columns(case, case.train.joints, measured.t)
    asked = _columns(case, case.ask.joints, case.times)
    sizes = np.sqrt((columns**2).mean(axis=0)) + 1e-12
    # What a small turn is multiplied by: how far the tool is from the base.
    places = nominal(case, case.train.joints, measured.t)
    arm = np.repeat([rms(places - case.robot.T_world_base[:3, 3])], len(sizes))
    with warnings.catch_warnings():
        warnings.simplefilter('ignore')
        model = STLSQ(threshold=THRESHOLD, alpha=RIDGE, max_iter=30)
        model.fit(columns / sizes * arm, off(case).reshape(-1, 1))
    weights = np.asarray(model.coef_).ravel() / sizes * arm
    shares: dict[tuple[str, str | None], float] = defaultdict(float)
    for k, weight in enumerate(weights):
        joint, term = divmod(k, len(TERMS))
        if weight != 0.0:
            at = TERMS[term], case.robot.joint_names[joint]
            shares[at] += float(((columns[:, k] * weight) ** 2).mean())
    causes = as_causes(shares)
    predicted = nominal(case, case.ask.joints, case.times) + (asked @ weights).reshape(-1, 3)
    return ContestAnswer(predicted, causes, none=0.0 if causes else 1.0)


def _columns(case: ContestCase, motion: JointMotion, t: Array) -> Array:
    """Return how each term would move the tool, shape (3 M, joints x terms) [m]."""
    q, qd = motion.at(t)
    base = forward(case.robot, q)[:, :3, 3]
    out = []
    for k in range(case.robot.n):
        turned = q.copy()
        turned[:, k] += STEP
        pull = (forward(case.robot, turned)[:, :3, 3] - base) / STEP
        fast = max(float(np.abs(qd[:, k]).max(initial=0.0)), 1e-9)
        terms = (
            np.ones(t.size),
            np.sin(q[:, k]),
            np.cos(q[:, k]),
            qd[:, k],
            np.tanh(50 * qd[:, k] / fast),
        )
        out += [(pull * term[:, None]).ravel() for term in terms]
    return np.stack(out, axis=1)
