# Copyright 2026 weld_twin contributors
# SPDX-License-Identifier: Apache-2.0
"""
Many small errors instead of a few: whether all kinds fitted together predict better.

Stations show an arm whose errors are dozens. How many kinds a fit can bear depends on how many
stations there are: from the geometry under load alone, over ripple and heat, to play and coupling,
which also ask where the arm came from. Each step up must pay on stations that took no part.
"""

from __future__ import annotations

from collections.abc import Callable, Sequence
from dataclasses import fields, replace

import numpy as np

from ...arm.robot import Robot
from ...effects.effect import Effect, Stage
from ...effects.plausible import beyond, plausible
from ...effects.registry import REGISTRY
from ..algebra.columns import MANY
from ..algebra.problem import PLACES, Problem
from ..beliefs import Beliefs
from ..evidence import Search
from ..negligible import EMPTY, ROUNDING
from ..unseen.chance import Candidates, chance_gain, may_be_chance
from ..unseen.folds import ways_to_divide
from ..unseen.unseen_stretches import RIDGES, Unseen
from .small_errors import many_small, predicted

BEAR = (10, 30, 100)
"""
Stations from which on effects of each `demand` are fitted along. From other draws of 15 to 120
stations of two real arms: with fewer, the richer step predicted the others worse, and the few
could not tell.
"""
PLENTY = 600
"""Stations from which on only the richest is fitted: they bear all of it, and time is saved."""
CHOSEN = 1.2
"""Effects chosen one by one were chosen on the stations left out as well: what they leave there
counts a fifth more where the many are many. From draws of 15 to 60 stations of two real arms."""


def fitted_together(
    result: Search, exclude: Sequence[str], beliefs: Beliefs, progress: Callable[[str], None]
) -> Search:
    """
    Return what was found, or all families fitted together where that explains stations better.

    result: the effects found one by one.
    """
    stations = sum(result.problem.samples)
    if not result.problem.at_rest or stations < BEAR[0]:
        return result
    progress('many small errors at once: fitting them together')
    best, remaining = result, np.inf
    for less in _steps(result.problem, stations):
        trial = _together(result, exclude, less, beliefs, progress)
        remains = unseen_rms(trial)
        if remains < beliefs.better * remaining:
            best, remaining = trial, remains
    few = unseen_rms(result)
    several = len(result.final.model.found) >= beliefs.several
    chance = not (result.crowded or several) and _by_chance(result, best, few, remaining)
    if chance and not result.final.model.found:
        return result
    # Several that were chosen on the parts left out as well have their lead by that.
    chosen = several and _relearned(best)
    if not chance and (result.crowded or remaining < (1.0 if chosen else beliefs.better) * few):
        return best if result.crowded else replace(best, other_way=result)
    return replace(result, other_way=best) if remaining < CHOSEN * few else result


def _by_chance(few: Search, many: Search, before: float, remaining: float) -> bool:
    """
    Return whether many errors predict no more of what a few leave than they would of noise.

    before, remaining: what few and many leave unseen; see `unseen_rms`.
    """
    fitted, own = (Unseen.of(s.problem, s.scale, s.final, s.precision) for s in (many, few))
    share = 1.0 - (remaining / max(before, ROUNDING)) ** 2
    if not may_be_chance(fitted.residual.size, share):
        return False
    columns, frames = fitted.columns.written_out(), fitted.frames
    size = np.sqrt(np.maximum(fitted.precision, EMPTY))[:, None]
    # All of them at once, at the sizes learned and at others: sizes are learned from noise, too.
    tried = Candidates(
        own.columns.written_out(),
        own.precision,
        [columns[frames:] / size[frames:]],
        RIDGES,
        ways_to_divide(many.problem),
    )
    return share <= chance_gain(tried, -np.inf, pooled=True)


def _steps(problem: Problem, stations: int) -> list[tuple[str, ...]]:
    """Return the kinds left out of every step, from the least that is fitted to the most."""
    steps = [
        tuple(name for name, kind in REGISTRY.items() if kind.traits.demand > demand)
        for demand, least in enumerate(BEAR)
        if stations >= least
    ]
    # First without curves: what a handful of stations bears is the geometry under load.
    curves = tuple(name for name, kind in REGISTRY.items() if kind.traits.bends)
    steps = steps[-1:] if stations >= PLENTY else [(*steps[0], *curves), *steps]
    if not problem.untracked:
        return steps
    # Contacts have few places, and each holds the arm in other angles. Of two arms of three measured
    # by contacts, wrong scales of the joints made places that were left out better predicted (0.36 to
    # 0.34 mm and 0.61 to 0.49 mm), of the third neither better nor worse; hundreds of waves told from
    # few places made them worse.
    steps = [tuple(name for name in step if not _one_number(REGISTRY[name])) for step in steps]
    # What carries over to another place only a place left out can tell; two are too few.
    return steps[:1] if problem.places < PLACES else steps


def _together(
    result: Search,
    exclude: Sequence[str],
    less: Sequence[str],
    beliefs: Beliefs,
    progress: Callable[[str], None],
) -> Search:
    """
    Return the fit of all families but some, and but those that no machine has so large.

    less: kinds of which only those are fitted along that were found one by one.
    """
    refused = list(result.refused)
    while True:
        model = result.small.model
        kept = model.with_found(tuple(e for e in model.found if e.name not in exclude))
        left_out = (*exclude, *less)
        final, scale, precision = many_small(result.problem, kept, left_out, beliefs, progress)
        robot = final.model.robot
        absurd = [effect for effect in final.model.found if _too_large(robot, effect)]
        if not absurd:
            break
        refused += absurd
        exclude = (*exclude, *(effect.name for effect in absurd))
    return replace(
        result,
        scale=scale,
        final=final,
        precision=precision,
        candidate_sets=(),
        dense=True,
        refused=tuple(refused),
    )


def _too_large(robot: Robot, effect: Effect) -> bool:
    """
    Return whether an effect is larger than in any machine, whichever way it points.

    Some members of a family are hardly told, and a spring of theirs may come out a little below zero.
    It must not take the springs of all other joints with it.
    """
    for name, value, _ in beyond(robot, effect):
        each = plausible(robot, effect.name, name, effect.site)
        if abs(value) > max(abs(each.low), abs(each.high)):
            return True
    return False


def _one_number(kind: type[Effect]) -> bool:
    """Return whether a kind has a single number for each joint, and no memory."""
    numbers = [item for item in fields(kind) if item.name != 'joint']
    linear = all(parameter.linear for parameter in kind.parameters)
    return kind.of == 'joint' and kind.stage is Stage.JOINT and len(numbers) == 1 and linear


def unseen_rms(result: Search) -> float:
    """Return the RMS [m] on stretches and on regions of posture left out, both together."""
    ways = Unseen.of(result.problem, result.scale, result.final, result.precision).every_way()
    if _relearned(result):
        left = [predicted(each, result.final.model, result.work.beliefs) for each in ways]
    else:
        left = [each.whole for each in ways]
    rms = [each.rms(rows) for each, rows in zip(ways, left, strict=True)]
    return float(np.sqrt(np.mean(np.square(rms))))


def _relearned(result: Search) -> bool:
    """
    Return whether the sizes of many are learned anew for every part left out.

    With more there are so many stations that sizes hardly hang on some of them, and it would take
    minutes.
    """
    return result.dense and result.final.coordinates.size <= MANY
