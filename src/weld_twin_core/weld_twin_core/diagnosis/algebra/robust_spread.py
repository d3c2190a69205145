# Copyright 2026 weld_twin contributors
# SPDX-License-Identifier: Apache-2.0
"""A standard deviation that neither a few gross errors move, nor coordinates never measured."""

from __future__ import annotations

import numpy as np

from ...arrays import Array

NORMAL = 1.4826
"""Standard deviation of normal numbers over the median of their size: 1 / 0.6745."""


def robust_spread(values: Array) -> float:
    """Return the standard deviation of numbers about zero by the median of their size."""
    return NORMAL * float(np.median(np.abs(values)))


NOT_MEASURED = 1e-6
"""Share of the largest size below which a coordinate is taken for one that was never measured."""


def measured_axes(part: Array) -> Array:
    """
    Return the coordinates that were measured, shape (k, M) of (3, M).

    A linear axis has nothing across it: exact zeros there are no sign of small noise.
    """
    size = np.abs(part).max(axis=1, initial=0.0)
    live = size > NOT_MEASURED * size.max(initial=0.0)
    return part[live] if live.any() else part
