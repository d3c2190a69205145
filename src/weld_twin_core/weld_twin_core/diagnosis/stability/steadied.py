# Copyright 2026 weld_twin contributors
# SPDX-License-Identifier: Apache-2.0
"""
What follows where a name does not come back: no name alone is sure, and what came instead is told.

A name that comes back on enough halves is left as it is. Of another, belief is shared as the halves
share it: among what is named and what came in its place. What came to nothing stays unbelieved.
"""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass, replace

from ..algebra.fit import fit
from ..beliefs import Beliefs
from ..hypotheses.rivals import Rival, nats_in_place
from ..hypotheses.search import Search
from ..hypotheses.selection import fitted_with, implausible
from ..many.weighed_families import WeighedFamily
from ..result import CameBack, Cause, Site
from ..verdict.decision import Verdict, leaders
from .repeated import Repeated


@dataclass(frozen=True, eq=False)
class Stability:
    """
    What halves of the data say of the names.

    Attributes
    ----------
    again : Repeated
        The search on halves.
    came_back : mapping from Site to CameBack
        Of the effects found, each with what was told as alike before halves were asked.

    """

    again: Repeated
    came_back: Mapping[Site, CameBack]


def came_back(
    found: Search, verdict: Verdict, stability: Stability | None
) -> tuple[CameBack | None, ...]:
    """
    Return how often every effect found came back, itself or what it is named together with.

    Parameters
    ----------
    found : Search
    verdict : Verdict
    stability : Stability or None
        None tells nothing of any.

    """
    sites = [Site(effect.name, effect.site) for effect in found.final.model.found]
    if stability is None:
        return (None,) * len(sites)
    alike = [next((group for group in verdict.sets if s in group), (s,)) for s in sites]
    return tuple(stability.again.came_back(s, a) for s, a in zip(sites, alike, strict=True))


def steadied(
    found: Search, again: Repeated | None, beliefs: Beliefs
) -> tuple[Search, Stability | None]:
    """
    Return what was found with the rivals of every slot as likely as halves of the data say.

    Parameters
    ----------
    found : Search
    again : Repeated or None
        The search on halves; None changes nothing.
    beliefs : Beliefs

    """
    if again is None:
        return found, None
    slots, came = [], {}
    for effect, slot in zip(found.final.model.found, found.slots, strict=False):
        site, named = Site(effect.name, effect.site), leaders(slot, beliefs)
        told = again.came_back(site, named)
        if told is not None:
            came[site] = told
            if told.share < beliefs.returns:
                slot = _shared(found, again, slot, site, named, told, beliefs)
        slots.append(slot)
    slots += found.slots[len(slots) :]
    return replace(found, slots=tuple(slots)), Stability(again, came)


def _shared(
    found: Search,
    again: Repeated,
    slot: tuple[Rival, ...],
    site: Site,
    named: Sequence[Site],
    told: CameBack,
    beliefs: Beliefs,
) -> tuple[Rival, ...]:
    """Return a slot whose probabilities are shares of halves."""
    # What the model holds stays listed, however seldom it comes back.
    own = max(told.share, 1.0 - beliefs.sure)
    mass = sum(r.probability for r in slot if r.site in named)
    out = [replace(r, probability=r.probability * own / mass) for r in slot if r.site in named]
    came = [(s, n) for s, n in told.instead if n >= beliefs.listed * told.of]
    whole = max(sum(n for _, n in came), told.of - told.times, 1)
    for other, times in came:
        rival = next((r for r in slot if r.site == other), None) or _fitted(
            found, again, site, other
        )
        if rival is not None:
            out.append(replace(rival, probability=(1.0 - own) * times / whole))
    return tuple(sorted(out, key=lambda rival: -rival.probability))


def _fitted(found: Search, again: Repeated, site: Site, other: Site) -> Rival | None:
    """Return another effect fitted in the place of one found."""
    model, work = found.small.model, found.work
    k = [Site(e.name, e.site) for e in model.found].index(site)
    effect = next(own.effect for own in again.candidates if own.site == other)
    rest = fit(work.problem, model.without(k), work.scale, None, 4)
    tried = fitted_with(work, rest.model, effect)
    if implausible(tried.model):
        return None
    return Rival(other, nats_in_place(rest, tried, found.effective(found.small)), tried)


def told_back(
    causes: Sequence[Cause], verdict: Verdict, stability: Stability | None
) -> tuple[Cause, ...]:
    """
    Return causes with how often each comes back.

    Parameters
    ----------
    causes : sequence of Cause
    verdict : Verdict
    stability : Stability or None
        None changes nothing.

    """
    if stability is None:
        return tuple(causes)
    named = {site for group in verdict.sets for site in group}
    out = []
    for cause in causes:
        site = next((s for s, _ in cause.name if s in stability.came_back and s in named), None)
        out.append(cause if site is None else replace(cause, came_back=stability.came_back[site]))
    return tuple(out)


def of_families(
    causes: Sequence[Cause], families: Sequence[WeighedFamily], beliefs: Beliefs
) -> tuple[Cause, ...]:
    """
    Return causes of many small errors with how often their families come back.

    Each part of the recordings is left out in turn; a family comes back where it is missed there.
    Of several families in one cause the one that comes back least is told.

    Parameters
    ----------
    causes : sequence of Cause
    families : sequence of WeighedFamily
    beliefs : Beliefs

    """
    came = {
        own.effect: CameBack(sum(g > beliefs.family_worth for g in own.growths), len(own.growths))
        for own in families
        if own.growths
    }
    out = []
    for cause in causes:
        own = [came[s.effect] for s, _ in cause.name if s.effect in came]
        least = min(own, key=lambda told: told.share, default=None)
        out.append(replace(cause, came_back=least))
    return tuple(out)
