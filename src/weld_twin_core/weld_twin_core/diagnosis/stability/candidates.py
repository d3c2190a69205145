# Copyright 2026 weld_twin contributors
# SPDX-License-Identifier: Apache-2.0
"""Who may be named on a half of the data: what was found, its rivals, and what came close."""

from __future__ import annotations

from collections.abc import Iterator
from dataclasses import dataclass

import numpy as np

from ...arrays import Array
from ...effects.effect import Effect
from ...effects.plausible import beyond
from ...twin.features import Features
from ..hypotheses.search import Search
from ..hypotheses.seed_systems import ranking
from ..result import Site

OTHERS = 8
"""Units that the search would have begun with, taken along beside those found and their rivals."""
MOST = 60
"""Columns of all candidates at the most: the cost grows with their square."""


@dataclass(frozen=True, eq=False)
class Candidate:
    """
    One effect that may be named, linear about the values that it was fitted with.

    Attributes
    ----------
    effect : Effect
    columns : array, shape (K, rows)
    freedom : int
        Coordinates that it takes in the search.
    trials : float
        Among how many it was chosen.

    """

    effect: Effect
    columns: Array
    freedom: int
    trials: float

    @property
    def site(self) -> Site:
        """Return its family and joint."""
        return Site(self.effect.name, self.effect.site)


def candidates_of(found: Search, frames: Array, bare: Array) -> list[Candidate]:
    """
    Return the candidates, those found first.

    Parameters
    ----------
    found : Search
    frames : array, shape (F, rows)
        Columns of the frames that are fitted along.
    bare : array, shape (rows,)
        What is to be explained.

    """
    features = found.work.problem.features(found.small.model)
    out = [_of_effect(found, features, effect) for effect in found.small.model.found]
    taken, count = {own.site for own in out}, sum(len(own.columns) for own in out)
    for more in (*_rivals(found, features), *_others(found, frames, bare)):
        fits = count + len(more.columns) <= MOST and np.isfinite(more.columns).all()
        if fits and more.site not in taken | found.ruled_out:
            out.append(more)
            taken.add(more.site)
            count += len(more.columns)
    return out


def _of_effect(found: Search, features: list[Features], effect: Effect) -> Candidate:
    """Return a fitted effect as a candidate."""
    problem = found.work.problem
    columns = problem.whitened(problem.effect_columns(features, effect), found.work.scale)
    unit = found.library.unit(effect.name, effect.site)
    trials = unit.trials if unit is not None else 1.0
    freedom = effect.coordinates().size
    return Candidate(effect, columns, freedom, trials)


def _rivals(found: Search, features: list[Features]) -> Iterator[Candidate]:
    """Yield the rivals of every slot as they were fitted in its place, most probable first."""
    rivals = [rival for slot in found.slots for rival in slot]
    for rival in sorted(rivals, key=lambda one: -one.probability):
        for effect in rival.fit.model.found:
            if Site(effect.name, effect.site) == rival.site and effect.coordinates().any():
                yield _of_effect(found, features, effect)


def _others(found: Search, frames: Array, bare: Array) -> Iterator[Candidate]:
    """Yield the units that explain most where nothing is found yet, as the search starts them."""
    library, robot = found.library, found.small.model.robot
    products = library.products(np.concatenate([frames, bare[None]]))
    systems = library.systems.beside(frames, bare, products)
    ranked = ranking(systems, library.units, found.effective(found.small))
    for choice in [own for own in ranked if own.nats > 0.0][:OTHERS]:
        effect = choice.effect()
        if not beyond(robot, effect):
            columns = np.array([library.column(int(number)) for number in choice.columns])
            yield Candidate(effect, columns, choice.columns.size, choice.unit.trials)
