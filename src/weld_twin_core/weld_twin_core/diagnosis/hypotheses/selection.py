# Copyright 2026 weld_twin contributors
# SPDX-License-Identifier: Apache-2.0
"""Which units belong in the model: forward by evidence, nonlinear fits between, then backward."""

from __future__ import annotations

from collections.abc import Callable, Iterable, Sequence
from dataclasses import dataclass, field, replace
from typing import NamedTuple
from weakref import WeakKeyDictionary

import numpy as np

from ...arm.robot import Robot
from ...arrays import Array
from ...effects.effect import Effect
from ...effects.plausible import beyond
from ...effects.registry import REGISTRY
from ..algebra.fit import Fit, design, fit
from ..algebra.problem import Model, Problem, Scale
from ..beliefs import Beliefs
from .library import Library
from .seed_systems import Choice, SeedSystems, Unit, evidence, ranking
from .starts import searched, started
from .usual_errors import UsualErrors, usual

SHORTLIST = 4
"""Units tried with a full nonlinear fit at every step, where the linear ranking may mislead."""


class Less(NamedTuple):
    """
    A fit without one of the effects found.

    Attributes
    ----------
    fit : Fit
    size : float
        RMS change of the residual [noise] as the effect goes, before anything is fitted anew.

    """

    fit: Fit
    size: float


@dataclass(frozen=True, eq=False)
class Workspace:
    """
    What selection works on: the problem, its noise, the shared library, and beliefs.

    The library's own products are computed once; residuals change, columns do not.

    Attributes
    ----------
    errors : UsualErrors or None
        What every arm is off by a little, once it is known how much that is.

    """

    problem: Problem
    scale: Scale
    library: Library
    beliefs: Beliefs
    errors: UsualErrors | None = None
    _left: WeakKeyDictionary[Fit, float] = field(
        default_factory=WeakKeyDictionary, init=False, repr=False
    )
    _less: WeakKeyDictionary[Fit, dict[int, Less]] = field(
        default_factory=WeakKeyDictionary, init=False, repr=False
    )

    def beside_usual(self, now: Fit, effective: Callable[[Fit], float]) -> Workspace:
        """
        Return the same with the errors that every arm has a little of, as a fit shows them.

        Parameters
        ----------
        now : Fit
        effective : callable
            Number of independent rows of a fit.

        """
        if usual(now.model.found):
            return self
        errors = UsualErrors.beside(self.problem, self.scale, now, effective)
        return replace(self, errors=errors)

    def _errors(self, about: Iterable[str]) -> UsualErrors | None:
        """Return the errors beside which some families are weighed; none if they are such."""
        return None if usual(REGISTRY[name] for name in about) else self.errors

    def left(self, result: Fit, about: Iterable[str]) -> float:
        """
        Return what a fit leaves, whitened squares, to weigh some families by.

        Beside the errors that every arm has a little of, unless the families are such themselves.

        Parameters
        ----------
        about : iterable of str
            The families.

        """
        errors = self._errors(about)
        if errors is None:
            return result.rss
        if result not in self._left:
            self._left[result] = errors.left(result)
        return self._left[result]

    def independent(
        self, fits: Sequence[Fit], about: Iterable[str], effective: Callable[[Fit], float]
    ) -> float:
        """
        Return the number of independent rows by which some families are weighed.

        One count for all fits, that of the one which leaves least.
        """
        errors = self._errors(about)
        return effective(min(fits, key=lambda f: f.rss)) if errors is None else errors.count

    def without(self, now: Fit, k: int) -> Less:
        """Return the fit without found effect k of another, made once."""
        known = self._less.setdefault(now, {})
        if k not in known:
            model = now.model.without(k)
            change = self.problem.whitened(self.problem.residuals(model), self.scale)
            size = float(np.sqrt(((change - now.residual) ** 2).mean()))
            known[k] = Less(fit(self.problem, model, self.scale, None, 4), size)
        return known[k]

    def beside(self, model: Model, residual: Array) -> SeedSystems:
        """
        Return the normal equations of all seeds given a model: its frames and effects fitted.

        Parameters
        ----------
        residual : array, shape (rows,)
            What the model leaves, whitened.

        """
        own, _ = design(self.problem, model, self.scale)
        products = self.library.products(np.concatenate([own, residual[None]]))
        return self.library.systems.beside(own, residual, products)


