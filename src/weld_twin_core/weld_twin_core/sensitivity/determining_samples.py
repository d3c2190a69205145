# Copyright 2026 weld_twin contributors
# SPDX-License-Identifier: Apache-2.0
"""
Samples of a motion that determine all others, whatever constant errors an arm has.

Products of what the joints do, (1, cos, sin) of one that turns and (1, q) of one that slides, are
the *features* of a sample. Rows and frames of an arm are constant factors between the joints, so
that positions of any arm are linear in them. Along a smooth seam the features are nearly dependent:
as functions of the sample they span some two dozen dimensions to rounding. Then positions are known
from as many samples by one matrix product. Those samples and that matrix come from a pivoted QR
factorisation of the features [1]_, whose remainder bounds the error.

References
----------
.. [1] H. Cheng et al., "On the compression of low rank matrices", SIAM J. Sci. Comput. 26, 2005
   (the interpolative decomposition); of random mixtures: P.-G. Martinsson, V. Rokhlin, M. Tygert,
   "A randomized algorithm for the decomposition of matrices", ACHA 30, 2011.

"""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray
from scipy.linalg import qr, solve_triangular

from ..arm.robot import Robot
from ..arrays import Array

_ROUNDING = 1e-14
"""Remainder of the features, relative to the strongest, that counts as none."""
_NEGLIGIBLE = 1e-13
"""What features may differ from those determined by a few samples, relative to the largest."""
_MIXTURES = 48
"""Mixtures that stand for all features; a motion with more independent ones is worked on whole."""
_MOST_JOINTS = 8
"""Joints beyond which the features, three times as many for each, are too many."""


def determining(robot: Robot, q: Array) -> tuple[NDArray[np.int_], Array] | None:
    """
    Return samples, and the matrix (N, S) from values there to values at all of q (N, n).

    The factorisation is of random mixtures of the features, which depend on each other as the
    features do. None if the samples are half of all or more, or if the features themselves differ
    from those so determined by more than rounding.
    """
    if robot.n > _MOST_JOINTS:
        return None
    features = _features(q, robot.prismatic)
    mixing = np.random.default_rng(0).random((_MIXTURES, len(features))) - 0.5
    upper, order = qr(mixing @ features, mode='r', pivoting=True, check_finite=False)
    strength = np.abs(np.diagonal(upper))
    rank = int((strength > _ROUNDING * strength[0]).sum())
    if 2 * rank >= len(q):
        return None
    spread = np.empty((rank, len(q)))
    spread[:, order[:rank]] = np.eye(rank)
    spread[:, order[rank:]] = solve_triangular(upper[:rank, :rank], upper[:rank, rank:])
    off = np.abs(features[:, order[:rank]] @ spread - features).max()
    if off > _NEGLIGIBLE * np.abs(features).max():
        return None
    return order[:rank], np.ascontiguousarray(spread.T)


def _features(q: Array, slides: NDArray[np.bool_]) -> Array:
    """Return the features, shape (F, N), those of the last joint varying fastest."""
    out = np.ones((1, len(q)))
    for x, slide in zip(q.T[::-1], slides[::-1], strict=True):
        own = np.stack([np.ones_like(x), x] if slide else [np.ones_like(x), np.cos(x), np.sin(x)])
        out = (own[:, None] * out[None]).reshape(-1, len(q))
    return out
