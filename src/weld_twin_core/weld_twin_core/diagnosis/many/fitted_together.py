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
from ..algebra.alias import outside, span_of
from ..algebra.fit import design
from ..algebra.problem import PLACES, Problem
from ..beliefs import Beliefs
from ..hypotheses.search import Search
from ..unseen.chance import Candidates, chance_gain
from ..unseen.folds import gain, least_gain, ways_to_divide
from ..unseen.unseen_stretches import Unseen
from .shrinkage import believed, groups, learned_precision, predicted
from .small_errors import many_small

BEAR = (10, 30, 100)
"""
Stations from which on effects of each `demand` are fitted along. From other draws of 15 to 120
stations of two real arms: with fewer, the richer step predicted the others worse, and the few
could not tell.
"""
PLENTY = 600
"""Stations from which on only the richest is fitted: they bear all of it, and time is saved."""
ONCE = 1
"""Order of the waves that two places of contacts bear: once a turn, as an eccentric scale or gear
makes."""
PLENTY_PLACES = 5
"""Places of contacts from which on sizes are learned: of eight places of an arm, learned sizes and
those of machines at large predicted a ninth alike (0.23, 0.37 and 0.20 mm both), of three the latter
did better (0.54 mm RMS on each left out instead of 0.61)."""
CREEPS = 1.0
"""Growth of the squared unseen error without a creep from which on it stays: the error doubles."""
FEW_COLUMNS = 200
"""Coordinates up to which sizes are learned anew for every part that is left out: with more there are
so many stations that sizes hardly hang on some of them, and it would take minutes."""
LEARNED = (0.1, 1.0, 10.0, 100.0)
"""Precisions of sizes that many errors could have had, in units of those learned: from three times as
large to a tenth."""
CHOSEN = 1.2
"""Effects chosen one by one were chosen on the stations left out as well: what they leave there
counts a fifth more where the many are many. From draws of 15 to 60 stations of two real arms."""


def fitted_together(
    found: Search, exclude: Sequence[str], beliefs: Beliefs, progress: Callable[[str], None]
) -> Search:
    """
    Return what was found, or all families fitted together where that explains stations better.

    Parameters
    ----------
    found : Search
        The effects found one by one.

    """
    stations = sum(found.problem.samples)
    if not found.problem.at_rest or stations < BEAR[0]:
        return found
    progress('many small errors at once: fitting them together')
    steps = _steps(found.problem, stations)
    best, left, dropped = found, np.inf, tuple[str, ...]()
    for less in steps:
        trial = _together(found, (*exclude, *less), beliefs, progress)
        remains = unseen_rms(trial)
        if remains < beliefs.better * left:
            best, left, dropped = trial, remains, less
    best, left = _without_creep(found, best, left, (*exclude, *dropped), beliefs, progress)
    few = unseen_rms(found)
    # Several that were chosen on the parts left out as well have their lead by that.
    chosen = len(found.final.model.found) >= beliefs.several and _relearned(best)
    better = found.crowded or left < (1.0 if chosen else beliefs.better) * few
    if not better:
        better = left < CHOSEN * few and _many(found, best, beliefs)
    better = better and (found.crowded or not _one_and_crumbs(best, beliefs))
    if not (found.final.model.found or found.crowded) and _by_chance(found, best):
        return found
    if better and found.problem.untracked and PLACES - 1 <= found.problem.places < PLENTY_PLACES:
        trial = _carrying(found, exclude, steps[0], beliefs, progress)
        if found.problem.places < PLACES or unseen_rms(trial) < left:
            return trial
    if better:
        return best
    return replace(found, many=best) if left < CHOSEN * few else found


