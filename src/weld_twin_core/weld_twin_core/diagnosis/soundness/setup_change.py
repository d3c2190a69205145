# Copyright 2026 weld_twin contributors
# SPDX-License-Identifier: Apache-2.0
"""Did the set-up move: a step of the base at one time, or a slow settling?"""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np

from .evidence import Case, Finding, length
from .lengths import instant
from .slips import KNOCKED, Settling, Slip
from .snapshot import measured

SEEN = 2.0
"""
A change this many times as large as the largest gaps did not happen: whatever is aligned, one side
of a step keeps half of it. A strong shake makes such steps that other columns undo.
"""


def setup(case: Case) -> Sequence[Finding]:
    """Return steps and settling of the set-up; those that are dated are causes, and told there."""
    most = SEEN * case.largest
    out = []
    for each in case.changes:
        if isinstance(each, Settling) and each.size < most:
            out.append(Finding('note', _settled(case, each)))
        elif isinstance(each, Slip) and each.kind == KNOCKED and each.size < most:
            out += [] if case.slips else [Finding('warning', _moved(case, each))]
    return out


def _moved(case: Case, step: Slip) -> str:
    recording = case.recordings[step.recording]
    if step.time == measured(recording).t[0]:
        return (
            f'The set-up moved by {length(step.size)} before {recording.name}; have the base '
            'aligned, so that each recording gets its own.'
        )
    return (
        f'The set-up of {recording.name} moved by {length(step.size)} at '
        f'{instant(recording, step.time)}; split the '
        'recording there and have the base aligned, so that each part gets its own.'
    )


def _settled(case: Case, found: Settling) -> str:
    recording = case.recordings[found.recording]
    constant, unit = found.time_constant, 's'
    if recording.joints.static:
        constant, unit = constant / float(np.median(np.diff(measured(recording).t))), 'stations'
    return (
        f'The set-up of {recording.name} settles by {length(found.size)} with a time constant of '
        f'{constant:.3g} {unit}, as in warming up.'
    )
