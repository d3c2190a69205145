# Copyright 2026 weld_twin contributors
# SPDX-License-Identifier: Apache-2.0
"""
Each cause level by level, with its share of the squared gap.

Every effect that counts as named stands by itself, whatever the status, and so does a place that
curves stand for. What is left beside them is one entry more. Shares are what every cause takes off the
squared gap in folds that were not fitted, in proportion to how far it moves the tool along with
all of them together; with the noise and with what is left they add up to one. What each adds is told
sample by sample, too, so that causes can be thought away.
"""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import replace
from math import nan

import numpy as np

from ...arrays import Array
from ...effects.effect import Effect
from ..beliefs import Beliefs
from ..evidence import Left, Row, Search, Verdict, marginal
from ..negligible import EMPTY
from ..result import Cause, Contributions, Shares, Site
from ..unseen.folds import COVERED, jackknife, student
from ..unseen.unseen_stretches import Unseen
from .curved import Curved
from .free_form import FreeForm, Part

LISTED = Beliefs.listed
"""A place, dependence or name less probable than this is not listed."""
SHARED = 0.002
"""Share by which an interval reaches further on each side than its folds show: they share the
noise and the fit. Chosen on 167 causes of sealed cases so that 90 % are covered; of 167 others
88 % are."""


def causes(
    result: Search,
    unseen: Unseen,
    table: Sequence[Row],
    verdict: Verdict,
    alternative: Curved | None,
    left: Left,
    placing: FreeForm,
) -> tuple[tuple[Cause, ...], Shares]:
    """
    Return the causes, largest share first, and what of the squared gap is left and is noise.

    alternative: the free-form explanation; it is the model itself where ``unseen`` is its own.
    left: what remains unseen, beside the noise.
    placing: what tells the places of an unknown gap; of any other nothing.
    """
    named = _claims_of_names(result, table, verdict)
    curved = alternative if alternative is not None and alternative.unseen is unseen else None
    claims, rest = _nameless(result, named, verdict, curved, placing)
    squares = unseen.squares(unseen.bare), unseen.squares(unseen.whole)
    parts = _contributions(unseen)
    labels = unseen.trusted_labels()
    whole = _shares(squares, parts, claims, np.ones(labels.size, dtype=bool))
    spread = _spread(squares, parts, claims, labels)
    if not result.dense:
        given = np.array([claim.share for claim in claims])
        whole, spread = _as_placed(whole, spread, given, placing)
    told, whole = _beside_set_up(result, claims, whole, left.beliefs.unexplained)
    claims, whole, spread = [claims[k] for k in told], whole[told], spread[told]
    beside = 1.0 - float(whole.sum())
    noise = min(left.evidence.floor**2 / max(float(squares[0].mean()), EMPTY), beside)
    if not (left.above_noise or left.wide or len(named) < len(result.candidate_sets)):
        # Few rows leave more of noise alone on unseen parts than its floor.
        noise = beside
    remaining = max(beside - noise, 0.0)
    out = [
        _sized(claim, float(share), float(error))
        for claim, share, error in zip(claims, whole, spread, strict=True)
    ]
    # Of what nothing is known, neither a place nor what stands beside it, there is nothing to tell.
    much = remaining > left.beliefs.unexplained and bool(out)
    if much or (rest.place and not out):
        error = float(np.sqrt((spread**2).sum()))
        out.append(replace(_sized(rest, remaining, error), rest=True))
    # What has no place either says nothing that somebody could begin with.
    out.sort(key=lambda cause: (not cause.place, -cause.share))
    return tuple(out), Shares(unexplained=remaining, noise=max(noise, 0.0))


def _beside_set_up(
    result: Search, claims: Sequence[Cause], whole: Array, least: float
) -> tuple[list[int], Array]:
    """
    Return which claims are told, and the shares of all of the whole gap.

    Kinds of many small errors have shares of what the set-up's motion leaves. A motion of no more than
    the least share is none: it may be what the others do not quite follow.
    """
    found = result.final.model.found
    if result.dense:
        given = np.array([claim.share for claim in claims])
        beside = float(whole[np.isnan(given)].sum())
        whole = np.where(np.isnan(given), whole, given * (1.0 - beside))
    told = (s > least or not _of_set_up(found, c) for c, s in zip(claims, whole, strict=True))
    return [k for k, one in enumerate(told) if one], whole


def _of_set_up(found: Sequence[Effect], claim: Cause) -> bool:
    """Return whether a claim is how the set-up moved, which is no cause by name."""
    own = [found[k].traits for k in claim.members]
    return bool(own) and all(each.of_setup and not each.cause for each in own)


def _cause(
    members: tuple[int, ...],
    place: Mapping[str, float],
    dependence: Mapping[str, float],
    name: Mapping[Site, float],
    *,
    share: float = nan,
    row: int | None = None,
    effect: int | None = None,
) -> Cause:
    """Return a cause; its share is that of a kind, or of groups, where it is given already."""
    names = tuple((site, p) for site, p in name.items() if p >= LISTED)
    levels = _listed(place), _listed(dependence), names
    return Cause(*levels, share, (nan, nan), members, row=row, effect=effect)


