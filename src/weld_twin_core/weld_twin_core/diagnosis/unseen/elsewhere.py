# Copyright 2026 weld_twin contributors
# SPDX-License-Identifier: Apache-2.0
"""
Effects that are alike on the recordings fitted, and part on held-out ones.

A joint that hardly moves shows its zero and its gear ratio alike, and the search takes one of the
two. Where a held-out motion moves it, they part. Nothing is fitted to the held-out recordings; they
choose among two or three, and only where these part plainly.
"""

from __future__ import annotations

from collections.abc import Iterator, Sequence
from dataclasses import replace

from ...recording import Recording
from ..beliefs import Beliefs
from ..hypotheses.rivals import Rival, rivals
from ..hypotheses.search import Search, refitted
from ..hypotheses.selection import implausible
from ..hypotheses.structural_aliases import with_structural_aliases
from ..result import Site
from .held_out_shrink import left_on

Slot = tuple[Rival, ...]


def borne_out(
    found: Search, holdout: Sequence[Recording], exclude: Sequence[str], beliefs: Beliefs
) -> tuple[Search, float | None]:
    """
    Return the search with the effects and the rivals that held-out recordings bear out.

    An effect gives its place to its like where that alone carries over. Then rivals that leave more
    than the effect in the model are none.

    Parameters
    ----------
    holdout : sequence of Recording
        Never fitted; without any nothing changes.

    Returns
    -------
    found : Search
        Probabilities of the rivals that stay add up to one again.
    least : float or None [m]
        Least RMS on the held-out recordings over everything that could be in the model, one rival
        at a time; None where nothing was held out, or nothing has a rival.

    """
    if not holdout:
        return found, None
    # What no machine has is left out of the model and its slots, and still is in the rivals' fits.
    if len(found.slots) == len(found.small.model.found):
        found = _exchanged(found, holdout, exclude, beliefs)
    slots, least = list[Slot](), list[float]()
    for effect, slot in zip(found.final.model.found, found.slots, strict=False):
        own = Site(effect.name, effect.site)
        close = [r for r in slot if r.probability >= beliefs.listed or r.site == own]
        certain = slot[0].site == own and slot[0].probability >= beliefs.sure
        if not certain and len(close) > 1:
            left = _left(found, close, holdout, beliefs)
            slot = _alike(
                slot, own, dict(zip((r.site for r in close), left, strict=True)), beliefs
            )
            least += left
        slots.append(slot)
    return replace(found, slots=tuple(slots)), min(least, default=None)


def _exchanged(
    found: Search, holdout: Sequence[Recording], exclude: Sequence[str], beliefs: Beliefs
) -> Search:
    """Return the search with every effect replaced by its like where that alone carries over."""
    for _ in found.slots:
        likes = [r for r in _likes(found, beliefs) if r.site.effect not in exclude]
        left = _left(found, likes, holdout, beliefs)
        least = min(left, default=float('inf'))
        if not likes or (1.0 + beliefs.parted) * least > left_on(found, holdout, beliefs):
            break
        better = likes[left.index(least)]
        tried = refitted(found, better.fit)
        if implausible(tried.final.model):
            break
        slots = tuple(
            rivals(found.work, better.fit, k, tried.effective)
            for k in range(len(better.fit.model.found))
        )
        found = with_structural_aliases(replace(tried, slots=slots), exclude, beliefs)
    return found


def _likes(found: Search, beliefs: Beliefs) -> Iterator[Rival]:
    """Yield the rivals that could be in the model as well."""
    for slot in found.slots:
        for rival in slot:
            if rival.probability >= beliefs.listed and rival.fit is not found.small:
                yield rival


def _left(
    found: Search, some: Sequence[Rival], holdout: Sequence[Recording], beliefs: Beliefs
) -> list[float]:
    """Return what each rival leaves on held-out recordings, RMS [m]."""
    return [left_on(replace(found, final=rival.fit), holdout, beliefs) for rival in some]


def _alike(slot: Slot, own: Site, left: dict[Site, float], beliefs: Beliefs) -> Slot:
    """Return a slot without the rivals that leave more than the effect in the model."""
    most = (1.0 + beliefs.parted) * min(left.values())
    if left.get(own, most) > most:
        return slot
    kept = [rival for rival in slot if left.get(rival.site, most) <= most]
    whole = sum(rival.probability for rival in kept)
    return tuple(replace(rival, probability=rival.probability / whole) for rival in kept)