def _by_chance(none: Search, many: Search) -> bool:
    """Return whether many small errors predict no more of few stations than they would of noise."""
    fitted = Unseen.of(many.problem, many.scale, many.final, many.precision)
    bare = Unseen.of(many.problem, many.scale, none.final, none.precision)
    told = least_gain(
        [
            gain(one.squares(one.whole), more.squares(more.whole), more.trusted_labels())
            for one, more in zip(bare.every_way(), fitted.every_way(), strict=True)
        ]
    )
    columns, frames = fitted.columns.written_out(), fitted.frames
    size = np.sqrt(np.maximum(fitted.precision, 1e-300))[:, None]
    # All of them at once, at the sizes learned and at others: sizes are learned from noise, too.
    tried = Candidates(
        columns[:frames],
        fitted.precision[:frames],
        [columns[frames:] / size[frames:]],
        LEARNED,
        ways_to_divide(many.problem),
    )
    return told.share <= chance_gain(tried, told.share, 0.0)


def _steps(problem: Problem, stations: int) -> list[tuple[str, ...]]:
    """Return the kinds left out of every step, from the least that is fitted to the most."""
    steps = [_beyond(demand) for demand, least in enumerate(BEAR) if stations >= least]
    # First without curves: what a handful of stations bears is the geometry under load.
    curves = tuple(name for name, kind in REGISTRY.items() if kind.traits.bends)
    steps = steps[-1:] if stations >= PLENTY else [(*steps[0], *curves), *steps]
    if not problem.untracked:
        return steps
    steps = [_but_scales(step) for step in steps]
    # What carries over to another place only a place left out can tell; two are too few.
    return steps[:1] if problem.places < PLACES else steps


def _carrying(
    found: Search,
    exclude: Sequence[str],
    less: Sequence[str],
    beliefs: Beliefs,
    progress: Callable[[str], None],
) -> Search:
    """
    Return the fit of all families that carries over from two places of contacts to a third.

    Few places hardly show some kinds, and sizes learned there would say that there are none of
    them; so all are as large as machines have them. Of 14 pairs of places of three arms, each
    judged on the others, this left 0.31 mm instead of 0.33 mm in the mean, and 0.49 mm instead of
    0.84 mm at the worst place of the three with the largest rest.
    """
    waves = {name for name, kind in REGISTRY.items() if kind.traits.waves is not None}
    less = tuple(name for name in less if name not in waves)
    return _together(found, (*exclude, *less), beliefs, progress, orders=ONCE)


def _without_creep(
    found: Search,
    best: Search,
    left: float,
    exclude: Sequence[str],
    beliefs: Beliefs,
    progress: Callable[[str], None],
) -> tuple[Search, float]:
    """
    Return the many without what creeps with time, unless a creep pays very much.

    Chosen among few, a creep takes up the geometry of postures that were visited in an order: plane
    by plane, each is a little later. Stretches left out lie between others and hardly tell; beyond
    the recording the creep goes on and the arm does not. On a grid of a real arm that was measured
    plane by plane, its first fifth predicted the rest to 0.83 mm with a creep and to 0.12 without.
    """
    creeps = {
        e.name
        for e in best.final.model.found
        if e.traits.depends_on == 'time' and not e.traits.dated
    }
    creeps -= {
        name for name, kind in REGISTRY.items() if kind.traits.of_setup or kind.traits.common
    }
    if not creeps:
        return best, left
    trial = _together(found, (*exclude, *creeps), beliefs, progress)
    remains = unseen_rms(trial)
    grows = (remains / max(left, 1e-12)) ** 2 - 1.0
    return (best, left) if grows > CREEPS else (trial, remains)


def _one_and_crumbs(found: Search, beliefs: Beliefs) -> bool:
    """
    Return whether contacts show a large cause or two, and nothing else that counts.

    Of three or four places left out in turn, tiny errors by the dozen predict some better by chance.
    """
    whole = found.problem.untracked and found.problem.places >= PLACES
    return whole and _members(found, beliefs) < beliefs.several


def _many(found: Search, best: Search, beliefs: Beliefs) -> bool:
    """Return whether there are many, in sum and beside the few."""
    many = _members(best, beliefs) >= beliefs.many
    return many and members_beside(found, best, beliefs) >= beliefs.many


def _members(found: Search, beliefs: Beliefs) -> int:
    """Return how many effects move the tool by much of what all of them leave."""
    unseen = Unseen.of(found.problem, found.scale, found.final, found.precision)
    least = beliefs.member * unseen.rms(unseen.whole)
    sizes = np.array([unseen.rms(part) for part in unseen.targets[1:]])
    return int((sizes > least).sum())


