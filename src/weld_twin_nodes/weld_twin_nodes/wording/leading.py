# Copyright 2026 weld_twin contributors
# SPDX-License-Identifier: Apache-2.0
"""Which cause comes first where none has a name: the one whose curve takes most off unseen data."""

from __future__ import annotations

from weld_twin_core.diagnosis.result import Diagnosis


def in_order(diagnosis: Diagnosis) -> list[int]:
    """
    Return the causes, counted from 0, those first that take most off the squared gap.

    Shares of places without a name say what their own motion tells, which a second place may tell
    as well; what a curve takes off is what a reader can have.
    """
    reported = diagnosis.contributions
    count = len(diagnosis.causes)
    if reported is None:
        return list(range(count))
    taken = [0.0] * count
    for run, (remaining, parts) in enumerate(zip(reported.left, reported.parts, strict=True)):
        good = diagnosis.traces.trusted[run] if diagnosis.traces.trusted else slice(None)
        whole = (remaining + parts.sum(axis=0))[good]
        for k in range(count):
            part = parts[k][good]
            taken[k] += float((part * (2.0 * whole - part)).sum())
    return sorted(range(count), key=lambda k: -taken[k])
