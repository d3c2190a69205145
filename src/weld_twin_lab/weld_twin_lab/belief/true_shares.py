# Copyright 2026 weld_twin contributors
# SPDX-License-Identifier: Apache-2.0
"""The true shares of a case, however much its causes overlap or cancel."""

from __future__ import annotations

from ..blind.blind_cell import deviation, floor
from ..blind.making import SealedCase


def true_shares(case: SealedCase) -> list[float]:
    """
    Return the true share of every cause of a case.

    As a diagnosis tells it: of the squared gap with its noise, what is no noise is parted by how
    far each cause moves the tool along with all of them together. One that works against the
    others takes nothing off the gap beside them, and has a share of zero. The noise is all that
    is not the causes': the instrument's, and that of stamps that jitter.
    """
    whole = deviation(case.cell, case.causes, case.train)
    noise, _ = floor(case.cell, case.causes, case.train)
    square = float((whole**2).sum(axis=-1).mean())
    along = [
        max(float((deviation(case.cell, [cause], case.train) * whole).sum(axis=-1).mean()), 0.0)
        for cause in case.causes
    ]
    explained = square / (square + noise**2) / max(sum(along), 1e-300)
    return [explained * part for part in along]
