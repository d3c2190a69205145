# Copyright 2026 weld_twin contributors
# SPDX-License-Identifier: Apache-2.0
"""
Of effects that are alike on the recordings fitted, the one that carries over to held-out ones.

A joint that hardly moves shows its zero and its gear ratio alike, and the search takes one of the
two. Where a held-out motion moves it, they part: the one that leaves far more there is none. Nothing
is fitted to the held-out recordings; they choose among two or three, and only where they part
plainly.
"""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import replace

from ...recording import Recording
from ..beliefs import Beliefs
from ..hypotheses.rivals import Rival, rivals
from ..hypotheses.search import Search, refitted
from ..hypotheses.selection import implausible
from ..hypotheses.structural_aliases import with_structural_aliases
from ..result import Site
from .held_out_shrink import left_on


def carrying(
    found: Search, holdout: Sequence[Recording], exclude: Sequence[str], beliefs: Beliefs
) -> Search:
    """
    Return the search with every effect replaced by its like where that alone carries over.

    Parameters
    ----------
    found : Search
    holdout : sequence of Recording
    exclude : sequence of str
        Families taken out of the library.
    beliefs : Beliefs

    """
    # What no machine has is left out of the model and its slots, and still is in the rivals' fits.
    if not holdout or found.dense or len(found.slots) != len(found.small.model.found):
        return found
    for _ in range(len(found.slots)):
        better = _better(found, holdout, exclude, beliefs)
        if better is None:
            break
        tried = _with(found, better, holdout, exclude, beliefs)
        if implausible(tried.final.model):
            break
        found = tried
    return found


def _better(
    found: Search, holdout: Sequence[Recording], exclude: Sequence[str], beliefs: Beliefs
) -> Rival | None:
    """Return the rival that leaves least on held-out data, if the model leaves more."""
    close = [
        rival
        for slot in found.slots
        for rival in slot
        if rival.probability >= beliefs.listed
        and rival.fit is not found.small
        and rival.site.effect not in exclude
    ]
    if not close:
        return None
    left = [_left(found, rival, holdout, beliefs) for rival in close]
    least = min(left)
    if (1.0 + beliefs.parted) * least > left_on(found, holdout, beliefs):
        return None
    return close[left.index(least)]


def _with(
    found: Search,
    better: Rival,
    holdout: Sequence[Recording],
    exclude: Sequence[str],
    beliefs: Beliefs,
) -> Search:
    """Return the search with a rival in the model, and the rivals that part from it ruled out."""
    fit = better.fit
    found = refitted(found, fit)
    slots = tuple(
        rivals(found.work, fit, k, lambda own: found.effective(own))
        for k in range(len(fit.model.found))
    )
    found = with_structural_aliases(replace(found, slots=slots), exclude, beliefs)
    at = [Site(effect.name, effect.site) for effect in fit.model.found].index(better.site)
    slot = found.slots[at]
    left = {
        rival.site: _left(found, rival, holdout, beliefs)
        for rival in slot
        if rival.probability >= beliefs.listed or rival.site == better.site
    }
    kept = _alike(slot, left, beliefs)
    out = {rival.site for rival in slot} - {rival.site for rival in kept}
    return replace(
        found,
        slots=(*found.slots[:at], kept, *found.slots[at + 1 :]),
        ruled_out=found.ruled_out | out,
    )


def _alike(
    slot: tuple[Rival, ...], left: Mapping[Site, float], beliefs: Beliefs
) -> tuple[Rival, ...]:
    """Return the rivals that leave as little as the least on held-out data."""
    most = (1.0 + beliefs.parted) * min(left.values())
    kept = [rival for rival in slot if left.get(rival.site, most) <= most]
    whole = sum(rival.probability for rival in kept)
    return tuple(replace(rival, probability=rival.probability / whole) for rival in kept)


def _left(found: Search, rival: Rival, holdout: Sequence[Recording], beliefs: Beliefs) -> float:
    return left_on(replace(found, final=rival.fit), holdout, beliefs)
