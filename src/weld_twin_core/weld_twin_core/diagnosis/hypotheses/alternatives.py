# Copyright 2026 weld_twin contributors
# SPDX-License-Identifier: Apache-2.0
"""
Who else could have done it: for every effect found, the others that would do as well in its place.

Excluded effects, and what is no more than a constant as its joint does not move, are compared too.
Where one fits as well, no data can vouch for the name alone, and they are a set; where it fits clearly
better, what was found stands in for a cause that the library lacks. None counts for more than what was
found.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import replace

import numpy as np

from ...arrays import Array
from ...effects.effect import Effect
from ..algebra.fit import Fit
from ..algebra.motions import constant, of_no_size, same_error
from ..algebra.problem import Model
from ..algebra.workspace import Choice, Part, Role, Workspace, lead, parts_of
from ..beliefs import SHORTLIST
from ..evidence import Alternative, CandidateSet
from ..result import Site
from .other_sets import Other
from .selection import backward, implausible, sites


def fit_alternatives(
    work: Workspace, now: Fit, k: int, others: Sequence[Other] = ()
) -> CandidateSet:
    """Return found effect k and what could take its place, in company (``others``), likeliest first."""
    place = Site.of(now.model.found[k])
    rest = work.without(now, k)
    count = work.effective(now)
    ranked = work.ranked(rest, count, roles=Role)
    own = next((c for c in ranked if c.unit.site == place), None)
    # Started from what the others are beside the found effect: without it they may have gone far off.
    start = now.model.without(k)
    tried = [
        (choice, other)
        for role in Role
        for choice in _near(work, ranked, role, sites(now))
        if (other := _possible(work, start, choice, rest, count)) is not None
    ]
    count = work.independent([now, *(f for _, f in tried)])

    def log_bayes(full: Fit, choice: Choice | None) -> float:
        freedom, surprise = float(full.coordinates.size - rest.coordinates.size), 0.0
        if choice is not None:
            # Unused components of a vector effect buy nothing and cost nothing.
            freedom -= max(choice.unit.columns[choice.seed].size - choice.columns.size, 0)
            surprise = choice.surprise
        # What may only stand beside what was found does so as the same on these data, however large.
        alike = choice is not None and choice.unit.role is not Role.FOUND
        size = now.sized - full.sized if alike else 0.0
        return lead(full, rest, freedom, count) + size - surprise

    out = [Alternative(place, log_bayes(now, own), now)]
    for choice, other in tried:
        each = choice.unit.site, log_bayes(other, choice), other
        out.append(Alternative(*each, role=choice.unit.role))
    for instead in (one for one in others if one.instead_of == Part(place)):
        # What it has that was not found, what entered first before the others; or another wave.
        known = {*parts_of(now), *(Part(one.site) for one in out)}
        first = next((part for part in parts_of(instead.fit) if part not in known), None)
        if first is not None:
            out.append(Alternative(first.site, out[0].log_bayes + instead.ahead, instead.fit))
    return _weighed(out, work.beliefs.temperature)


def _possible(
    work: Workspace, start: Model, choice: Choice, rest: Fit, count: float
) -> Fit | None:
    """
    Return the fit of a model with the form of a choice that machines have and that explains most.

    A joint at rest beside two others at rest may be turned by either; one may be too near zero for it.
    """
    best = choice.effect()
    forms = {**{seed.key: seed for seed in choice.unit.seeds}, best.key: best}
    fits = [work.fitted_with(start, effect) for effect in forms.values()]
    possible = [fit for fit in fits if not implausible(fit.model)]
    return max(possible, key=lambda fit: lead(fit, rest, 0.0, count), default=None)


def _near(
    work: Workspace, ranked: Sequence[Choice], role: Role, taken: Sequence[Site]
) -> list[Choice]:
    """Return the choices of a role near the best of them; of what may not be in the model, of all."""
    choices = [c for c in ranked if c.unit.role is role and c.unit.site not in taken]
    best = max((c.log_bayes for c in (choices if role is Role.FOUND else ranked)), default=0.0)
    least = max(
        best - max(work.beliefs.alternative_log_bayes, work.beliefs.alternative_share * best), 0.0
    )
    near = [c for c in choices if c.log_bayes > least]
    return near[:SHORTLIST]


def _weighed(every: Sequence[Alternative], temperature: float) -> CandidateSet:
    """Return the best alternative of every site, probabilities adding up to one, most probable first."""
    most = max(one.log_bayes for one in every if one.role is Role.FOUND)
    out: dict[Site, Alternative] = {}
    for one in every:
        if one.role is not Role.FOUND:
            one = replace(one, log_bayes=min(one.log_bayes, most), ahead=one.log_bayes - most)
        if one.site not in out or one.log_bayes > out[one.site].log_bayes:
            out[one.site] = one
    log_bayes = np.array([one.log_bayes for one in out.values()])
    weights = np.exp((log_bayes - most) / temperature)
    weights /= weights.sum()
    pairs = zip(out.values(), weights.tolist(), strict=True)
    weighed = (replace(r, probability=w) for r, w in pairs)
    return tuple(sorted(weighed, key=lambda r: -r.probability))


def with_leads(
    work: Workspace, now: Fit, candidate_sets: Sequence[CandidateSet]
) -> tuple[tuple[CandidateSet, ...], list[Effect]]:
    """
    Return the candidate sets, and what was taken out and fits clearly better than what was found.

    That is no alternative any more; everything in the places that it replaces is behind it.
    """
    behind, refused, out = np.zeros(len(candidate_sets)), list[Effect](), list[CandidateSet]()
    for candidate_set, effect in zip(candidate_sets, now.model.found, strict=True):
        taken_out = [one for one in candidate_set if one.role is Role.TAKEN_OUT]
        # What is the same error on any motion is ahead by its fewer numbers alone.
        foreign = [one for one in taken_out if not _same_anywhere(now, effect, one)]
        best = max(foreign, key=lambda one: one.ahead, default=None)
        if best is not None and (lead := _lead(work, now, best)) is not None:
            refused.append(best.fit.model.found[-1])
            behind = np.maximum(behind, lead)
            candidate_set = _weighed(
                [one for one in candidate_set if one is not best], work.beliefs.temperature
            )
        out.append(candidate_set)
    pairs = zip(out, behind.tolist(), strict=True)
    each = (tuple(replace(one, behind=b) for one in own) for own, b in pairs)
    return tuple(each), refused


def _same_anywhere(now: Fit, effect: Effect, other: Alternative) -> bool:
    beside = of_no_size(other.site)
    constants = constant(type(effect)) and constant(type(beside))
    return constants and same_error(now.model.robot, effect, beside)


def _lead(work: Workspace, now: Fit, other: Alternative) -> Array | None:
    """Return how far something taken out is clearly ahead of all that it replaces, or None."""
    own = backward(work, other.fit)
    kept = sites(own)
    if other.site not in kept:
        return None
    log_bayes = work.ahead(own, now)
    if log_bayes <= work.beliefs.enter_log_bayes:
        return None
    return np.array([log_bayes * (site not in kept) for site in sites(now)])