def _sized(cause: Cause, share: float, error: float) -> Cause:
    reach = student(COVERED) * error
    low, high = max(share - reach, 0.0), min(share + reach, 1.0)
    return replace(cause, share=share, share_ci90=(float(low), float(high)))


def covering(cause: Cause) -> Cause:
    """Return a cause whose interval of the share holds the true share with 90 %."""
    low, high = cause.share_ci90
    return replace(cause, share_ci90=(max(low - SHARED, 0.0), min(high + SHARED, 1.0)))


def _as_placed(
    whole: Array, spread: Array, given: Array, placing: FreeForm
) -> tuple[Array, Array]:
    """Return shares and their errors with those of places as their own groups take the gap off."""
    of_groups, parts = ~np.isnan(given), np.nan_to_num(given)
    if not of_groups.any():
        return whole, spread
    explained = max(float(whole[of_groups].sum()), float(parts.sum()))
    explained = min(explained, max(1.0 - float(whole[~of_groups].sum()), 0.0))
    shares = parts * explained / max(float(parts.sum()), EMPTY)
    error = np.hypot(spread, shares / max(placing.steady, 1.0))
    return np.where(of_groups, shares, whole), np.where(of_groups, error, spread)


def _listed(beliefs: Mapping[str, float]) -> tuple[tuple[str, float], ...]:
    ordered = sorted(beliefs.items(), key=lambda item: -item[1])
    return tuple((name, belief) for name, belief in ordered if belief >= LISTED)


def _claims_of_names(result: Search, table: Sequence[Row], verdict: Verdict) -> list[Cause]:
    """Return a claim for every effect that is reported, or for every group of many small ones."""
    model = result.final.model.found
    if result.dense:
        return _claims_of_many(model, verdict)
    out, sites = list[Cause](), [Site.of(effect) for effect in model]
    for at, group in enumerate(verdict.sets):
        k = next(i for i, row in enumerate(table) if row.leader.site in group)
        taken = {member for claim in out for member in claim.members}
        # A member that was taken out of the library may lead its set; the model holds another.
        among = (group, [one.site for one in table[k].candidate_set])
        own = (m for some in among for m, s in enumerate(sites) if s in some and m not in taken)
        member = next(own, None)
        if member is not None:
            names = {site: p for site, p in table[k].names().items() if site in group}
            levels = table[k].places(), table[k].dependences(), names
            out.append(_cause((member,), *levels, row=k, effect=at))
    return out


def _nameless(
    result: Search,
    named: list[Cause],
    verdict: Verdict,
    curved: Curved | None,
    placing: FreeForm,
) -> tuple[list[Cause], Cause]:
    """Return all claims with those of curves that the model holds, and what may be left beside."""
    if verdict.status != 'unknown':
        return named, _rest([])  # nothing says where what is left sits
    model = result.final.model.found
    places = _by_place(placing.parts)
    curves_at = _curves_by_place(places, curved) if places else {}
    claims, remaining = list(named), list[Part]()
    taken = {at for claim in named for at in claim.members}
    if result.lacking:
        taken_out = result.lacking[0]
        beside = tuple(k for k in range(len(model)) if k not in taken and curved is not None)
        curves = {Site.of(model[k]): 1.0 for k in beside if model[k].traits.bends}
        stand_in = _cause(beside, {taken_out.at: 1.0}, {taken_out.on: 1.0}, curves)
        return ([*claims, stand_in], _rest([])) if beside else (claims, stand_in)
    by_curves = {at for members in curves_at.values() for at in members}
    for k, effect in enumerate(model if curved is not None else ()):
        if k in taken | by_curves or effect.traits.bends:
            continue
        if not effect.traits.cause and curves_at.get(effect.at):
            # How a set-up moved is nuisance, and no name beside the curves of that place.
            curves_at[effect.at] += (k,)
            continue
        name = {Site.of(effect): 1.0} if effect.traits.cause else {}
        claims.append(_cause((k,), {effect.at: 1.0}, {effect.on: 1.0}, name))
    for place, own in places.items():
        if not curves_at[place]:
            remaining += own
            continue
        curves = {Site.of(model[k]): 1.0 for k in curves_at[place] if k in by_curves}
        levels = _place_of(own), _dependence_of(own), curves
        share = float(sum(part.share for part in own))
        claims.append(_cause(curves_at[place], *levels, share=share))
    return claims, _rest(remaining)


def _rest(remaining: list[Part]) -> Cause:
    """Return what is left beside everything reported, where the most of it is."""
    if not remaining:
        return _cause((), {}, {}, {})
    own = max(_by_place(remaining).values(), key=lambda own: sum(part.share for part in own))
    return _cause((), _place_of(own), _dependence_of(own), {})


def _curves_by_place(
    places: dict[str, list[Part]], alternative: Curved | None
) -> dict[str, tuple[int, ...]]:
    """Return the curves of the model that stand for each place; the largest has what is over."""
    out: dict[str, tuple[int, ...]] = dict.fromkeys(places, ())
    if alternative is None:
        return out
    largest = max(places, key=lambda place: sum(part.share for part in places[place]))
    at = len(alternative.kept)
    for part in alternative.form.parts:
        members = tuple(range(at, at + len(part.group.movable_curves)))
        out[part.group.at if part.group.at in out else largest] += members
        at += len(members)
    return out


