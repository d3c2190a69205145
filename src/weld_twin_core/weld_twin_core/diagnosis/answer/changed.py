# Copyright 2026 weld_twin contributors
# SPDX-License-Identifier: Apache-2.0
"""What changed between the recordings, as the answer tells it."""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np

from ..frames.changes import told, untold
from ..hypotheses.search import Search
from ..result import Changed, Check


def changed(found: Search, families: Sequence[str]) -> tuple[Changed, ...]:
    """Return what differs between the recordings beyond noise, by recording."""
    if not families:
        return ()
    items = told(found.problem, found.final.model, found.scale, found.precision, families)
    return tuple(
        Changed(
            item.change.recording,
            item.change.effect,
            item.change.effect.errors(np.sqrt(np.diag(item.covariance))),
        )
        for item in items
    )


def untold_check(found: Search, families: Sequence[str]) -> tuple[Check, ...]:
    """Return a note of what may have changed without being seen."""
    names = untold(found.problem, found.final.model, families)
    if not names:
        return ()
    return (
        Check(
            'changes',
            'note',
            'Whether it changed between the recordings cannot be told of: '
            f'{", ".join(names)}. Frames that are fitted take its place, or nothing shows it.',
        ),
    )
