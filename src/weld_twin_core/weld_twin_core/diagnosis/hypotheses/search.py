# Copyright 2026 weld_twin contributors
# SPDX-License-Identifier: Apache-2.0
"""
From recordings to a fitted set of effects: baseline, selection, final fit; what held-out data choose.

A joint that hardly moves shows its zero and its gear ratio alike. Where a held-out motion moves it,
they part: nothing is fitted to it, but it chooses among two or three where these part plainly.
"""

from __future__ import annotations

from collections.abc import Callable, Sequence
from dataclasses import replace
from itertools import chain

from ...effects.effect import Effect
from ...effects.plausible import beyond
from ..algebra.fit import Fit, effect_precision, fit, robust_fit, robust_scale
from ..algebra.problem import ROWS, Model, Problem
from ..algebra.workspace import Role, Workspace
from ..beliefs import Beliefs
from ..evidence import Alternative, CandidateSet, Search
from ..result import Site
from .alternatives import fit_alternatives, with_leads
from .library import build
from .other_sets import AHEAD, Sets, reconsidered
from .selection import ROUNDS, backward, forward, implausible, possible, possible_part, sites

FIT_ROWS = 30000
"""Rows that a final fit works on; more only take time, as neighbours err alike."""
Progress = Callable[[str], None]
LeftOn = Callable[[Search], float]
"""What the final model of a search leaves on held-out recordings, RMS [m]."""


def search(
    problem: Problem, start: Model, exclude: Sequence[str], beliefs: Beliefs, progress: Progress
) -> Search:
    """Return the effects that earn their place, fitted on all measurements, frames as started."""
    full = problem.thinned(FIT_ROWS)
    # Position and orientation weigh as the gap itself spreads, so that neither pays for the other.
    baseline, scale = robust_fit(full, start)
    progress('baseline fitted')
    few = problem.thinned(ROWS)
    work, now, refused, crowded = _chosen(few, baseline.model, exclude, beliefs, progress)
    candidate_sets: tuple[CandidateSet, ...] = ()
    if not crowded:
        now = possible(work, now, refused)
        now, candidate_sets = settled(work, now, progress)
        candidate_sets, better = with_leads(work, now, candidate_sets)
        refused += better
    final, scale = robust_fit(full, now.model, rounds=1)
    if absurd := implausible(final.model):
        refused += absurd
        kept = [k for k, e in enumerate(final.model.found) if not beyond(final.model.robot, e)]
        candidate_sets = tuple(candidate_sets[k] for k in kept) if candidate_sets else ()
        final, scale = robust_fit(full, possible_part(final.model), rounds=1)
    return Search(
        problem=full,
        scale=scale,
        baseline=baseline,
        final=final,
        precision=effect_precision(final.model),
        work=work,
        small=now,
        candidate_sets=candidate_sets,
        crowded=crowded,
        refused=tuple(refused),
    )


def refitted(result: Search, small: Fit) -> Search:
    """Return a search with another choice, fitted on few measurements, fitted on all of them."""
    final, scale = robust_fit(result.problem, small.model, rounds=1)
    precision = effect_precision(final.model)
    return replace(result, small=small, final=final, scale=scale, precision=precision)


def _chosen(
    few: Problem, model: Model, exclude: Sequence[str], beliefs: Beliefs, progress: Progress
) -> tuple[Workspace, Fit, list[Effect], bool]:
    """
    Return the effects chosen, with a library built anew until the choice stays.

    What they were chosen from, their fit, what no machine has so large, and whether they came so
    many that the selection among them was not finished: of what enters one by one, what came later
    may stand for some that came before.
    """
    work, now = workspace(few, model, exclude, beliefs)
    for attempt in range(ROUNDS):
        before = names(now.model)
        grown, refused = forward(work, now, beliefs.many, progress)
        if grown is not now:
            now = backward(work, grown)
        crowded = few.at_rest and len(now.model.found) >= beliefs.many
        if crowded or names(now.model) == before or attempt == ROUNDS - 1:
            break
        model = now.model
        del work, now, grown  # or two libraries would be in memory at once
        work, now = workspace(few, model, exclude, beliefs)
    return work, now, refused, crowded


def settled(work: Workspace, now: Fit, progress: Progress) -> tuple[Fit, tuple[CandidateSet, ...]]:
    """Return the fit in which every effect is the best in its place, and its alternatives."""
    if not now.model.found:
        return now, ()
    sets, had = Sets.about(work, now), [names(now.model)]
    for attempt in range(ROUNDS + 1):
        now, others = reconsidered(work, now, sets)
        progress('other sets weighed')
        candidate_sets = []
        for k, effect in enumerate(now.model.found):
            candidate_sets.append(fit_alternatives(work, now, k, others))
            progress(f'alternatives of {Site.of(effect)} weighed')
            leader = candidate_sets[-1][0]
            own = next(r for r in candidate_sets[-1] if r.fit is now)
            # What was had before comes back only where that is more than rounding.
            most = own.log_bayes + AHEAD * (names(leader.fit.model) in had)
            if leader.log_bayes > most and attempt < ROUNDS:
                swapped = backward(work, leader.fit)
                # An alternative that does not earn a place itself takes none from what did.
                if leader.site in sites(swapped):
                    now = swapped
                    had.append(names(now.model))
                    break
        else:
            break
    return now, tuple(candidate_sets)


def names(model: Model) -> list[tuple[str, str | None, int]]:
    return sorted(
        ((*Site.of(e), e.fit.coordinates().size) for e in model.found),
        key=lambda item: (item[0], item[1] or '', item[2]),
    )


def workspace(
    problem: Problem, model: Model, exclude: Sequence[str], beliefs: Beliefs
) -> tuple[Workspace, Fit]:
    """Return what selection works on, and the fit that it starts from."""
    scale = robust_scale(problem, problem.residuals(model))
    now = fit(problem, model, scale)
    bare = fit(problem, now.model.with_found(()), scale).rss
    library = build(problem, now.model, scale, exclude)
    return Workspace(problem, scale, library, beliefs, bare), now


def borne_out(result: Search, left_on: LeftOn, beliefs: Beliefs) -> Search:
    """
    Return the search with the effects and the alternatives that held-out recordings bear out.

    An effect gives its place to its like where that alone carries over. Then those that leave more
    than the effect in the model are no alternatives.
    """
    # What no machine has is left out of the model and its candidate sets, not of their fits.
    if len(result.candidate_sets) == len(result.small.model.found):
        result = _exchanged(result, left_on, beliefs)
    candidate_sets = list[CandidateSet]()
    pairs = zip(result.final.model.found, result.candidate_sets, strict=False)
    for effect, candidate_set in pairs:
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
        if not likes or (1.0 + beliefs.unexplained) * least > left_on(result):
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
    return [left_on(replace(result, final=one.fit)) for one in some]


def _alike(
    candidate_set: CandidateSet, own: Site, remaining: dict[Site, float], beliefs: Beliefs
) -> CandidateSet:
    """Return a candidate set without the alternatives that leave more than the effect in the model."""
    most = (1.0 + beliefs.unexplained) * min(remaining.values())
    if remaining.get(own, most) > most:
        return candidate_set
    kept = [one for one in candidate_set if remaining.get(one.site, most) <= most]
    whole = sum(one.probability for one in kept)
    return tuple(replace(one, probability=one.probability / whole) for one in kept)
