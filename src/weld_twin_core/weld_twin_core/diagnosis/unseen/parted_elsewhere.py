# Copyright 2026 weld_twin contributors
# SPDX-License-Identifier: Apache-2.0
"""
Which of the rivals that move the tool alike here part on held-out recordings.

Nothing is fitted to those: a rival that leaves more there than the one in the model is not its
like. The one in the model carries over as well as any, as far as `carrying` could tell.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import replace

from ...recording import Recording
from ..beliefs import Beliefs
from ..hypotheses.rivals import Rival
from ..hypotheses.search import Search
from .held_out_shrink import left_on


def parted_elsewhere(
    found: Search, holdout: Sequence[Recording], beliefs: Beliefs
) -> tuple[Search, float | None]:
    """
    Return the search without rivals that fail where the leader holds, and the least RMS left.

    Parameters
    ----------
    found : Search
    holdout : sequence of Recording
    beliefs : Beliefs

    Returns
    -------
    found : Search
        Probabilities of the rivals that stay add up to one again.
    least : float or None [m]
        Least RMS on the held-out recordings over everything that could be in the model, one rival
        at a time; None where nothing was held out, or nothing has a rival.

    """
    slots, least = [], []
    for slot in found.slots:
        close = [r for r in slot if r.probability >= beliefs.listed]
        if not holdout or slot[0].probability >= beliefs.sure or len(close) < 2:
            slots.append(slot)
            continue
        left = [left_on(replace(found, final=r.fit), holdout, beliefs) for r in close]
        least += left
        slots.append(_parted(slot, dict(zip((r.site for r in close), left, strict=True)), beliefs))
    return replace(found, slots=tuple(slots)), min(least, default=None)


def _parted(
    slot: tuple[Rival, ...], left: dict[object, float], beliefs: Beliefs
) -> tuple[Rival, ...]:
    """Return a slot without the rivals that leave more than the leader, if that leaves least."""
    most = (1.0 + beliefs.parted) * min(left.values())
    if left[slot[0].site] > most:
        return slot
    kept = [r for r in slot if left.get(r.site, 0.0) <= most]
    whole = sum(r.probability for r in kept)
    return tuple(replace(r, probability=r.probability / whole) for r in kept)
