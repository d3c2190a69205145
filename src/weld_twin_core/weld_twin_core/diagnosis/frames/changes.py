# Copyright 2026 weld_twin contributors
# SPDX-License-Identifier: Apache-2.0
"""
What differs between recordings of one arm: a short list of what may, compared with noise.

Every error allowed to differ is a candidate in each recording after the first; those worth more than
they cost are fitted along with the frames, in every hypothesis.
"""

from __future__ import annotations

from collections.abc import Iterable, Sequence
from dataclasses import replace
from itertools import pairwise

import numpy as np

from ...arm.robot import Robot
from ...arrays import Array
from ...effects import REGISTRY
from ...effects.effect import Effect
from ...effects.plausible import spreads
from ...errors import ModelError
from ...twin.features import joints_of
from ..algebra.columns import BLOCKS, Columns, columns_covariance, designed, unit_inverse
from ..algebra.definite import unit_diagonal
from ..algebra.fit import (
    coordinates,
    design,
    effect_precision,
    fit,
    frame_offset,
    frame_prior,
    robust_fit,
    robust_scale,
    with_weights,
)
from ..algebra.motions import constant, of_no_size
from ..algebra.problem import ROWS, Change, Model, Problem, Scale
from ..beliefs import Beliefs
from ..evidence import Search
from ..negligible import REPEATED, REWEIGHTED
from ..result import Changed, Site

SURE = 3.0
"""Standard errors from which a change is reported, RMS of several numbers: chance once in 400 times."""
UNTOLD = 0.9
"""A coordinate whose spread after the data is this share of that before is not shown by them."""


def families_named(given: str | Iterable[str], what: str = 'may_change') -> tuple[str, ...]:
    """Return the families that may differ between recordings; ModelError says ``what`` has others."""
    parts = given.split(',') if isinstance(given, str) else given
    names = tuple(dict.fromkeys(name for part in parts if (name := str(part).strip())))
    lasting = sorted(name for name, kind in REGISTRY.items() if _lasting(kind))
    for name in names:
        if name not in lasting:
            raise ModelError(
                f'{what}: {name!r} is no error that stays the same during a recording; those are '
                + ', '.join(lasting)
            )
    return names


def _lasting(kind: type[Effect]) -> bool:
    return constant(kind) and not kind.traits.dated


