# SPDX-FileCopyrightText: weld_twin contributors
# SPDX-License-Identifier: Apache-2.0
"""Do joint and measurement stamps belong to one clock?"""

from __future__ import annotations

from collections.abc import Iterator, Sequence

import numpy as np

from ...recording import Recording
from .evidence import Case, Finding
from .lag import Lag
from .snapshot import measured

FEW = 3.0
"""A lag of fewer samples is left to the fit."""
LATE = 0.1
"""A lag [s] from which it is a warning."""


def clocks(case: Case) -> Sequence[Finding]:
    """Return how late the measurements of a moving arm are, where that explains the gap."""
    out: list[Finding] = []
    for recording, late in zip(case.recordings, case.lags, strict=True):
        if late is not None:
            out += _recording(recording, late)
    return out


def _recording(recording: Recording, lag: Lag) -> Iterator[Finding]:
    t = measured(recording).t
    step = max(float(np.median(np.diff(s))) for s in (t, recording.joints.t))
    start, end = (float(lag.at(edge)) for edge in (t[0], t[-1]))
    if abs(end - start) > step:
        yield Finding(
            'warning',
            f'The clocks of {recording.name} run apart by {lag.rate * 1e6:.0f} ppm: the '
            f'measurements are {_late(start)} at the start and {_late(end)} at the end.',
        )
    elif abs(lag.late) > FEW * step:
        cause = ', or commanded joints were recorded and the arm lags behind'
        yield Finding(
            'warning' if abs(lag.late) > LATE else 'note',
            f'The measurements of {recording.name} are {_late(lag.late)} against the joint states:'
            f' the clocks are not synchronised{cause if lag.late > 0.0 else ""}.',
        )


def _late(seconds: float) -> str:
    return f'{abs(seconds) * 1e3:.0f} ms {"late" if seconds >= 0.0 else "early"}'