@dataclass(frozen=True, eq=False)
class Step:
    """One step of a selection: the unit taken in, its evidence, and the fit with it."""

    unit: Unit
    nats: float
    fit: Fit


def forward(
    work: Workspace,
    start: Fit,
    effective: Callable[[Fit], float],
    most: int = 40,
    tick: Callable[[str], None] = lambda text: None,
    refused: Callable[[Effect], None] = lambda effect: None,
) -> list[Step]:
    """
    Return the steps of a forward selection; what no machine has does not enter.

    Parameters
    ----------
    start : Fit
        The baseline: frames and known effects.
    effective : callable
        Number of independent rows of a fit.
    most : int
        Stop after this many units.
    tick : callable
        Told what was found, for progress.
    refused : callable
        Told what would have explained the rest best, where no machine can have it.

    """
    steps: list[Step] = []
    now = start
    taken = sites(start)
    while len(steps) < most:
        systems = work.beside(now.model, now.residual)
        # Until the cause is in the model the residual is all signal and looks autocorrelated;
        # only the fit with a choice tells how many rows were independent.
        rows = float(now.residual.size - work.problem.frame_count)
        ranked = ranking(systems, work.library.units, rows, work.beliefs.enter_nats)
        ranked = [choice for choice in ranked if not _repeats(choice, taken)]
        if not ranked:
            break
        best, impossible = _first_possible(work, now, ranked, effective)
        if best is None:
            for effect in impossible:
                refused(effect)
            break
        steps.append(best)
        taken.append(best.unit.site)
        now = best.fit
        tick(f'{best.unit} (+{best.nats:.0f} nats)')
    return steps


def _repeats(choice: Choice, taken: list[tuple[str, str | None]]) -> bool:
    """Return whether a unit is in the model already and its kind cannot take in another."""
    kind = type(choice.unit.seeds[0])
    return choice.unit.site in taken and not kind.search.joins


def _close(work: Workspace, ranked: list[Choice]) -> list[Choice]:
    """Return the choices whose evidence is close to the best."""
    best = ranked[0].nats
    slack = max(work.beliefs.close_nats, work.beliefs.close_share * best)
    return [c for c in ranked if c.nats > best - slack]


def _first_possible(
    work: Workspace, now: Fit, ranked: list[Choice], effective: Callable[[Fit], float]
) -> tuple[Step | None, list[Effect]]:
    """
    Return the best choice that a machine can have, and better ones that none has.

    What has no such size imitates a cause that the library lacks. What only has no such shape is
    another family's, or that of several causes together: that ends no search.
    """
    impossible: list[Effect] = []
    while ranked:
        close = _close(work, ranked)[:SHORTLIST]
        best, absurd = _best_of(work, now, close, effective)
        impossible += absurd
        misshapen = [effect for effect in absurd if _misshapen(now.model.robot, effect)]
        if best is not None or not absurd or len(misshapen) < len(absurd):
            return best, impossible
        ranked = [choice for choice in ranked if choice not in close]
    return None, impossible


def _misshapen(robot: Robot, effect: Effect) -> bool:
    """Return whether an effect is of a size that machines have, and only its shape is not."""
    size, *_ = effect.parameters
    bent = {p.name for p in effect.parameters if not p.linear} - {size.name}
    return all(name in bent for name, _, _ in beyond(robot, effect))


def _best_of(
    work: Workspace, now: Fit, close: list[Choice], effective: Callable[[Fit], float]
) -> tuple[Step | None, list[Effect]]:
    """
    Return the best of some choices after a nonlinear fit of each.

    Beside it, effects that would have done but that no machine has.
    """
    tried = [(c, fitted_with(work, now.model, c.effect())) for c in close]
    # One count for all, that of the fit which leaves least: a worse model explains less and would
    # otherwise be allowed more rows.
    count = effective(min((f for _, f in tried), key=lambda f: f.rss))
    best: Step | None = None
    impossible: list[Effect] = []
    for choice, result in tried:
        freedom = result.coordinates.size - now.coordinates.size
        log_bayes_factor = evidence(now.rss, now.rss - result.rss, freedom, count)
        log_bayes_factor -= float(np.log(choice.unit.trials))
        if log_bayes_factor <= work.beliefs.enter_nats:
            continue
        absurd = implausible(result.model)
        impossible += absurd
        if not absurd and (best is None or log_bayes_factor > best.nats):
            best = Step(choice.unit, log_bayes_factor, result)
    return best, impossible


