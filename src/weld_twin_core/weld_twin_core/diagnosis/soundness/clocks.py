# SPDX-FileCopyrightText: weld_twin contributors
# SPDX-License-Identifier: Apache-2.0
"""Do joint and measurement stamps belong to one clock?"""

from __future__ import annotations

from collections.abc import Iterator, Sequence

import numpy as np

from ...recording import Recording
from .case import Case, Finding, measured
from .lag import lag

FEW = 3.0
"""A lag of fewer samples is left to the fit."""
LATE = 0.1
"""A lag [s] from which it is a warning."""


def clocks(case: Case) -> Sequence[Finding]:
    """Return how late the measurements of a moving arm are, where that explains the gap."""
    out: list[Finding] = []
    for k, recording in enumerate(case.recordings):
        t = measured(recording).t
        if recording.joints.static or t.size < 30 or recording.joints.t.size < 30:
            continue
        step = max(float(np.median(np.diff(s))) for s in (t, recording.joints.t))
        out += _recording(case, k, recording, FEW * step)
    return out


def _recording(case: Case, k: int, recording: Recording, few: float) -> Iterator[Finding]:
    joints = recording.joints.t
    path, late = case.paths[k], case.lags[k]
    seen = measured(recording)
    if late is not None and abs(late) > few:
        yield Finding(
            'warning' if abs(late) > LATE else 'note',
            f'The measurements of {recording.name} are {abs(late) * 1e3:.0f} ms '
            f'{"late" if late > 0.0 else "early"} against the joint states: the clocks are not '
            'synchronised'
            + (', or commanded joints were recorded and the arm lags behind.' if late > 0.0
               else '.'),
        )  # fmt: skip
    third = (seen.t[-1] - seen.t[0]) / 3.0
    first, last = seen.t < seen.t[0] + third, seen.t > seen.t[-1] - third
    ends = [lag(joints, path, seen.t[part], seen.position[part]) for part in (first, last)]
    if ends[0] is not None and ends[1] is not None and abs(ends[1] - ends[0]) > few:
        rate = (ends[1] - ends[0]) / (2.0 * third)
        yield Finding(
            'warning',
            f'The clocks of {recording.name} run apart: the measurements are '
            f'{ends[0] * 1e3:.0f} ms late in the first third and {ends[1] * 1e3:.0f} ms in the '
            f'last ({rate * 1e6:.0f} ppm).',
        )
