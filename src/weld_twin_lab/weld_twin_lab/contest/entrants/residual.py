# Copyright 2026 weld_twin contributors
# SPDX-License-Identifier: Apache-2.0
"""What learners learn from: where the nominal arm is off, and how it moves then."""

from __future__ import annotations

from collections.abc import Callable, Mapping

import numpy as np

from weld_twin_core.arm.chain import forward
from weld_twin_core.arrays import Array
from weld_twin_core.recording import JointMotion

from ..open_form import Cause, ContestAnswer, ContestCase

Learn = Callable[[Array, Array, Array], tuple[Array, Array | None]]
"""
Takes features (N, k), errors of the nominal arm there (N, 3) [m] and the features asked for (M, k);
returns the errors there (M, 3) [m], and their standard deviations where it has any.
"""


def answer_of(case: ContestCase, learn: Learn, most: int | None = None) -> ContestAnswer:
    """
    Return the nominal arm plus what a learner adds; it names nothing.

    most: samples that it learns from, spread evenly; left out, all.
    """
    count = case.measured.t.size
    rows = np.unique(np.linspace(0, count - 1, most or count).astype(int))
    known = features(case.train.joints, case.measured.t[rows])
    added, sigma = learn(known, off(case)[rows], features(case.ask.joints, case.times))
    there = nominal(case, case.ask.joints, case.times)
    return ContestAnswer(there + added, unknown=1.0, sigma=sigma)


def as_causes(sizes: Mapping[tuple[str, str | None], float]) -> tuple[Cause, ...]:
    """Return causes by their sizes, the largest first, each as likely as its share of the whole."""
    whole = sum(sizes.values())
    ranked = sorted(sizes.items(), key=lambda item: -item[1])
    return tuple(((*at, size / whole),) for at, size in ranked)


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
