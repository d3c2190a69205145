# Copyright 2026 weld_twin contributors
# SPDX-License-Identifier: Apache-2.0
"""
What held-out recordings choose among the effects found and their alternatives.

A joint that hardly moves shows its zero and its gear ratio alike, and the search takes one of the
two. Where a held-out motion moves it, they part. Nothing is fitted to the held-out recordings; they
choose among two or three, and only where these part plainly.
"""

from __future__ import annotations

from collections.abc import Callable, Sequence
from dataclasses import replace
from itertools import chain

from ..algebra.seed_systems import Role
from ..beliefs import Beliefs
from ..evidence import Alternative, CandidateSet, Search
from ..result import Site
from .alternatives import fit_alternatives, with_leads
from .search import refitted
from .selection import implausible

LeftOn = Callable[[Search], float]
"""What the final model of a search leaves on held-out recordings, RMS [m]."""


def borne_out(result: Search, left_on: LeftOn, beliefs: Beliefs) -> Search:
    """
    Return the search with the effects and the alternatives that held-out recordings bear out.

    An effect gives its place to its like where that alone carries over. Then those that leave more
    than the effect in the model are no alternatives.

    left_on: what held-out recordings say of a model.
    """
    # What no machine has is left out of the model and its candidate sets, not of their fits.
    if len(result.candidate_sets) == len(result.small.model.found):
        result = _exchanged(result, left_on, beliefs)
    candidate_sets = list[CandidateSet]()
    for effect, candidate_set in zip(
        result.final.model.found, result.candidate_sets, strict=False
    ):
        own = Site.of(effect)
        close = [r for r in candidate_set if r.probability >= beliefs.listed or r.site == own]
        certain = candidate_set[0].site == own and candidate_set[0].probability >= beliefs.sure
        if not certain and len(close) > 1:
            remaining = _left(result, close, left_on)
            by_site = dict(zip((r.site for r in close), remaining, strict=True))
            candidate_set = _alike(candidate_set, own, by_site, beliefs)
        candidate_sets.append(candidate_set)
    return replace(result, candidate_sets=tuple(candidate_sets))


def _exchanged(result: Search, left_on: LeftOn, beliefs: Beliefs) -> Search:
    """Return the search with every effect replaced by its like where that alone carries over."""
    for _ in result.candidate_sets:
        # Those that could be in the model as well.
        likes = [
            one
            for one in chain.from_iterable(result.candidate_sets)
            if one.probability >= beliefs.listed
            and one.fit is not result.small
            and one.role is not Role.TAKEN_OUT
        ]
        remaining = _left(result, likes, left_on)
        least = min(remaining, default=float('inf'))
        if not likes or (1.0 + beliefs.parted) * least > left_on(result):
            break
        better = likes[remaining.index(least)]
        tried = refitted(result, better.fit)
        if implausible(tried.final.model):
            break
        case = result.work, better.fit
        every = [fit_alternatives(*case, k) for k in range(len(better.fit.model.found))]
        candidate_sets, refused = with_leads(*case, every)
        result = replace(tried, candidate_sets=candidate_sets, refused=(*tried.refused, *refused))
    return result


def _left(result: Search, some: Sequence[Alternative], left_on: LeftOn) -> list[float]:
    """Return what each alternative leaves on held-out recordings, RMS [m]."""
    return [left_on(replace(result, final=one.fit)) for one in some]


def _alike(
    candidate_set: CandidateSet, own: Site, remaining: dict[Site, float], beliefs: Beliefs
) -> CandidateSet:
    """Return a candidate set without the alternatives that leave more than the effect in the model."""
    most = (1.0 + beliefs.parted) * min(remaining.values())
    if remaining.get(own, most) > most:
        return candidate_set
    kept = [one for one in candidate_set if remaining.get(one.site, most) <= most]
    whole = sum(one.probability for one in kept)
    return tuple(replace(one, probability=one.probability / whole) for one in kept)
