# SPDX-FileCopyrightText: weld_twin contributors
# SPDX-License-Identifier: Apache-2.0
"""
What the model leaves on postures left out of the fit, beyond what open directions account for.

The recordings are cut into blocks of like posture. Each block in turn is predicted by the model
fitted on the others; what is left over is as large as makes nine of ten of those predictions hold.
"""

from __future__ import annotations

from collections.abc import Callable

import numpy as np
from scipy.stats import chi2

from ...arrays import Array
from ...twin.posterior import Leftover
from ..algebra.fit import solve_scaled
from ..algebra.noise_floor import noise_floor
from ..algebra.problem import Problem, Scale

BLOCKS = 8
HOLD = 0.9
"""Share of unseen postures that their regions shall hold."""


def posture_blocks(problem: Problem) -> Array:
    """
    Return a block number for every row: neighbours in joint space, whenever they were visited.

    Halved three times at the median of the direction in which the joints vary most.
    """
    joints = [
        r.joints.at(r.measured.t)[0] for r in problem.recordings if r.measured is not None
    ]
    q = np.concatenate(joints)
    labels = np.zeros(q.shape[0], dtype=int)
    for _ in range(int(np.log2(BLOCKS))):
        halves = labels * 2
        for k in np.unique(labels):
            mine = np.flatnonzero(labels == k)
            centred = q[mine] - q[mine].mean(axis=0)
            along = centred @ np.linalg.svd(centred, full_matrices=False)[2][0]
            upper = np.argsort(along, kind='stable')[mine.size // 2 :]
            halves[mine[upper]] += 1
        labels = halves
    counts = np.repeat(problem.rows, problem.samples)
    return np.repeat(labels, counts)


def leftover(
    problem: Problem,
    scale: Scale,
    rows,
    own: Array,
    precision: Array,
    pull: Array,
    labels: Array,
    given: Callable[[Array], tuple[Array, Array]],
) -> Leftover:
    errors = rows.residual.copy()
    normal = own @ own.T + np.diag(precision)
    right = own @ rows.residual - pull
    cov = []
    index = []
    for b in np.unique(labels):
        out = labels == b
        mine = own[:, out]
        step = solve_scaled(normal - mine @ mine.T, right - mine @ rows.residual[out], 1e-9)
        errors[out] -= step @ mine
        mean, covariance = given(~out)
        c = rows.columns[:, out]
        s = np.column_stack([np.linalg.cholesky(covariance + 1e-300), mean]) if False else None
        cov.append((c, mean, covariance)); index.append(np.flatnonzero(out))
    return errors, cov, index
