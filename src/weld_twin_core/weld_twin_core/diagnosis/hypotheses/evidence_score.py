# Copyright 2026 weld_twin contributors
# SPDX-License-Identifier: Apache-2.0
"""How much a unit explains: the fall of the sum of squares against what its freedom would buy."""

from __future__ import annotations

import numpy as np

from ...arrays import Array

PERFECT = 1e-12
"""Share of the sum of squares that counts as left at the least; keeps a logarithm finite."""
FEWEST = 3.0
"""Independent rows at the least: a position has three coordinates."""


def evidence(rss: float, gain: float, freedom: float, effective: float) -> float:
    r"""
    Return the nats that a fall of the sum of squares is worth, noise level unknown.

    .. math:: \tfrac{n}{2} \log\frac{RSS}{RSS - gain} - \tfrac{p}{2} \log n

    Parameters
    ----------
    rss : float
        Sum of squares before.
    gain : float
        By how much it falls.
    freedom : float
        Coordinates that the fall took.
    effective : float
        Number of independent rows [1]_: autocorrelated residuals carry less than their count.

    References
    ----------
    .. [1] G. Schwarz, "Estimating the dimension of a model", Ann. Statist. 6, 1978.

    """
    return float(evidences(rss, np.asarray(gain), freedom, effective))


def evidences(rss: float, gain: Array, freedom: Array | float, effective: float) -> Array:
    """
    Return the `evidence` of many falls at once.

    Parameters
    ----------
    rss : float
        Sum of squares before.
    gain : array, shape (S,)
        By how much it falls.
    freedom : float, or array, shape (S,)
        Coordinates that each fall took.
    effective : float
        Number of independent rows.

    """
    # Where nothing was left before, nothing can fall.
    left = np.maximum(rss - gain, PERFECT * rss) / rss if rss > 0.0 else np.ones_like(gain)
    count = max(effective, FEWEST)
    return np.asarray(-0.5 * count * np.log(left) - 0.5 * freedom * np.log(count))
