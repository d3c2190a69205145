# Copyright 2026 weld_twin contributors
# SPDX-License-Identifier: Apache-2.0
"""Which stations the diagnosis itself would flag as beyond what it knows."""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray

from weld_twin_core.diagnosis import Diagnosis
from weld_twin_core.recording import Recording


def flagged(diagnosis: Diagnosis, train: Recording, stations: Recording) -> NDArray[np.bool_]:
    """Return which stations a prediction would flag, shape (M,)."""
    assert stations.measured is not None
    flags = np.zeros(stations.measured.t.size, dtype=bool)
    if diagnosis.posterior is None:
        return flags
    q, qd = stations.joints.at(stations.measured.t)
    found = diagnosis.posterior.domain.outside(q, None if stations.joints.static else qd)
    for first, last, _ in found:
        flags[first : last + 1] = True
    return flags
