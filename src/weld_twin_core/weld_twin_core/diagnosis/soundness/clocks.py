# Copyright 2026 weld_twin contributors
# SPDX-License-Identifier: Apache-2.0
"""Do joint and measurement stamps belong to one clock?"""

from __future__ import annotations

from collections.abc import Iterator, Sequence
from functools import partial

import numpy as np

from ...recording import Recording
from ...two_clocks import ONE_CLOCK
from .evidence import Case, Finding, Mistake
from .lag import Lag
from .limits import LATE, RATE
from .mending import stamps_as
from .snapshot import measured

FEW = 3.0
"""A lag of fewer samples is left to the fit."""


def clocks(case: Case) -> Sequence[Finding]:
    """Return how late the measurements of a moving arm are, where that explains the gap."""
    out: list[Finding] = []
    for k, late in enumerate(case.lags):
        if late is not None:
            out += _recording(case.recordings[k], late, k)
    return out


def _recording(recording: Recording, lag: Lag, k: int) -> Iterator[Finding]:
    t = measured(recording).t
    step = max(float(np.median(np.diff(s))) for s in (t, recording.joints.t))
    start, end = (float(lag.at(edge)) for edge in (t[0], t[-1]))
    mend = partial(stamps_as, k=k, late=lag.late, rate=lag.rate, middle=lag.middle)
    if abs(end - start) > step:
        sentence = (
            f'The clocks of {recording.name} run apart by {lag.rate * 1e6:.0f} ppm: the '
            f'measurements are {_late(start)} at the start and {_late(end)} at the end.'
        )
        wrong = abs(lag.rate) > RATE
    elif abs(lag.late) > FEW * step:
        cause = ', or commanded joints were recorded and the arm lags behind'
        sentence = (
            f'The measurements of {recording.name} are {_late(lag.late)} against the joint states:'
            f' the clocks are not synchronised{cause if lag.late > 0.0 else ""}.'
        )
        wrong = abs(lag.late) > LATE
    else:
        return
    if wrong:
        yield Finding.of(Mistake('clock', ('clock',), sentence, ONE_CLOCK, mend, of_all=False))
    else:
        yield Finding('note', sentence)


def _late(seconds: float) -> str:
    return f'{abs(seconds) * 1e3:.0f} ms {"late" if seconds >= 0.0 else "early"}'
