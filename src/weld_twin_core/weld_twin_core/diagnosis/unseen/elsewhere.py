# Copyright 2026 weld_twin contributors
# SPDX-License-Identifier: Apache-2.0
"""
Effects that are alike on the recordings fitted, and part on held-out ones.

A joint that hardly moves shows its zero and its gear ratio alike, and the search takes one of the
two. Where a held-out motion moves it, they part. Nothing is fitted to the held-out recordings; they
choose among two or three, and only where these part plainly.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import replace
from itertools import chain

from ...recording import Recording
from ..beliefs import Beliefs
from ..hypotheses.rivals import Rival, rivals, with_leads
from ..hypotheses.search import Search, refitted
from ..hypotheses.seed_systems import Role
from ..hypotheses.selection import implausible
from ..result import Site
from .held_out_shrink import left_on

Slot = tuple[Rival, ...]


def borne_out(result: Search, holdout: Sequence[Recording], beliefs: Beliefs) -> Search:
    """
    Return the search with the effects and the rivals that held-out recordings bear out.

    An effect gives its place to its like where that alone carries over. Then rivals that leave more
    than the effect in the model are none.

    holdout: never fitted; without any nothing changes.
    """
    if not holdout:
        return result
    # What no machine has is left out of the model and its slots, and still is in the rivals' fits.
    if len(result.slots) == len(result.small.model.found):
        result = _exchanged(result, holdout, beliefs)
    slots = list[Slot]()
    for effect, candidate_set in zip(result.final.model.found, result.slots, strict=False):
        own = Site.of(effect)
        close = [r for r in candidate_set if r.probability >= beliefs.listed or r.site == own]
        certain = candidate_set[0].site == own and candidate_set[0].probability >= beliefs.sure
        if not certain and len(close) > 1:
            remaining = _left(result, close, holdout, beliefs)
            by_site = dict(zip((r.site for r in close), remaining, strict=True))
            candidate_set = _alike(candidate_set, own, by_site, beliefs)
        slots.append(candidate_set)
    return replace(result, slots=tuple(slots))


def _exchanged(result: Search, holdout: Sequence[Recording], beliefs: Beliefs) -> Search:
    """Return the search with every effect replaced by its like where that alone carries over."""
    for _ in result.slots:
        # Those that could be in the model as well.
        likes = [
            one
            for one in chain.from_iterable(result.slots)
            if one.probability >= beliefs.listed
            and one.fit is not result.small
            and one.role is not Role.TAKEN_OUT
        ]
        remaining = _left(result, likes, holdout, beliefs)
        least = min(remaining, default=float('inf'))
        if not likes or (1.0 + beliefs.parted) * least > left_on(result, holdout, beliefs):
            break
        better = likes[remaining.index(least)]
        tried = refitted(result, better.fit)
        if implausible(tried.final.model):
            break
        case = result.work, better.fit
        every = [rivals(*case, k) for k in range(len(better.fit.model.found))]
        slots, refused = with_leads(*case, every)
        result = replace(tried, slots=slots, refused=(*tried.refused, *refused))
    return result


def _left(
    result: Search, some: Sequence[Rival], holdout: Sequence[Recording], beliefs: Beliefs
) -> list[float]:
    """Return what each rival leaves on held-out recordings, RMS [m]."""
    return [left_on(replace(result, final=one.fit), holdout, beliefs) for one in some]


def _alike(candidate_set: Slot, own: Site, remaining: dict[Site, float], beliefs: Beliefs) -> Slot:
    """Return a slot without the rivals that leave more than the effect in the model."""
    most = (1.0 + beliefs.parted) * min(remaining.values())
    if remaining.get(own, most) > most:
        return candidate_set
    kept = [one for one in candidate_set if remaining.get(one.site, most) <= most]
    whole = sum(one.probability for one in kept)
    return tuple(replace(one, probability=one.probability / whole) for one in kept)