def _place_of(parts: list[Part]) -> dict[str, float]:
    """Return what is believed of the place of some parts, by the one that does most."""
    return max(parts, key=lambda part: part.share).weight_of('at')


def _dependence_of(parts: list[Part]) -> dict[str, float]:
    """Return what is believed of the dependence of some parts, each counted by its share."""
    whole = sum(part.share for part in parts)
    sizes = [part.share / whole if whole > 0.0 else 1.0 / len(parts) for part in parts]
    return marginal(
        (on, size * weight)
        for part, size in zip(parts, sizes, strict=True)
        for on, weight in part.weight_of('on').items()
    )


def _by_place(parts: Sequence[Part]) -> dict[str, list[Part]]:
    """Return the parts at each place."""
    out: dict[str, list[Part]] = {}
    for part in parts:
        out.setdefault(part.group.at, []).append(part)
    return out


def _claims_of_many(model: tuple[Effect, ...], verdict: Verdict) -> list[Cause]:
    """Return a claim for every kind that unseen data need, with its joints and with what is like it."""
    out = []
    for family in verdict.families:
        if not (family.named and family.needed):
            continue
        whole = 1.0 + sum(part for _, part in family.like)
        sites = [(site, share / whole) for site, share in family.needed]
        sites += [(site, part / whole) for site, part in family.like]
        effects = {Site.of(effect): effect for effect in reversed(model)}
        place = marginal((effects[site].at, part) for site, part in sites)
        dependence = marginal((effects[site].on, part) for site, part in sites)
        kinds = {family.effect, *family.joined}
        members = tuple(k for k, effect in enumerate(model) if effect.name in kinds)
        group = next(k for k, each in enumerate(verdict.sets) if each[0] == family.needed[0][0])
        levels = place, dependence, dict(sites)
        out.append(_cause(members, *levels, share=family.share, effect=group))
    # How the set-up moved is no kind that could be taken out, but it is a part of the gap.
    moved = ((k, e) for k, e in enumerate(model) if e.traits.of_setup and not e.traits.cause)
    return out + [_cause((k,), {e.at: 1.0}, {e.on: 1.0}, {}) for k, e in moved]


def _contributions(unseen: Unseen) -> Array:
    """Return how much each effect moves the tool along with all of them, (K, samples) [m^2]."""
    fields = unseen.beside_frames(unseen.targets[1:])
    total = fields.sum(axis=0)
    # A product of two fields is a difference of two squares.
    return np.array([(unseen.squares(total + f) - unseen.squares(total - f)) / 4 for f in fields])


def _shares(
    squares: tuple[Array, Array],
    parts: Array,
    claims: Sequence[Cause],
    keep: np.ndarray,
) -> Array:
    """Return the share of every claim over some of the samples."""
    before, after = (float(s[keep].mean()) for s in squares)
    explained = max(1.0 - after / max(before, EMPTY), 0.0)
    if not claims or not len(parts):
        return np.zeros(len(claims))
    sizes = np.maximum(parts[:, keep].mean(axis=1), 0.0)
    total = max(float(sizes.sum()), EMPTY)
    return np.array([explained * sizes[list(c.members)].sum() / total for c in claims])


def _spread(
    squares: tuple[Array, Array], parts: Array, claims: Sequence[Cause], labels: np.ndarray
) -> Array:
    """Return the standard error of every share, by leaving out one fold at a time."""
    names = np.unique(labels)
    if names.size < 3 or not claims:
        return np.ones(len(claims))
    tries = np.array([_shares(squares, parts, claims, labels != n) for n in names])
    return np.asarray(np.sqrt(jackknife(tries)))


def contributions(unseen: Unseen, causes: Sequence[Cause]) -> Contributions | None:
    """
    Return what every cause adds to the residual in unseen folds; None where it cannot be estimated.

    A cause is taken off as it acts along with the others, and the frames that are fitted anew take
    their part of it. What the fits of fewer effects make of each other is a small rest; it is
    shared out by size, so that all adds up.

    unseen: of the model that the causes stand for.
    """
    if not any(cause.members for cause in causes):
        return None
    fields = unseen.beside_frames(unseen.targets[1:])
    named = {k for cause in causes for k in cause.members}
    others = tuple(k for k in range(len(fields)) if k not in named)
    groups = [cause.members for cause in causes] + [others] * bool(others)
    parts = np.array([fields[list(group)].sum(axis=0) for group in groups])
    rest = unseen.bare - unseen.whole - parts.sum(axis=0)
    sizes = (parts**2).mean(axis=1)
    parts += rest * (sizes / max(float(sizes.sum()), EMPTY))[:, None]
    metres = [unseen.problem.measured_rows(part, unseen.scale) for part in (unseen.whole, *parts)]
    split = [[each[:, :3] for each in own] for own in metres]
    return Contributions(
        left=tuple(split[0]),
        parts=tuple(np.array(each) for each in zip(*split[1:], strict=True)),
    )
