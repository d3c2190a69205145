# Copyright 2026 weld_twin contributors
# SPDX-License-Identifier: Apache-2.0
"""
What else may be the same error as what was found: on any motion, on this one, or taken out.

Errors that no motion tells apart (`any_motion`) are told as a set even where one of the two was taken
out of the library, the simplest member first.

Families that were taken out are still held against what is found, in its place: a hose may do on
these motions what a load does. Where one of them fits as well, no data can vouch for the name
alone, and they are a set too. Where it fits clearly better, what was found stands in for a cause
that the library lacks. None of them is ever named alone.
"""

from __future__ import annotations

from collections.abc import Iterable, Iterator, Sequence
from dataclasses import replace
from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray

from ...arm.robot import Robot
from ...arrays import Array
from ...effects.effect import Effect, Stage
from ...effects.registry import REGISTRY
from ...twin.features import Features, joints_of
from ..algebra.alias import share_outside, span_of
from ..algebra.fit import Fit, fit
from ..beliefs import Beliefs
from ..result import Site
from .any_motion import (
    SAME,
    always,
    anywhere,
    columns,
    constant,
    frame_columns,
    inside,
    of_no_size,
    same_error,
    settable,
)
from .library import build
from .other_sets import ahead
from .rivals import Place, Rival, contenders, weighed
from .search import Search, refitted
from .selection import Workspace, backward, fitted_with, implausible
from .still_joints import hardly_moves, moved_most

SAME_AT_REST = 0.04
"""The same of what is done by a joint at rest: as far as that may travel [rad], a wave that comes once
per turn departs from a constant."""
MOST_EXCLUDED = 3
"""Excluded families that are fitted in a place at most: three that fit as well leave no name alone."""
FEW = 2
"""Instances of a kind that are tried on a joint at rest: what leaks in from either side; of waves
one does, as all stand still."""
MOST_PARTS = 6
"""Coordinates of a frame: what one of its size is made up of is looked for."""


def with_structural_aliases(result: Search, exclude: Sequence[str], beliefs: Beliefs) -> Search:
    """
    Return what was found, each with the excluded families that may be the same error.

    Parameters
    ----------
    exclude : sequence of str
        Families taken out of the library.

    """
    named = result.slots[: len(result.small.model.found)]
    outside = _outside(result, exclude) if named else None
    slots, refused, behind = list[tuple[Rival, ...]](), list(result.refused), np.zeros(len(named))
    for k, candidate_set in enumerate(named):
        more, best = _also(result, k, candidate_set, exclude, outside)
        if best is not None and (lead := _lead(result, best)) is not None:
            refused.append(best.fit.model.found[-1])
            behind = np.where(lead.replaced, np.maximum(behind, lead.nats), behind)
            more = [alternative for alternative in more if alternative.site != best.site]
        slots.append(
            weighed([*candidate_set, *more], beliefs.temperature) if more else candidate_set
        )
    slots = [
        tuple(
            replace(alternative, behind=float(log_bayes_factor)) for alternative in candidate_set
        )
        for candidate_set, log_bayes_factor in zip(slots, behind, strict=True)
    ]
    slots += result.slots[len(named) :]
    aliased = replace(result, slots=tuple(slots), refused=tuple(refused))
    return _settable_first(aliased, frozenset(exclude))


def _outside(result: Search, exclude: Sequence[str]) -> Workspace | None:
    """Return the workspace with a library of what was taken out, or None where that is nothing."""
    if not exclude:
        return None
    work = result.work
    others = [name for name in REGISTRY if name not in exclude]
    return replace(work, library=build(work.problem, result.small.model, work.scale, others))


def _also(
    result: Search,
    k: int,
    candidate_set: tuple[Rival, ...],
    exclude: Sequence[str],
    outside: Workspace | None,
) -> tuple[list[Rival], Rival | None]:
    """
    Return what may be the same error as a set of candidates, and the best that was taken out.

    Each is fitted in its place, and none counts for more than what was found.
    """
    work, now = result.work, result.small
    features = work.problem.features(now.model)
    taken = {Site(e.name, e.site) for e in now.model.found} | {r.site for r in candidate_set}
    likely = [r.site for r in candidate_set if r.probability >= work.beliefs.listed]
    constants = [site for site in likely if constant(REGISTRY[site.effect])]
    seeds = [*_same_anywhere(result, constants, exclude)]
    seeds += _constants_here(result, features, constants)
    seeds = [seed for seed in seeds if Site(seed.name, seed.site) not in taken]
    parts = _parts(result, k, exclude)
    if not seeds and not parts and outside is None:
        return [], None
    rest = work.without(now, k).fit
    count, most = result.effective(now), max(alternative.nats for alternative in candidate_set)
    family = now.model.found[k].name
    place = Place(work, family, rest, work.independent([now], [family], result.effective))
    alike = [_in_place(result, features, place, candidate_set, seed) for seed in seeds]
    alike += _together(place, parts)
    best = None
    if outside is not None:
        _, tried = contenders(outside, rest, count, now.model.found, MOST_EXCLUDED)
        more = [Rival(Site(*c.unit.site), place.nats(f, c), f) for c, f in tried]
        alike += more
        # What is the same error on any motion is ahead by its fewer numbers alone.
        same = {Site(seed.name, seed.site) for seed in seeds}
        best = max((r for r in more if r.site not in same), key=lambda r: r.nats, default=None)
    return [
        replace(one, nats=min(one.nats, most))
        for one in _best_of_each(alike)
        if not implausible(one.fit.model)
    ], best


