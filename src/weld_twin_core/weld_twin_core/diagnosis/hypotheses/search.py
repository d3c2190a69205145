# Copyright 2026 weld_twin contributors
# SPDX-License-Identifier: Apache-2.0
"""From recordings to a fitted set of effects: baseline, selection, small errors, final fit."""

from __future__ import annotations

from collections.abc import Callable, Sequence
from dataclasses import dataclass, replace
from typing import NamedTuple

from ...arrays import Array
from ...effects.effect import Effect
from ...effects.plausible import beyond
from ..algebra.fit import Fit, fit, robust_fit, robust_scale
from ..algebra.independent_rows import effective_share
from ..algebra.prior import effect_precision
from ..algebra.problem import Model, Problem, Scale
from ..beliefs import Beliefs
from ..result import Site
from .library import Library, build
from .other_sets import AHEAD, Sets, reconsidered
from .rivals import Rival, rivals
from .selection import (
    Workspace,
    backward,
    forward,
    implausible,
    possible_part,
)

SEARCH_ROWS = 9000
"""Rows a search works on: what is found there is fitted again on all."""
FIT_ROWS = 30000
"""Rows that a final fit works on; more only take time, as neighbours err alike."""
ROUNDS = 3
"""Times that a library is built anew at what was found; the second seldom changes anything."""
SWAPS = 3
"""Times that a rival that is clearly ahead may take an effect's place before the search stops asking."""
Progress = Callable[[str], None]


@dataclass(frozen=True, eq=False)
class Search:
    """
    What a search found.

    Attributes
    ----------
    problem, scale : Problem, Scale
        All measurements, with the final noise and weights.
    baseline : Fit
        Frames and known effects only.
    precision : array, shape (K,)
        Prior precision of the final fit's coordinates.
    work : Workspace
        The library that rivals are drawn from.
    small : Fit
        The final fit on the workspace's measurements.
    bare_rss : float
        Sum of squares on the workspace's measurements without any found effect.
    slots : tuple of tuple of Rival
        For every found effect itself and its rivals; empty when many were fitted together.
    crowded : bool
        Whether so many units came one by one that the selection among them was not finished.
    dense : bool
        Whether many small errors were fitted together.
    refused : tuple of Effect
        What would explain the rest best, but no machine has.
    many : Search or None
        All kinds fitted together, where that predicts about as well as the few do.

    """

    problem: Problem
    scale: Scale
    baseline: Fit
    final: Fit
    precision: Array
    work: Workspace
    small: Fit
    bare_rss: float
    slots: tuple[tuple[Rival, ...], ...]
    crowded: bool = False
    dense: bool = False
    refused: tuple[Effect, ...] = ()
    many: Search | None = None

    @property
    def library(self) -> Library:
        """Return the library searched."""
        return self.work.library

    def effective(self, result: Fit) -> float:
        """Return the number of independent rows of a fit on the workspace's measurements."""
        return effective_rows(self.work.problem, result, self.bare_rss, self.work.beliefs)


def effective_rows(
    problem: Problem, result: Fit, bare_rss: float, beliefs: Beliefs, trust: float = 1.0
) -> float:
    """
    Return the number of independent rows that a fit's evidence may count.

    Frames that are fitted along take rows away. Two more things make a residual less telling than its
    count: autocorrelation, and physics richer than the model. An explained sum of squares E leaves
    about ``beliefs.misfit``^2 E of misfit in some ``beliefs.misfit_directions`` directions, and any
    further column may pick that up by chance.

    ``trust`` is how far to believe the autocorrelation, as its exponent: while causes are still
    missing from the model, it is theirs.

    Parameters
    ----------
    result : Fit
        A fit of the problem.
    bare_rss : float
        Whitened sum of squares before any effect was found.
    trust : float
        Exponent between 0 and 1; see above.

    """
    share = effective_share(result.residual, problem.rows, problem.samples) ** trust
    count = share * max(result.residual.size - problem.frame_count, 1)
    # What entered first explains most, and so does what its formula misses.
    misfit = beliefs.misfit * (result.model.found[0].fit.ideal if result.model.found else 1.0)
    explained = max(bare_rss - result.rss, 0.0) / max(result.rss, 1e-300) * count
    return float(count / (1.0 + misfit**2 * explained / beliefs.misfit_directions))


def search(
    problem: Problem, start: Model, exclude: Sequence[str], beliefs: Beliefs, progress: Progress
) -> Search:
    """
    Return the effects that earn their place, fitted on all measurements.

    Parameters
    ----------
    start : Model
        The nominal robot with frames to start from, and the effects known.

    """
    full = problem.thinned(FIT_ROWS)
    # Position and orientation weigh as the gap itself spreads, so that neither pays for the other.
    baseline, scale = robust_fit(full, start, robust_scale(full, full.residuals(start)))
    progress('baseline fitted')
    small = problem.thinned(SEARCH_ROWS)
    chosen = _chosen(small, baseline.model, exclude, beliefs, progress)
    work, now, bare = chosen.work, chosen.now, chosen.bare_rss
    slots: tuple[tuple[Rival, ...], ...] = ()
    refused = list(chosen.refused)
    if not chosen.crowded:
        now = possible(work, now, refused)

        def effective(result: Fit) -> float:
            return effective_rows(small, result, bare, beliefs)

        work = work.beside_usual(now, effective)
        now, slots = settled(work, now, effective, progress)
    final, scale = _fitted(full, now.model)
    if absurd := implausible(final.model):
        refused += absurd
        kept = [k for k, e in enumerate(final.model.found) if not beyond(final.model.robot, e)]
        slots = tuple(slots[k] for k in kept) if slots else ()
        final, scale = _fitted(full, possible_part(final.model))
    return Search(
        problem=full,
        scale=scale,
        baseline=baseline,
        final=final,
        precision=effect_precision(final.model),
        work=work,
        small=now,
        bare_rss=bare,
        slots=slots,
        crowded=chosen.crowded,
        refused=tuple(refused),
    )