def sites(result: Fit) -> list[tuple[str, str | None]]:
    """Return what is in the model of a fit."""
    return [(effect.name, effect.site) for effect in result.model.found]


def implausible(model: Model) -> list[Effect]:
    """Return the effects of a model that are beyond what a machine can have."""
    return [effect for effect in model.found if beyond(model.robot, effect)]


def possible_part(model: Model) -> Model:
    """Return the model without the effects that are beyond what a machine can have."""
    return model.with_found(tuple(e for e in model.found if not beyond(model.robot, e)))


def fitted_with(work: Workspace, model: Model, effect: Effect) -> Fit:
    """Return the fit of a model with one more effect, merged where its kind can merge."""
    effect = started(work.problem, model, work.scale, effect)
    return fit(work.problem, model.with_found(merged(model.found, effect)), work.scale, None, 5)


def merged(result: tuple[Effect, ...], effect: Effect) -> tuple[Effect, ...]:
    """Return the effects with one more, in one with its like where their kind can join."""
    for k, other in enumerate(result):
        if (other.name, other.site) == (effect.name, effect.site):
            both = other.search.joined(effect)
            if both is not None:
                return (*result[:k], both, *result[k + 1 :])
    return (*result, effect)


def restarted(work: Workspace, now: Fit) -> Fit:
    """
    Return the fit after effects with many optima were searched for again beside all others.

    The first to enter was found while the others were still in the residual.
    """
    for k, effect in enumerate(now.model.found):
        if not searched(effect):
            continue
        again = fitted_with(work, work.without(now, k).fit.model, effect)
        if again.rss < now.rss and not implausible(again.model):
            result = list(again.model.found)
            result.insert(k, result.pop())
            now = fit(work.problem, again.model.with_found(tuple(result)), work.scale, None, 4)
    return now


def backward(work: Workspace, now: Fit, effective: Callable[[Fit], float]) -> Fit:
    """Return the fit with every effect dropped that is not needed given the others, the least first."""
    now = restarted(work, now)
    while now.model.found:
        each = [work.without(now, k) for k in range(len(now.model.found))]
        less, sizes = [one.fit for one in each], [one.size for one in each]
        reasons = (
            _worthless(work, now, less, effective),
            _negligible(work, sizes),
            _misfit(work, now, less, sizes),
        )
        needless = next((k for k in reasons if k is not None), None)
        if needless is None:
            break
        now = less[needless]
    return now


def _worthless(
    work: Workspace, now: Fit, less: Sequence[Fit], effective: Callable[[Fit], float]
) -> int | None:
    """Return the effect that is worth least, where it is not worth its freedom."""
    count = effective(now)
    log_bayes_factor = []
    for one in less:
        freedom = now.coordinates.size - one.coordinates.size
        log_bayes_factor.append(evidence(one.rss, one.rss - now.rss, freedom, count))
    least = int(np.argmin(log_bayes_factor))
    return least if log_bayes_factor[least] < work.beliefs.enter_nats else None


def _negligible(work: Workspace, sizes: Sequence[float]) -> int | None:
    """
    Return the smallest effect, where it is far below the noise beside a larger one.

    Thousands of rows make a micrometre significant; next to a larger cause it is more likely the
    difference between that cause and its model.
    """
    least = int(np.argmin(sizes))
    most = work.beliefs.negligible if len(sizes) > 1 else work.beliefs.invisible
    return least if sizes[least] <= most else None


def _misfit(work: Workspace, now: Fit, less: Sequence[Fit], sizes: Sequence[float]) -> int | None:
    """
    Return the effect that is no more than what a larger one's formula misses.

    A gear in motion is not its formula: of a large effect some per cent are left, far above chance
    over thousands of rows, and a second effect on the same joint may take them. Where it takes
    away less than that share of the largest, and less than noise, it is not told. Stations are
    left alone, as the geometry of an arm has no such misfit.
    """
    if len(less) < 2 or work.problem.at_rest:
        return None
    most = min(work.beliefs.misfit_noise, work.beliefs.misfit_share * max(sizes))
    least = int(np.argmin([one.rss for one in less]))
    taken = max(less[least].rss - now.rss, 0.0) / now.residual.size
    return least if np.sqrt(taken) <= most else None