class _Lead(NamedTuple):
    """By how much evidence something taken out is ahead, and which effects found it replaces."""

    nats: float
    replaced: NDArray[np.bool_]


def _lead(result: Search, other: Rival) -> _Lead | None:
    """
    Return by how much something that was taken out is ahead of what was found, where it clearly is.

    Several effects may imitate one: those that are worth nothing beside it are replaced as well.
    """
    work, now = result.work, result.small
    own = backward(work, other.fit, result.effective)
    kept = {(e.name, e.site) for e in own.model.found}
    if (other.site.effect, other.site.joint) not in kept:
        return None
    log_bayes_factor = ahead(work, own, now, result.effective)
    if log_bayes_factor <= work.beliefs.enter_nats:
        return None
    replaced = [(e.name, e.site) not in kept for e in now.model.found]
    return _Lead(log_bayes_factor, np.array(replaced))


def _parts(result: Search, k: int, exclude: Sequence[str]) -> list[Effect]:
    """
    Return errors that a person can set which together may be effect k, whatever the motion.

    Where a positioner stands beside a robot is the zero of its first axis, that of the robot's, or
    both at once.
    """
    effects = result.small.model.found
    own, taken = effects[k], {(e.name, e.site) for e in effects}
    if not constant(type(own)) or own.fit.coordinates().size < MOST_PARTS:
        return []
    robot = result.baseline.model.robot
    frames = [frame_columns(robot, name) for name in sorted(result.work.problem.align)]
    fitted = span_of(np.concatenate(frames)) if frames else None
    span, out = np.concatenate([columns(robot, own), *frames]), []
    for each in settable(robot, frozenset(exclude)):
        rows = columns(robot, each)
        seen = rows.any() and (fitted is None or share_outside(rows, fitted).min() > SAME)
        if (each.name, each.site) not in taken and seen and inside(rows, span):
            out.append(each)
    return out


def _together(place: Place, parts: Sequence[Effect]) -> list[Rival]:
    """Return errors that take a place together, where none of them does as well without another."""
    problem, scale, rest = place.work.problem, place.work.scale, place.rest.model

    def with_those(some: Sequence[Effect]) -> tuple[float, Fit]:
        own = fit(problem, rest.with_found((*rest.found, *some)), scale, None, 4)
        return place.nats(own), own

    while len(parts) > 1:
        log_bayes_factor, own = with_those(parts)
        fewer = [[e for e in parts if e is not one] for one in parts]
        best = max(fewer, key=lambda some: with_those(some)[0])
        if with_those(best)[0] < log_bayes_factor:
            return [Rival(Site(e.name, e.site), log_bayes_factor, own) for e in parts]
        parts = best
    return []


def _in_place(
    result: Search,
    features: list[Features],
    place: Place,
    candidate_set: tuple[Rival, ...],
    seed: Effect,
) -> Rival:
    """Return an effect fitted in the place of a slot."""
    own = fitted_with(result.work, place.rest.model, seed)
    unused = _unused(result, features, candidate_set, seed) if hardly_moves(features, seed) else 0
    return Rival(Site(seed.name, seed.site), place.nats(own, unused=unused), own)


def _settable_first(result: Search, exclude: frozenset[str]) -> Search:
    """
    Return what was found with errors that a person can set in the place of those they always are.

    The tilt of an axis may be the zero of its joint whatever the motion: no measurement can decide,
    mending one mends both, and the zero is what a controller takes.
    """
    robot, align = result.baseline.model.robot, result.work.problem.align
    effects = list(result.small.model.found)
    taken = {(e.name, e.site) for e in effects}
    chosen: dict[int, Site] = {}
    for k, own in enumerate(effects[: len(result.slots)]):
        if (
            not constant(type(own))
            or own.traits.set_at_controller
            or own.fit.coordinates().size > 1
        ):
            continue
        for other in settable(robot, exclude):
            site = Site(other.name, other.site)
            if (other.name, other.site) not in taken and always(robot, own, other, align):
                effects[k], chosen[k] = other, site
                taken.add((other.name, other.site))
                break
    if not chosen:
        return result
    work = result.work
    rest = result.small.model.with_found(
        tuple(e for k, e in enumerate(effects) if k not in chosen)
    )
    model = fit(work.problem, rest, work.scale, None, 4).model
    kept = iter(model.found)
    placed = tuple(e if k in chosen else next(kept) for k, e in enumerate(effects))
    small = fit(work.problem, model.with_found(placed), work.scale, None, 4)
    slots = tuple(
        _led_by(candidate_set, chosen[k], small) if k in chosen else candidate_set
        for k, candidate_set in enumerate(result.slots)
    )
    return replace(refitted(result, small), slots=slots)


