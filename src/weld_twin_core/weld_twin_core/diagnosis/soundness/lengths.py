# Copyright 2026 weld_twin contributors
# SPDX-License-Identifier: Apache-2.0
"""Lengths and instants in the sentences of the checks."""

from __future__ import annotations

import numpy as np

from ...recording import Recording

_LEAST = 5e-7
"""Length [m] below which it reads 0.000 mm."""
_FINE = 1e-4
"""Length [m] below which three digits of mm are told, which no instrument is better than."""


def length(value: float) -> str:
    """Return a length [m] as people read it."""
    if value >= 1.0:
        return f'{value:.3g} m'
    if value < _LEAST:
        return 'less than 0.001 mm'
    return f'{value * 1e3:.3g} mm' if value >= _FINE else f'{value * 1e3:.3f} mm'


def instant(recording: Recording, time: float) -> str:
    """
    Return an instant as people find it: the number of the first station then, or the time.

    Parameters
    ----------
    recording : Recording
        With measurements.
    time : float [s]

    """
    if not recording.joints.static or recording.measured is None:
        return f't = {time:.4g} s'
    t = recording.measured.t
    before = int(np.count_nonzero(t < time))
    return f'station {min(before, t.size - 1)} of {t.size}'
