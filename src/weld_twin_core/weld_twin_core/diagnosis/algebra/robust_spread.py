# SPDX-FileCopyrightText: weld_twin contributors
# SPDX-License-Identifier: Apache-2.0
"""A standard deviation that a few gross errors do not move."""

from __future__ import annotations

import numpy as np

from ...arrays import Array

NORMAL = 1.4826
"""Standard deviation of normal numbers over the median of their size: 1 / 0.6745."""


def robust_spread(values: Array) -> float:
    """Return the standard deviation of numbers about zero by the median of their size."""
    return NORMAL * float(np.median(np.abs(values)))
