# Copyright 2026 weld_twin contributors
# SPDX-License-Identifier: Apache-2.0
"""Do the stamps belong to one clock, come regularly, and as fine as they should?"""

from __future__ import annotations

from collections.abc import Iterator, Sequence
from functools import partial

import numpy as np

from ...arrays import Array
from ...bursts import bursts
from ...recording import Recording
from ...two_clocks import ONE_CLOCK
from ..algebra.independent_rows import robust_spread
from .evidence import Case, Finding, mistake
from .lag import Lag
from .limits import LATE, RATE
from .mending import stamps_as
from .snapshot import measured

GAP = 4.5
"""A step of so many usual steps is a gap."""
MISSING = 0.2
"""Share of lost messages from which a note becomes a warning."""
JITTER = 0.3
"""Spread of the steps between stamps, as a share of the usual step, from which it is told."""
GRIDS = (1e-2, 1e-3)
"""Grids [s] that clocks are rounded to: hundredths and milliseconds."""
ENOUGH = 20
"""Stamps below which their steps say nothing."""
FEW = 3.0
"""A lag of fewer samples is left to the fit."""


def stamps(case: Case) -> Sequence[Finding]:
    """Return gaps, jitter and rounding of the joint and measurement stamps."""
    out: list[Finding] = []
    for recording in case.recordings:
        if recording.joints.static:
            continue
        for t, what in (
            (recording.joints.t, 'joint states'),
            (measured(recording).t, 'measurements'),
        ):
            if t.size >= ENOUGH:
                out += _stream(t, f'The {what} of {recording.name}')
    return out


def _stream(t: Array, name: str) -> Iterator[Finding]:
    sent = bursts(t)
    if sent is not None:
        yield Finding('warning', f'{name} are {sent.words}: none has its own time.')
        return
    steps = np.diff(t)
    usual = float(np.median(steps))
    gaps = steps > GAP * usual
    if gaps.any():
        lost = float((steps[gaps] / usual - 1.0).sum())
        level = 'warning' if lost > MISSING * (t.size + lost) else 'note'
        at = float(t[:-1][gaps][steps[gaps].argmax()])
        yield Finding(
            level,
            f'{name} have {int(gaps.sum())} gap(s), the longest {steps.max():.3g} s at '
            f't = {at:.3g} s; about {lost:.0f} messages are missing.',
        )
    grid = _grid(t)
    if grid is not None:
        yield Finding(
            'note',
            f'{name} are stamped in whole {grid * 1e3:g} ms; positions are '
            f'uncertain by the way made in {grid * 5e2:g} ms.',
        )
        return
    spread = robust_spread(steps[~gaps] - usual)
    if spread > JITTER * usual:
        yield Finding(
            'note',
            f'{name} come irregularly: every {usual * 1e3:.3g} ms, give or take '
            f'{spread * 1e3:.2g} ms.',
        )


def _grid(t: Array) -> float | None:
    """Return the grid that stamps were rounded to; a grid of the rate itself rounds nothing."""
    for grid in GRIDS:
        counts = (t - t[0]) / grid
        if np.abs(counts - counts.round()).max() > 1e-4:
            continue
        steps = np.diff(counts).round()
        usual = np.median(steps)
        # Dropped messages make whole multiples of the usual step, rounding makes one more or less.
        uneven = np.abs(steps - usual) == 1
        return grid if uneven.mean() > 0.05 and usual > 1 else None
    return None


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
        yield mistake(sentence, 'clock', ('clock',), ONE_CLOCK, mend, of_all=False)
    else:
        yield Finding('note', sentence)


def _late(seconds: float) -> str:
    return f'{abs(seconds) * 1e3:.0f} ms {"late" if seconds >= 0.0 else "early"}'
