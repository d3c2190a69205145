# Copyright 2026 weld_twin contributors
# SPDX-License-Identifier: Apache-2.0
"""Which units belong in the model: forward by evidence, nonlinear fits between, then backward."""

from __future__ import annotations

from collections.abc import Callable
from typing import NamedTuple

import numpy as np

from ...arm.robot import Robot
from ...effects.effect import Effect
from ...effects.plausible import beyond
from ..algebra.fit import Fit
from ..algebra.problem import Model
from ..algebra.workspace import Choice, Workspace, lead
from ..beliefs import SHORTLIST
from ..result import Site

ROUNDS = 3
"""Times that a choice is made anew at what it led to: the second seldom changes anything."""
SHORT = 1
"""How often the best may be worth less than they looked before the search ends: by columns alone a
size counts for nothing, and play may be below zero. Without an end the search of a hundred sealed
cells took 1.6 times as long, and no answer was better."""


class _Step(NamedTuple):
    fit: Fit  # with the best choice that a machine can have; as it was where there is none
    entered: str | None  # what entered, in words
    impossible: list[Effect]  # better ones that no machine has
    passed: bool
    """Whether one of these was passed over that is of no machine's size, not only of no such shape."""


def forward(
    work: Workspace, now: Fit, most: int, tick: Callable[[str], None] = lambda text: None
) -> tuple[Fit, list[Effect]]:
    """
    Return the fit of a forward selection, and what no machine has and would have explained the rest.

    Several causes together may look like one that no machine has, and so may one that the library
    lacks. So the search passes it over; where such a one would still explain what is left in the end,
    all that entered after it stood in for a part of that, and goes. What looks like a machine's may
    stand in for several, too, until what enters next drives it beyond that: then it makes room for good.
    """
    doubted: tuple[Fit, list[Effect]] | None = None
    gone = set[Site]()
    for _ in range(most):
        # Until the cause is in the model the residual is all signal and looks autocorrelated;
        # only the fit with a choice tells how many rows were independent.
        rows = float(now.residual.size - work.problem.frame_count)
        taken = sites(now)
        ranked = [
            choice
            for choice in work.ranked(now, rows, work.beliefs.enter_log_bayes)
            if choice.unit.site not in taken or type(choice.unit.seeds[0]).search.joins
            if choice.unit.site not in gone
        ]
        step = _with_best(work, now, ranked)
        if step.passed:
            doubted = doubted or (now, step.impossible)
        if step.entered is None:
            return (step.passed and doubted) or (now, step.impossible)
        gone |= set(taken) - set(sites(step.fit))
        now = step.fit
        tick(step.entered)
    return now, []


def _with_best(work: Workspace, now: Fit, ranked: list[Choice]) -> _Step:
    """Return the step that the best choice is, without what it drives beyond what machines have."""
    beliefs, impossible, passed, short = work.beliefs, list[Effect](), False, 0
    while ranked and short <= SHORT:
        slack = max(beliefs.close_log_bayes, beliefs.beaten_share * ranked[0].log_bayes)
        close = [c for c in ranked if c.log_bayes > ranked[0].log_bayes - slack][:SHORTLIST]
        tried = [(work.fitted_with(now.model, c.effect()), c) for c in close]
        count = work.effective(min((one for one, _ in tried), key=lambda f: f.rss), beliefs.hope)
        worth = []
        for one, choice in tried:
            freedom = one.coordinates.size - now.coordinates.size
            log_bayes = lead(one, now, freedom, count)
            worth.append((log_bayes - choice.surprise, one, choice.unit))
        worth = [item for item in worth if item[0] > beliefs.enter_log_bayes]
        absurd = [(unit.site, e) for _, one, unit in worth for e in implausible(one.model)]
        impossible += [effect for _, effect in absurd]
        # A choice that stays within its own limits may enter: what it drives beyond theirs goes then.
        barred = {site for site, e in absurd if Site.of(e) == site}
        remaining = [item for item in worth if item[2].site not in barred]
        for log_bayes, one, unit in sorted(remaining, key=lambda item: -item[0]):
            best = possible(work, one, [])
            if unit.site in sites(best):
                return _Step(best, f'{unit.site} (+{log_bayes:.0f})', impossible, passed)
        short += not absurd
        passed |= not all(_misshapen(now.model.robot, effect) for _, effect in absurd)
        ranked = [choice for choice in ranked if choice not in close]
    return _Step(now, None, impossible, passed)


def _misshapen(robot: Robot, effect: Effect) -> bool:
    """Return whether an effect is of a size that machines have, and only its shape is not."""
    size, *_ = effect.parameters
    bent = {p.name for p in effect.parameters if not p.linear} - {size.name}
    return all(name in bent for name, _, _ in beyond(robot, effect))


def sites(result: Fit) -> list[Site]:
    return [Site.of(effect) for effect in result.model.found]


def implausible(model: Model) -> list[Effect]:
    return [effect for effect in model.found if beyond(model.robot, effect)]


def possible_part(model: Model) -> Model:
    return model.with_found(tuple(e for e in model.found if not beyond(model.robot, e)))


def possible(work: Workspace, now: Fit, refused: list[Effect]) -> Fit:
    """Return the fit without what no machine has; that is added to those refused."""
    while absurd := implausible(now.model):
        refused += absurd
        now = work.fitted(possible_part(now.model))
    return now


def backward(work: Workspace, now: Fit) -> Fit:
    """
    Return the fit with every effect dropped that is not needed given the others, the least first.

    None is needed that is not worth its freedom, nor one far below the noise beside a larger one:
    of thousands of rows a micrometre is significant, but more likely that one's misfit.
    """
    beliefs = work.beliefs
    while now.model.found:
        less, count, hopeless = work.predict_without(now), work.effective(now), work.hopeless(now)
        worth = dict[int, float]()
        most = beliefs.invisible * min(len(less), 2)
        for k in (k for k, (rss, _) in enumerate(less) if rss < hopeless):
            one = work.without(now, k)
            freedom = now.coordinates.size - one.coordinates.size
            worth[k] = lead(now, one, freedom, count)
        k = min(worth, key=worth.__getitem__, default=-1)
        if k < 0 or worth[k] >= beliefs.enter_log_bayes:
            k = int(np.argmin([size for _, size in less]))
            if less[k][1] > most:
                break
        now = work.without(now, k)
    return now
