# Copyright 2026 weld_twin contributors
# SPDX-License-Identifier: Apache-2.0
"""Do the stamps come regularly, and as fine as they should?"""

from __future__ import annotations

from collections.abc import Iterator, Sequence

import numpy as np

from ...arrays import Array
from ...bursts import bursts
from ..algebra.robust_spread import robust_spread
from .evidence import Case, Finding
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
