# Copyright 2026 weld_twin contributors
# SPDX-License-Identifier: Apache-2.0
"""Lengths, instants and lists in the sentences of the checks."""

from __future__ import annotations

from collections.abc import Sequence

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


def falls(before: float, after: float) -> str:
    """Return that the gap [m] falls from one length to another."""
    return f'the gap falls from {length(before)} to {length(after)}'


def listed(names: Sequence[str]) -> str:
    """Return names as a list in a sentence."""
    return ' and '.join([', '.join(names[:-1]), names[-1]] if len(names) > 1 else names)


def instant(recording: Recording, time: float) -> str:
    """Return an instant [s] as people find it: the first station then, or the time."""
    if not recording.joints.static or recording.measured is None:
        return f't = {time:.4g} s'
    t = recording.measured.t
    before = int(np.count_nonzero(t < time))
    return f'station {min(before, t.size - 1)} of {t.size}'