def refitted(result: Search, small: Fit) -> Search:
    """
    Return what was found with another choice of effects, fitted on all measurements.

    Parameters
    ----------
    small : Fit
        The choice, fitted on the workspace's measurements.

    """
    final, scale = _fitted(result.problem, small.model)
    precision = effect_precision(final.model)
    return replace(result, small=small, final=final, scale=scale, precision=precision)


def _fitted(full: Problem, model: Model) -> tuple[Fit, Scale]:
    """Return the fit of a model that is nearly there, and its noise."""
    return robust_fit(full, model, robust_scale(full, full.residuals(model)), rounds=1)


class _Chosen(NamedTuple):
    """A selection: what it worked on, its fit, the bare sum of squares, whether it was crowded."""

    work: Workspace
    now: Fit
    bare_rss: float
    crowded: bool
    refused: tuple[Effect, ...]


def _chosen(
    small: Problem, model: Model, exclude: Sequence[str], beliefs: Beliefs, progress: Progress
) -> _Chosen:
    """Return the effects chosen, with a library built anew until the choice stays."""
    work, now, bare = _workspace(small, model, exclude, beliefs)
    refused: list[Effect] = []
    for _ in range(ROUNDS):
        before = names(model)

        def effective(result: Fit, bare: float = bare) -> float:
            return effective_rows(small, result, bare, beliefs)

        def hopeful(result: Fit, bare: float = bare) -> float:
            return effective_rows(small, result, bare, beliefs, beliefs.hope)

        refused = []
        steps = forward(work, now, hopeful, beliefs.many, progress, refused.append)
        if steps:
            now = backward(work, steps[-1].fit, effective)
        # Of what enters one by one, what came later may stand for some that came before.
        crowded = small.at_rest and len(now.model.found) >= beliefs.many
        model = now.model
        if crowded or names(model) == before:
            break
        del work  # or two libraries would be held at once
        work, now, bare = _workspace(small, model, exclude, beliefs)
    return _Chosen(work, now, bare, crowded, tuple(refused))


def possible(work: Workspace, now: Fit, refused: list[Effect]) -> Fit:
    """
    Return the fit without what no machine has; that is added to those refused.

    Parameters
    ----------
    refused : list of Effect
        Those refused so far; more are added to it.

    """
    while absurd := implausible(now.model):
        refused += absurd
        now = fit(work.problem, possible_part(now.model), work.scale, None, 4)
    return now


def settled(
    work: Workspace, now: Fit, effective: Callable[[Fit], float], progress: Progress
) -> tuple[Fit, tuple[tuple[Rival, ...], ...]]:
    """Return the fit in which every effect is the best in its place, and its rivals."""
    if not now.model.found:
        return now, ()
    sets, had = Sets.about(work, now), [names(now.model)]
    for attempt in range(SWAPS + 1):
        now, others = reconsidered(work, now, sets, effective)
        progress('other sets weighed')
        slots = []
        for k, effect in enumerate(now.model.found):
            slots.append(rivals(work, now, k, effective, others))
            progress(f'rivals of {Site(effect.name, effect.site)} weighed')
            leader, own = slots[-1][0], next(r for r in slots[-1] if r.fit is now)
            # What was had before comes back only where that is more than rounding.
            most = own.nats + AHEAD * (names(leader.fit.model) in had)
            if leader.nats > most and attempt < SWAPS:
                swapped = backward(work, leader.fit, effective)
                # A rival that does not earn a place itself takes none from what did.
                if leader.site in [Site(e.name, e.site) for e in swapped.model.found]:
                    now = swapped
                    had.append(names(now.model))
                    break
        else:
            break
    return now, tuple(slots)


def names(model: Model) -> list[tuple[str, str | None, int]]:
    """Return what tells one set of found effects from another."""
    return sorted(
        ((e.name, e.site, e.fit.coordinates().size) for e in model.found),
        key=lambda item: (item[0], item[1] or '', item[2]),
    )


def _workspace(
    problem: Problem, model: Model, exclude: Sequence[str], beliefs: Beliefs
) -> tuple[Workspace, Fit, float]:
    """Return what selection works on, the fit it starts from, and the bare sum of squares."""
    scale = robust_scale(problem, problem.residuals(model))
    now = fit(problem, model, scale, None, 4)
    bare = fit(problem, now.model.with_found(()), scale, None, 4).rss
    library = build(problem, now.model, scale, exclude)
    return Workspace(problem, scale, library, beliefs), now, bare