def with_changes(
    problem: Problem,
    model: Model,
    families: Sequence[str],
    beliefs: Beliefs,
    precision: Array | None = None,
) -> tuple[Problem, Model]:
    """
    Return problem and model with what differs between the recordings, fitted along with effects.

    families: what may differ; see `families_named`.
    precision: prior of the effects, shape (K,); that of machines at large when left out.
    """
    candidates = _candidates(problem, model.robot, families)
    if not candidates:
        return problem, model
    result = model.found
    if not result:
        # What all recordings have in common must not pass for what differs between them.
        model, precision = model.with_found(constant_errors(model.robot)), None
    prior = effect_precision(model) if precision is None else precision
    every = replace(problem.thinned(ROWS), changes=candidates)
    count = sum(c.effect.fit.coordinates().size for c in candidates) + prior.size
    freedom = float(min(count, every.size // 2))
    free, scale = _freed(every, replace(model, changes=candidates), prior, freedom)
    chosen = _chosen(every, free, scale, prior, beliefs)
    picked = tuple(candidates[i] for i in sorted(chosen))
    model = replace(free, changes=tuple(free.changes[i] for i in sorted(chosen)))
    few = replace(every, changes=picked)
    model = fit(few, model, scale, prior).model
    problem = replace(problem, changes=picked)
    return problem, model if result else model.with_found(())


def constant_errors(robot: Robot) -> tuple[Effect, ...]:
    kinds = [k for k in REGISTRY.values() if _lasting(k) and k.of in ('joint', 'link')]
    return tuple(kind(joint) for kind in kinds for joint in robot.joint_names)  # type: ignore[call-arg]


def _candidates(problem: Problem, robot: Robot, families: Sequence[str]) -> tuple[Change, ...]:
    """Return everything that may differ, at zero; frames fitted per recording differ anyway."""
    out = []
    given = problem.given or range(len(problem.recordings))
    for k in range(1, 1 + max(given)):
        for name in families:
            kind = REGISTRY[name]
            if 'base' in problem.align and kind.traits.fitted_with == 'base':
                continue
            for joint in joints_of(kind, robot):
                out.append(Change(k, of_no_size(Site(name, joint))))
    return tuple(out)


def _freed(
    problem: Problem, model: Model, precision: Array, freedom: float
) -> tuple[Model, Scale]:
    """
    Return the model with everything free that may differ, and the noise that it leaves.

    First every sample counts: a recording that differs much must not pass for a handful of outliers.
    Once the differences are fitted, what is far off is an outlier, and it loses its weight in every
    later fit; one of 10 mm would else make the noise of all.
    """
    scale = robust_scale(problem, problem.residuals(model))
    model = fit(problem, model, with_weights(scale, problem), precision).model
    for _ in range(REWEIGHTED):
        scale = robust_scale(problem, problem.residuals(model), freedom=freedom)
        model = fit(problem, model, scale, precision).model
    return model, robust_scale(problem, problem.residuals(model), freedom=freedom)


def _chosen(
    problem: Problem, model: Model, scale: Scale, precision: Array, beliefs: Beliefs
) -> list[int]:
    """Return which candidates are worth more evidence than they cost, chosen one by one."""
    columns = design(problem, model, scale)
    residual = problem.whitened(problem.residuals(model), scale)
    ridge, off = frame_prior(problem, model)
    ridge, x = np.concatenate([ridge, precision]), np.concatenate([off, coordinates(model)])
    share = problem.independent_share(residual)
    normal = share * columns @ columns.T + np.diag(ridge)
    parts = _places(problem, model)
    fixed = np.setdiff1d(np.arange(x.size), np.concatenate([np.arange(0), *parts]))
    own = x.copy()
    own[fixed] = 0.0
    # What the candidates explain now is put back; frames and effects stay about where they are.
    right = share * columns @ (residual + own @ columns) - ridge * (x - own)
    trials = np.log(max(len(parts), 1))
    kept: list[int] = []
    now = _evidence(normal, right, ridge, fixed, [])
    while len(kept) < len(parts):
        scores = {
            i: _evidence(normal, right, ridge, fixed, [parts[j] for j in (*kept, i)]) - trials
            for i in range(len(parts))
            if i not in kept
        }
        best = max(scores, key=lambda i: scores[i])
        if scores[best] < now + beliefs.enter_log_bayes:
            break
        kept.append(best)
        now = scores[best]
    return kept


def _places(problem: Problem, model: Model) -> list[Array]:
    sizes = [change.effect.fit.coordinates().size for change in model.changes]
    first = problem.frame_count + problem.shared_count
    ends = first + np.cumsum(np.array([0, *sizes], dtype=int))
    return [np.arange(a, b) for a, b in pairwise(ends)]


def _evidence(
    normal: Array, right: Array, ridge: Array, fixed: Array, parts: Sequence[Array]
) -> float:
    """Return the log evidence of some columns beside those that are always fitted."""
    index = np.concatenate([fixed, *parts]).astype(int)
    if not index.size:
        return 0.0
    scaled, size = unit_diagonal(normal[np.ix_(index, index)], REPEATED)
    wanted = right[index] / size
    gain = float(wanted @ np.linalg.solve(scaled, wanted)) / 2.0
    volume = float(np.linalg.slogdet(scaled)[1] + 2.0 * np.log(size).sum()) / 2.0
    return gain - volume + sum(float(np.log(ridge[part]).sum()) for part in parts) / 2.0


def settled_between(result: Search, families: Sequence[str], beliefs: Beliefs) -> Search:
    """
    Return what was found with the differences between recordings chosen anew beside it.

    Before the effects were found, what they leave could pass for a difference, or hide one.
    """
    if len(result.problem.recordings) < 2 or not families:
        return result
    before = [_site(change) for change in result.problem.changes]
    found = result.problem, result.final.model
    problem, model = with_changes(*found, families, beliefs, result.precision)
    final, scale = robust_fit(problem, model, result.precision, rounds=1)
    result = replace(result, problem=problem, scale=scale, final=final)
    if [_site(change) for change in problem.changes] == before:
        return result
    work = replace(result.work, problem=replace(result.work.problem, changes=problem.changes))
    small = replace(result.small, model=replace(result.small.model, changes=final.model.changes))
    start = replace(result.baseline.model, changes=final.model.changes)
    bare, _ = robust_fit(problem, start)
    return replace(result, work=work, small=small, baseline=bare)


def _site(change: Change) -> tuple[int, str, str | None]:
    return change.recording, change.effect.name, change.effect.site


def list_changes(
    problem: Problem, model: Model, scale: Scale, precision: Array, families: Sequence[str]
) -> tuple[Changed, ...]:
    """Return what differs between recordings beyond noise; frames fitted for each are compared here."""
    if not families:
        return ()
    columns, ridge = columns_and_ridge(problem, model, scale, precision)
    residual = problem.whitened(problem.residuals(model), scale)
    share = problem.independent_share(residual)
    whole = columns_covariance(columns, ridge, residual, problem.block_labels(BLOCKS), share)
    parts = _places(problem, model)
    pairs = zip(model.changes, parts, strict=True)
    out = [(change, whole[np.ix_(part, part)]) for change, part in pairs]
    for kind in (REGISTRY[name] for name in families):
        if kind.traits.fitted_with == 'base' and 'base' in problem.align:
            out += _bases(kind, problem, model, whole)
    out.sort(key=lambda each: each[0].recording)
    return tuple(
        Changed(change.recording, change.effect, change.effect.fit.errors(np.sqrt(np.diag(own))))
        for change, own in out
        if _sure(change, own)
    )


def _sure(change: Change, covariance: Array) -> bool:
    value = change.effect.fit.coordinates()
    chi = float(value @ np.linalg.pinv(covariance, hermitian=True) @ value)
    return chi > SURE**2 * value.size


def _bases(
    kind: type[Effect], problem: Problem, model: Model, whole: Array
) -> list[tuple[Change, Array]]:
    """Return how every base differs from the first, with covariances."""
    out = []
    first, *others = (group[0] for group in problem.stands)
    for i, k in enumerate(others, 1):
        step = frame_offset(model.bases[k], model.bases[first], left=True)
        mix = np.zeros((6, whole.shape[0]))
        mix[:, :6], mix[:, 6 * i : 6 * i + 6] = -np.eye(6), np.eye(6)
        effect = kind().fit.with_coordinates(step)
        own = problem.given[k] if problem.given else k
        out.append((Change(own, effect), mix @ whole @ mix.T))
    return out


def columns_and_ridge(
    problem: Problem, model: Model, scale: Scale, precision: Array
) -> tuple[Columns, Array]:
    """Return the columns of all that is fitted and their prior precision; of no effects, (0,), none."""
    columns = designed(problem, model, scale)
    prior = precision if precision.size else np.zeros(coordinates(model).size)
    return columns, np.concatenate([frame_prior(problem, model)[0], prior])


def list_undetectable(problem: Problem, model: Model, families: Sequence[str]) -> list[str]:
    """Return what may differ but cannot be detected in these recordings, in words."""
    candidates = _candidates(problem, model.robot, families)
    if not candidates:
        return []
    thin = problem.thinned(ROWS)
    scale = robust_scale(thin, thin.residuals(model))
    every = replace(thin, changes=candidates)
    free = replace(model, changes=candidates)
    inverse, size = unit_inverse(*columns_and_ridge(every, free, scale, effect_precision(model)))
    remaining = np.sqrt(np.diag(inverse)) / size
    out: dict[str, None] = {}
    for change, part in zip(candidates, _places(every, free), strict=True):
        effect = change.effect
        open_ = remaining[part] > UNTOLD * spreads(model.robot, effect)
        if open_.any():
            words = effect.name + (f' of {effect.site}' if effect.site else '')
            out[words if open_.all() else f'{words} (in part)'] = None
    return list(out)
