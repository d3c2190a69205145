# Copyright 2026 weld_twin contributors
# SPDX-License-Identifier: Apache-2.0
"""What a search works on: the columns of every candidate, computed once, and fits of sets of them."""

from __future__ import annotations

from collections.abc import Iterable, Sequence
from dataclasses import dataclass, field
from functools import cached_property
from weakref import WeakKeyDictionary

import numpy as np

from ...effects.effect import Effect
from ..beliefs import Beliefs
from .columns import Columns, designed
from .definite import EMPTY
from .fit import Fit, design, fit, predict_fit
from .independent_rows import effective_share
from .problem import Model, Problem, Scale, Site
from .seed_systems import Choice, Part, Role, SeedSystems, Unit, evidence, parts, ranking
from .starts import started

FAR, FAR_SHARE = 60.0, 1.5
"""Log Bayes factor behind, and times what is left, from which on a fit that a linear step foretells is
not worth doing: others that bend take over some of what is missing, but not a third."""


@dataclass(frozen=True, eq=False)
class Library:
    """Columns of every unit."""

    columns: Columns
    """All of them, in the order of their numbers."""
    systems: SeedSystems
    """The normal matrix of every seed."""
    units: tuple[Unit, ...]
    absent: dict[str, str]
    """Why a family is not considered, by name."""

    @cached_property
    def seeds_of(self) -> dict[Part, list[int]]:
        """Return the seeds of every part, and of every effect as a whole, counted over the units."""
        out: dict[Part, list[int]] = {}
        for k, seed in enumerate(seed for unit in self.units for seed in unit.seeds):
            for part in {*parts(seed), Part(Site.of(seed))}:
                out.setdefault(part, []).append(k)
        return out


@dataclass(frozen=True, eq=False)
class Workspace:
    """
    What selection works on: the problem, its noise, the shared library, and beliefs.

    The library's own products are computed once; residuals change, columns do not.
    """

    problem: Problem
    scale: Scale
    library: Library
    beliefs: Beliefs
    bare_rss: float
    """Whitened sum of squares before any effect was found."""
    _without: WeakKeyDictionary[Fit, dict[int, Fit]] = field(
        default_factory=WeakKeyDictionary, init=False, repr=False
    )

    def effective(self, result: Fit, trust: float = 1.0) -> float:
        """
        Return the number of independent rows that the evidence of a fit may count.

        Frames that are fitted along take rows away. Two more things make a residual less telling than
        its count: autocorrelation, and physics richer than the model. An explained sum of squares E
        leaves about ``beliefs.misfit``^2 E of misfit in some ``beliefs.misfit_directions`` directions,
        and any further column may pick that up by chance.

        trust: exponent between 0 and 1 by which autocorrelation is believed: while causes are
        still missing from the model, it is theirs.
        """
        problem, beliefs, found = self.problem, self.beliefs, result.model.found
        share = effective_share(result.residual, problem.rows, problem.samples) ** trust
        count = share * max(result.residual.size - problem.frame_count, 1)
        # What entered first explains most, and so does what its formula misses.
        misfit = beliefs.misfit * (found[0].fit.ideal if found else 1.0)
        explained = max(self.bare_rss - result.rss, 0.0) / max(result.rss, EMPTY) * count
        return float(count / (1.0 + misfit**2 * explained / beliefs.misfit_directions))

    def independent(self, fits: Sequence[Fit]) -> float:
        """
        Return the number of independent rows by which fits are weighed against each other.

        One count for all, that of the one which leaves least: a worse model explains less and would
        otherwise be allowed more rows.
        """
        return self.effective(min(fits, key=lambda f: f.rss))

    def without(self, now: Fit, k: int) -> Fit:
        """Return the fit without found effect k of another, made once."""
        known = self._without.setdefault(now, {})
        if k not in known:
            known[k] = self.fitted(now.model.without(k))
        return known[k]

    def predict_without(self, now: Fit) -> list[tuple[float, float]]:
        """
        Return of every found effect what a fit without it will leave, and how much it changes.

        About the whitened sum of squares; and the RMS change of the residual [noise] as the effect
        goes, before anything is fitted anew.
        """
        own, out = designed(self.problem, now.model, self.scale), []
        place = own.count - now.coordinates.size
        for k, effect in enumerate(now.model.found):
            end = place + effect.fit.coordinates().size
            others = own.chosen(np.delete(np.arange(own.count), slice(place, end)))
            bare = now.model.without(k)
            residual, rss = predict_fit(self.problem, bare, self.scale, others)
            out.append((rss, float(np.sqrt(((residual - now.residual) ** 2).mean()))))
            place = end
        return out

    def fitted(self, model: Model, iterations: int = 4, most: float = np.inf) -> Fit:
        """Return the fit of a model that is nearly there; of one that leaves too much, a sketch."""
        return fit(self.problem, model, self.scale, None, iterations, most=most)

    def fitted_with(self, model: Model, effect: Effect) -> Fit:
        """Return the fit of a model with one more effect, merged where its kind can merge."""
        effect = started(self.problem, model, self.scale, effect)
        return self.fitted(model.with_found(merged(model.found, effect)), 5)

    def ahead(self, own: Fit, now: Fit) -> float:
        """
        Return by how much log Bayes factor one set is ahead of another.

        An effect or a wave more costs what it costs to enter: that two errors happen to be one
        is seldom.

        own, now: the one and the other.
        """
        trials = {unit.site: float(np.log(unit.trials)) for unit in self.library.units}

        def cost(result: Fit) -> float:
            each = (part for effect in result.model.found for part in parts(effect))
            return sum(trials.get(part.site, 0.0) + self.beliefs.enter_log_bayes for part in each)

        more = float(own.coordinates.size - now.coordinates.size)
        count = self.independent((now, own))
        return evidence(now.rss, now.rss - own.rss, more, count) - cost(own) + cost(now)

    def hopeless(self, now: Fit) -> float:
        """Return the sum of squares from which on nothing can take the place of what was found."""
        with np.errstate(
            over='ignore'
        ):  # without noise a handful of rows count, and nothing is hopeless
            return now.rss * max(float(np.exp(2.0 * FAR / self.effective(now))), FAR_SHARE)

    def beside(self, now: Fit) -> SeedSystems:
        """Return the normal equations of all seeds given a fit: its frames and effects fitted."""
        own = design(self.problem, now.model, self.scale)
        products = self.library.columns.products(np.concatenate([own, now.residual[None]]))
        return self.library.systems.given(own @ own.T, own @ now.residual, now.rss, products)

    def ranked(
        self, now: Fit, count: float, least: float = -np.inf, roles: Iterable[Role] = (Role.FOUND,)
    ) -> list[Choice]:
        """Return what units are worth beside a fit, as `ranking` does."""
        return ranking(self.beside(now), self.library.units, count, least, tuple(roles))


def merged(result: tuple[Effect, ...], effect: Effect) -> tuple[Effect, ...]:
    """Return the effects with one more, in one with its like where their kind can join."""
    for k, other in enumerate(result):
        if Site.of(other) == Site.of(effect):
            both = other.search.joined(effect)
            if both is not None:
                return (*result[:k], both, *result[k + 1 :])
    return (*result, effect)
