# Copyright 2026 weld_twin contributors
# SPDX-License-Identifier: Apache-2.0
"""How much of a correction to apply where the model is not known to hold."""

from __future__ import annotations

import numpy as np

from ..arrays import Array
from .domain import Domain

FADES = 4.0
"""Margins beyond what was recorded, after the first, over which doubt sets in: commands must not
jump where a joint crosses a border."""


def trust(domain: Domain, q: Array, correction: Array, covariance: Array) -> Array:
    """
    Return the share of a correction to apply to each pose, shape (M,).

    All of it where it was recorded. Beyond, as much as makes the expected squared error least:
    the square of the correction over that square and the variance of what it is based on, so that
    a correction smaller than its own uncertainty is mostly left away.

    Parameters
    ----------
    domain : Domain
    q : array, shape (M, n)
    correction : array, shape (M, 3) [m]
        By how much the model would move the tool.
    covariance : array, shape (M, 3, 3) [m^2]
        Of the position that the model gives.

    """
    size = (correction**2).sum(axis=1)
    doubt = np.trace(covariance, axis1=1, axis2=2)
    best = size / np.maximum(size + doubt, 1e-300)
    beyond = (domain.beyond(q) / np.array(domain.margins)).max(axis=1)
    apart = np.clip((beyond - 1.0) / FADES, 0.0, 1.0)
    smooth = apart**2 * (3.0 - 2.0 * apart)
    return np.asarray(1.0 - smooth * (1.0 - best))
