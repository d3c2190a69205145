# Copyright 2026 weld_twin contributors
# SPDX-License-Identifier: Apache-2.0
"""Which stations the diagnosis itself would flag as beyond what it knows."""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray

from weld_twin_core.arrays import Array
from weld_twin_core.recording import Recording
from weld_twin_core.twin.posterior import Posterior

Mask = NDArray[np.bool_]


def flagged(posterior: Posterior, other: Recording, t: Array) -> Mask:
    """Return which poses a prediction flags as outside what was recorded, shape (M,)."""
    q, qd = other.joints.at(t)
    warm, load = other.temperature, other.wrench
    found = posterior.domain.outside(
        q,
        None if other.joints.static else qd,
        None if load is None else load.at(t),
        None if warm is None else warm.at(t),
    )
    out = np.zeros(t.size, dtype=bool)
    for first, last, _ in found:
        out[first : last + 1] = True
    return out