def _led_by(candidate_set: tuple[Rival, ...], site: Site, small: Fit) -> tuple[Rival, ...]:
    """Return a slot with one site before all others, as likely as the likeliest."""
    most = max(candidate_set, key=lambda alternative: alternative.probability)
    first = Rival(site, most.nats, small, most.probability)
    rest = [alternative for alternative in candidate_set if alternative.site != site]
    whole = sum(alternative.probability for alternative in (first, *rest))
    return tuple(replace(r, probability=r.probability / whole) for r in (first, *rest))


def _causes(names: Sequence[str]) -> list[type[Effect]]:
    """Return the kinds that are a cause."""
    return [REGISTRY[name] for name in names if name in REGISTRY and REGISTRY[name].traits.cause]


def _same_anywhere(
    result: Search, constants: Sequence[Site], exclude: Sequence[str]
) -> Iterator[Effect]:
    """Yield the excluded errors that some constants are on any motion."""
    robot, align = result.baseline.model.robot, result.work.problem.align
    kinds = [kind.name for kind in _causes(exclude) if constant(kind)]
    for other in _candidates(robot, kinds, align) if constants else ():
        if any(same_error(robot, of_no_size(own), other) for own in constants):
            yield other


def _constants_here(
    result: Search, features: list[Features], constants: Sequence[Site]
) -> Iterator[Effect]:
    """Yield what is a constant of a joint on these motions, at the joints of some constants."""
    joints = [site.joint for site in constants]
    for joint in _with_next(result.baseline.model.robot, joints):
        view = features[moved_most(features, joint)].view
        for kind in REGISTRY.values():
            if kind.traits.cause and kind.of == 'joint' and kind.applicable(view, joint) is None:
                yield from kind.search.constants(view, joint)
                yield from _at_rest(features, kind, joint)


def _unused(
    result: Search, features: list[Features], candidate_set: Sequence[Rival], seed: Effect
) -> int:
    """
    Return how many coordinates of an effect of a joint at rest are none of what it is there.

    Of the waves of a bearing that stands still each is a constant lean: four are no more than two,
    and where the twist of a link is one of these, it takes no more than the twist.
    """
    own = _whitened(result, features, seed)
    sizes = np.linalg.eigvalsh(own @ own.T)
    used = [int((sizes >= SAME_AT_REST**2 * sizes[-1]).sum())]
    for alternative in candidate_set:
        if constant(REGISTRY[alternative.site.effect]):
            other = _whitened(result, features, of_no_size(alternative.site))
            used += [len(other)] if inside(other, own, SAME_AT_REST) else []
    return len(own) - min(used)


def _whitened(result: Search, features: list[Features], effect: Effect) -> Array:
    """Return the columns of an effect on the data, (P, rows)."""
    problem = result.work.problem
    columns = problem.effect_columns(features, effect)
    return np.asarray(problem.whitened(columns, result.work.scale))


def _at_rest(features: list[Features], kind: type[Effect], joint: str) -> list[Effect]:
    """Return instances that are no more than a constant, as the joint they need hardly moves."""
    if not kind.traits.by_motion or kind.stage in (Stage.SERVO, Stage.PLAY):
        return []
    seeds = list(kind.seeds(features[moved_most(features, joint)].view, joint))[:FEW]
    return [seed for seed in seeds if hardly_moves(features, seed)]


def _with_next(robot: Robot, joints: Sequence[str | None]) -> list[str]:
    """Return joints, each with the one after it: its bearing sits in the link before."""
    named = [robot.index(joint) for joint in joints if joint is not None]
    both = [k for i in named for k in (i, i + 1) if k < robot.n]
    return [robot.joint_names[k] for k in dict.fromkeys(both)]


def _best_of_each(more: Iterable[Rival]) -> list[Rival]:
    """Return the best rival of every site."""
    out: dict[Site, Rival] = {}
    for alternative in sorted(more, key=lambda one: one.nats):
        out[alternative.site] = alternative
    return list(out.values())


def _candidates(robot: Robot, kinds: Sequence[str], align: frozenset[str]) -> Iterator[Effect]:
    view = anywhere(robot).view
    for name in kinds:
        kind = REGISTRY[name]
        if kind.traits.fitted_with in align:
            continue
        for joint in joints_of(kind, robot):
            # A robot without a positioner has no foot of one, whatever is taken out.
            if kind.applicable(view, joint) is None:
                yield of_no_size(Site(name, joint))
