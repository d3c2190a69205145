# Copyright 2026 weld_twin contributors
# SPDX-License-Identifier: Apache-2.0
"""The status as it is told: is what has no name more than what has one?"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import replace

from ..result import Cause
from ..verdict.decision import Verdict

LIKELIER = 0.5
"""Probability from which on a cause counts as named: it is likelier right than wrong."""


def settled(verdict: Verdict, causes: Sequence[Cause]) -> Verdict:
    """
    Return the verdict; it is 'unknown' where what is left, or unlikely, is more than what is named.

    Parameters
    ----------
    verdict : Verdict
    causes : sequence of Cause
        With the probabilities that they have earned, and with what is left.

    """
    named = sum(c.share for c in causes if _found(c) and c.probability > LIKELIER)
    left = sum(c.share for c in causes if not _found(c))
    if verdict.status in ('identified', 'ambiguous') and causes and named <= left:
        return replace(verdict, status='unknown')
    if verdict.status != 'unknown' or not verdict.sets or left >= named:
        return verdict
    alone = all(len(group) == 1 for group in verdict.sets)
    return replace(verdict, status='identified' if alone else 'ambiguous')


def _found(cause: Cause) -> bool:
    """Return whether a cause is an effect that was found, or a kind of many small ones."""
    return cause.slot is not None or cause.effect is not None