def _together(
    found: Search,
    exclude: Sequence[str],
    beliefs: Beliefs,
    progress: Callable[[str], None],
    orders: int | None = None,
) -> Search:
    """Return the fit of all families but some, and but those that no machine has so large."""
    refused = list(found.refused)
    while True:
        model = found.small.model
        kept = model.with_found(tuple(e for e in model.found if e.name not in exclude))
        fitted = many_small(found.problem, kept, exclude, beliefs, progress, orders)
        final, scale, precision = fitted
        robot = final.model.robot
        absurd = [effect for effect in final.model.found if _too_large(robot, effect)]
        if not absurd:
            break
        refused += absurd
        exclude = (*exclude, *(effect.name for effect in absurd))
    return replace(
        found,
        scale=scale,
        final=final,
        precision=precision,
        slots=(),
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


def _beyond(demand: int) -> tuple[str, ...]:
    """Return the kinds that demand more of the stations, left out of a step."""
    return tuple(name for name, kind in REGISTRY.items() if kind.traits.demand > demand)


def _but_scales(less: tuple[str, ...]) -> tuple[str, ...]:
    """
    Return kinds left out, but for those of a single number per joint and no memory.

    Contacts have few places, and each holds the arm in other angles. Of two arms of three measured
    by contacts, wrong scales of the joints made places that were left out better predicted (0.36 to
    0.34 mm and 0.61 to 0.49 mm), of the third neither better nor worse; hundreds of waves told from
    few places made them worse.
    """
    return tuple(name for name in less if not _one_number(REGISTRY[name]))


def _one_number(kind: type[Effect]) -> bool:
    numbers = [item for item in fields(kind) if item.name != 'joint']
    linear = all(parameter.linear for parameter in kind.parameters)
    return kind.of == 'joint' and kind.stage is Stage.JOINT and len(numbers) == 1 and linear


def unseen_rms(found: Search) -> float:
    """Return the RMS [m] on stretches and on regions of posture left out, both together."""
    unseen = Unseen.of(found.problem, found.scale, found.final, found.precision)
    model, anew = found.final.model, _relearned(found)
    ways = [
        each.rms(predicted(each, model, found.work.beliefs) if anew else each.whole)
        for each in unseen.every_way()
    ]
    return float(np.sqrt(np.mean(np.square(ways))))


def _relearned(found: Search) -> bool:
    """Return whether the sizes of many are learned anew for every part left out."""
    return found.dense and found.final.coordinates.size <= FEW_COLUMNS


def members_beside(few: Search, many: Search, beliefs: Beliefs) -> int:
    """
    Return how many of many effects move the tool by much of what all of them leave.

    Parameters
    ----------
    few, many : Search
        What was found one by one, and all kinds fitted together.

    """
    unseen = Unseen.of(many.problem, many.scale, many.final, many.precision)
    problem, scale, model = many.problem, many.scale, few.final.model
    have = {effect.key for effect in model.found}
    others = tuple(effect for effect in many.final.model.found if effect.key not in have)
    if not others:
        return 0
    span = span_of(design(problem, model, scale)[0])
    features = problem.features(model)
    each = [
        outside(
            problem.whitened(problem.effect_columns(features, effect, atoms=False), scale), span
        )
        for effect in others
    ]
    columns = np.concatenate(each)
    residual = outside(problem.whitened(problem.residuals(model), scale), span)
    normal, right = columns @ columns.T, columns @ residual
    rss = float(residual @ residual)
    labels, scales = groups(others, beliefs)
    held = believed(model.with_found(others))
    ridge, _ = learned_precision(normal, right, rss, residual.size, labels, scales, held)
    mean = np.linalg.lstsq(normal + np.diag(ridge), right, rcond=1e-12)[0]
    parts = mean[:, None] * columns
    least = beliefs.member * unseen.rms(unseen.whole)
    ends = np.cumsum([len(part) for part in each])[:-1]
    return sum(unseen.rms(part.sum(axis=0)) > least for part in np.split(parts, ends))
