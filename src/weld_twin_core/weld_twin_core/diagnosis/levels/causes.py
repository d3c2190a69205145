# Copyright 2026 weld_twin contributors
# SPDX-License-Identifier: Apache-2.0
"""
Each cause level by level, with its share of the squared gap.

Every effect that was found stands by itself, whatever the status, and so does a place that curves
stand for. What is left beside them is one entry more. Shares are what every cause takes off the
squared gap on stretches that were not fitted, in proportion to how far it moves the tool along with
all of them together; with the noise and with what is left they add up to one. What each adds is told
sample by sample, too, so that causes can be thought away.
"""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass, replace

import numpy as np

from ...arrays import Array
from ...effects.effect import Effect
from ..beliefs import Beliefs
from ..hypotheses.search import Search
from ..posterior.table import Row
from ..result import Cause, Contributions, Shares, Site
from ..unseen.folds import jackknife
from ..unseen.unseen_stretches import Unseen
from ..verdict.decision import Verdict
from .curved import Curved
from .free_form import FreeForm, Part

LISTED = 0.02
"""A place, dependence or name less probable than this is not listed."""
STUDENT = 1.86
"""Student's t for 90 % and the 8 stretches that take turns."""

SHARED = 0.002
"""Share by which an interval reaches further on each side than its stretches tell: they share the
noise and the fit. Chosen on 167 causes of sealed cases so that 90 % are covered; of 167 others
88 % are."""


Members = tuple[int, ...]


@dataclass(frozen=True, eq=False)
class _Claim:
    """One cause before its share: members of the model, its slot, and what is believed of it."""

    members: tuple[int, ...]
    place: dict[str, float]
    dependence: dict[str, float]
    name: dict[Site, float]
    taken: float | None = None
    """Share of the squared gap that groups at this place take off unseen folds; None of a name."""
    slot: int | None = None
    group: int | None = None
    kind: float | None = None
    """Share of the squared gap that a kind takes off unseen data; None of one effect by itself."""


def causes(
    result: Search,
    unseen: Unseen,
    table: Sequence[Row],
    verdict: Verdict,
    alternative: Curved | None,
    floor: float,
    beliefs: Beliefs,
    placing: FreeForm | None = None,
) -> tuple[tuple[Cause, ...], Shares]:
    """
    Return the causes, largest share first, and what of the squared gap is left and is noise.

    alternative: the free-form explanation; it is the model itself where ``unseen`` is its own.
    floor: RMS of the noise alone [m].
    placing: what tells the places of an unknown gap.
    """
    reported = _told_claims(result, table, verdict)
    curved = alternative if alternative is not None and alternative.unseen is unseen else None
    claims, rest = _nameless(result, reported, verdict, curved, placing, beliefs)
    squares = (
        unseen.squares(unseen.bare),
        unseen.squares(unseen.whole),
    )
    parts = _contributions(unseen)
    labels = unseen.trusted_labels()
    whole = _shares(squares, parts, claims, np.ones(labels.size, dtype=bool))
    spread = _spread(squares, parts, claims, labels)
    whole, spread = _as_placed(whole, spread, claims, placing)
    whole = np.array([s if c.kind is None else c.kind for c, s in zip(claims, whole, strict=True)])
    noise = min(floor**2 / max(float(squares[0].mean()), 1e-300), 1.0 - float(whole.sum()))
    remaining = max(1.0 - float(whole.sum()) - noise, 0.0)
    out = [
        _cause(claim, float(share), float(error))
        for claim, share, error in zip(claims, whole, spread, strict=True)
    ]
    out.sort(key=lambda cause: -cause.share)
    # Of what nothing is known, neither a place nor what stands beside it, there is nothing to tell.
    much = remaining > beliefs.unexplained and bool(out)
    if rest is not None and (much or (rest.place and not out)):
        error = float(np.sqrt((spread**2).sum()))
        out.append(replace(_cause(rest, remaining, error), rest=True))
    return tuple(out), Shares(unexplained=remaining, noise=max(noise, 0.0))


def _cause(claim: _Claim, share: float, error: float) -> Cause:
    """Return a claim with its share."""
    return Cause(
        place=_listed(claim.place),
        dependence=_listed(claim.dependence),
        name=tuple((s, p) for s, p in claim.name.items() if p >= LISTED),
        share=share,
        share_ci90=(
            float(max(share - STUDENT * error, 0.0)),
            float(min(share + STUDENT * error, 1.0)),
        ),
        members=claim.members,
        slot=claim.slot,
        effect=claim.group,
    )


def covering(cause: Cause) -> Cause:
    """Return a cause whose interval of the share holds the true share with 90 %."""
    low, high = cause.share_ci90
    return replace(cause, share_ci90=(max(low - SHARED, 0.0), min(high + SHARED, 1.0)))


def _as_placed(
    whole: Array, spread: Array, claims: Sequence[_Claim], placing: FreeForm | None
) -> tuple[Array, Array]:
    """
    Return shares and their errors with those of places as the groups take the gap off.

    Curves that are carried stand for a place as well as curves can; what a place is worth its own
    groups say, whether or not a curve carries them.
    """
    of_groups = np.array([claim.taken is not None for claim in claims])
    if placing is None or not of_groups.any():
        return whole, spread
    parts = np.array([claim.taken or 0.0 for claim in claims])
    explained = max(float(whole[of_groups].sum()), float(parts.sum()))
    explained = min(explained, max(1.0 - float(whole[~of_groups].sum()), 0.0))
    reported = parts * explained / max(float(parts.sum()), 1e-300)
    error = np.hypot(spread, reported / max(placing.steady, 1.0))
    return np.where(of_groups, reported, whole), np.where(of_groups, error, spread)


def _listed(beliefs: Mapping[str, float]) -> tuple[tuple[str, float], ...]:
    ordered = sorted(beliefs.items(), key=lambda item: -item[1])
    return tuple((name, belief) for name, belief in ordered if belief >= LISTED)


def _told_claims(result: Search, table: Sequence[Row], verdict: Verdict) -> list[_Claim]:
    """Return a claim for every effect that is told, or for every group of many small ones."""
    model = result.final.model.found
    if result.dense:
        return _claims_of_many(model, verdict)
    out: list[_Claim] = []
    for at, group in enumerate(verdict.sets):
        k = next(i for i, row in enumerate(table) if row.leader.site in group)
        taken = {member for claim in out for member in claim.members}
        member = _member(model, group, table[k], taken)
        if member is not None:
            names = {site: p for site, p in table[k].names().items() if site in group}
            levels = table[k].places(), table[k].dependences()
            out.append(_Claim((member,), *levels, names, slot=k, group=at))
    return out


def _member(
    model: Sequence[Effect], group: Sequence[Site], row: Row, taken: set[int]
) -> int | None:
    """
    Return which effect of the model stands for a set.

    A member that was taken out of the library may lead its set; the model holds another.
    """
    sites = [Site(effect.name, effect.site) for effect in model]
    for among in (group, [alternative.site for alternative in row.slot]):
        for at, site in enumerate(sites):
            if site in among and at not in taken:
                return at
    return None


def _nameless(
    result: Search,
    reported: list[_Claim],
    verdict: Verdict,
    curved: Curved | None,
    placing: FreeForm | None,
    beliefs: Beliefs,
) -> tuple[list[_Claim], _Claim | None]:
    """Return all claims with those of curves that the model holds, and what is left beside."""
    if verdict.status != 'unknown':
        # What was found and does not count as named is left, and nothing else says where it sits.
        return reported, _rest([], beliefs) if len(reported) < len(result.slots) else None
    model = result.final.model.found
    places = _by_place(() if placing is None else placing.parts)
    held = _carried_by(places, curved) if places else {}
    claims, remaining = list(reported), list[Part]()
    taken = {at for claim in reported for at in claim.members}
    for k, effect in enumerate(model if curved is not None else ()):
        if k not in taken and not effect.traits.bends:
            levels = {effect.at: 1.0}, {effect.on: 1.0}
            claims.append(_Claim((k,), *levels, {Site(effect.name, effect.site): 1.0}))
    for place, own in places.items():
        if not held[place]:
            remaining += own
            continue
        curves = {Site(model[k].name, model[k].site): 1.0 for k in held[place]}
        levels = (_place_of(place, own, beliefs), _dependence_of(own))
        share = float(sum(part.share for part in own))
        claims.append(_Claim(held[place], *levels, curves, share))
    return claims, _rest(remaining, beliefs)


def _rest(remaining: list[Part], beliefs: Beliefs) -> _Claim:
    """Return what is left beside everything told, where the most of it is."""
    if not remaining:
        return _Claim((), {}, {}, {})
    places = _by_place(remaining)
    first = max(places, key=lambda at: sum(part.share for part in places[at]))
    own = places[first]
    return _Claim((), _place_of(first, own, beliefs), _dependence_of(own), {})


def _carried_by(places: dict[str, list[Part]], alternative: Curved | None) -> dict[str, Members]:
    """Return the curves of the model that stand for each place; the largest has what is over."""
    out: dict[str, Members] = dict.fromkeys(places, ())
    if alternative is None:
        return out
    largest = max(places, key=lambda place: sum(part.share for part in places[place]))
    # Joints that were put under one cause bring their curves along.
    owner = {part.group.at: place for place, parts in places.items() for part in parts}
    at = len(alternative.kept)
    for part in alternative.form.parts:
        members = tuple(range(at, at + len(part.group.carried)))
        out[owner.get(part.group.at, largest)] += members
        at += len(members)
    return out


def _place_of(place: str, parts: list[Part], beliefs: Beliefs) -> dict[str, float]:
    """Return what is believed of the place of some parts, by the one that does most."""
    shared = beliefs.level_shared
    weights = max(parts, key=lambda part: part.share).weight_of('at')
    if place in weights:
        return weights
    return {place: shared, **{at: w * (1.0 - shared) for at, w in weights.items()}}


def _dependence_of(parts: list[Part]) -> dict[str, float]:
    """Return what is believed of the dependence of some parts, each counted by its share."""
    whole = sum(part.share for part in parts)
    out: dict[str, float] = {}
    for part in parts:
        size = part.share / whole if whole > 0.0 else 1.0 / len(parts)
        for on, weight in part.weight_of('on').items():
            out[on] = out.get(on, 0.0) + size * weight
    return out


def _by_place(parts: Sequence[Part]) -> dict[str, list[Part]]:
    """Return the parts at each place; joints that all depend on the load, or lag, are one cause."""
    out: dict[str, list[Part]] = {}
    for part in parts:
        out.setdefault(part.group.at, []).append(part)
    for on, together, least in (('load', 'load', 2), ('speed', 'clock', 3)):
        joints = [
            place
            for place, own in out.items()
            if place != together and all(part.group.on == on for part in own)
        ]
        if len(joints) >= least or (joints and together in out):
            alike = [part for place in joints for part in out.pop(place)]
            out[together] = [*out.get(together, ()), *alike]
    return out


def _claims_of_many(model: tuple[Effect, ...], verdict: Verdict) -> list[_Claim]:
    """Return a claim for every kind that unseen data need, with its joints and with what is like it."""
    out = []
    for family in verdict.families:
        if not (family.named and family.needed):
            continue
        whole = 1.0 + sum(part for _, part in family.like)
        reported = [(site, share / whole) for site, share in family.needed]
        reported += [(site, part / whole) for site, part in family.like]
        place: dict[str, float] = {}
        dependence: dict[str, float] = {}
        name: dict[Site, float] = {}
        for site, part in reported:
            own = next(e for e in model if (e.name, e.site) == (site.effect, site.joint))
            place[own.at] = place.get(own.at, 0.0) + part
            dependence[own.on] = dependence.get(own.on, 0.0) + part
            name[site] = part
        members = tuple(k for k, effect in enumerate(model) if effect.name == family.effect)
        group = next(k for k, each in enumerate(verdict.sets) if each[0] == family.needed[0][0])
        claim = _Claim(members, place, dependence, name, group=group, kind=family.share)
        out.append(claim)
    return out


def _contributions(unseen: Unseen) -> Array:
    """Return how much each effect moves the tool along with all of them, (K, samples) [m^2]."""
    total = unseen.targets[1:].sum(axis=0) if len(unseen.parts) else np.zeros(0)
    # A product of two fields is a difference of two squares.
    return np.array(
        [
            0.25 * (unseen.squares(total + t) - unseen.squares(total - t))
            for t in unseen.targets[1:]
        ]
    )


def _shares(
    squares: tuple[Array, Array],
    parts: Array,
    claims: Sequence[_Claim],
    keep: np.ndarray,
) -> Array:
    """Return the share of every claim over some of the samples."""
    before, after = (float(s[keep].mean()) for s in squares)
    explained = max(1.0 - after / max(before, 1e-300), 0.0)
    if not claims or not len(parts):
        return np.zeros(len(claims))
    sizes = np.maximum(parts[:, keep].mean(axis=1), 0.0)
    total = max(float(sizes.sum()), 1e-300)
    return np.array([explained * sizes[list(c.members)].sum() / total for c in claims])


def _spread(
    squares: tuple[Array, Array], parts: Array, claims: Sequence[_Claim], labels: np.ndarray
) -> Array:
    """Return the standard error of every share, by leaving out one stretch at a time."""
    names = np.unique(labels)
    if names.size < 3 or not claims:
        return np.full(len(claims), 0.5)
    tries = np.array([_shares(squares, parts, claims, labels != n) for n in names])
    return np.asarray(np.sqrt(jackknife(tries)))


def contributions(unseen: Unseen, causes: Sequence[Cause]) -> Contributions | None:
    """
    Return what every cause adds to the residual on unseen stretches; None where none can be told.

    A cause is taken off as it acts along with the others, and the frames that are fitted anew take
    their part of it. What the fits of fewer effects make of each other is a small rest; it is
    shared out by size, so that all adds up.

    unseen: of the model that the causes stand for.
    """
    if not any(cause.members for cause in causes):
        return None
    fields = _fields(unseen)
    named = {k for cause in causes for k in cause.members}
    others = tuple(k for k in range(len(fields)) if k not in named)
    groups = [cause.members for cause in causes] + [others] * bool(others)
    parts = np.array([fields[list(group)].sum(axis=0) for group in groups])
    remaining = unseen.whole
    rest = unseen.bare - remaining - parts.sum(axis=0)
    sizes = (parts**2).mean(axis=1)
    parts += rest * (sizes / max(float(sizes.sum()), 1e-300))[:, None]
    split = [_metres(unseen, part) for part in (remaining, *parts)]
    return Contributions(
        left=tuple(split[0]),
        parts=tuple(np.array(each) for each in zip(*split[1:], strict=True)),
    )


def _fields(unseen: Unseen) -> Array:
    """Return what each effect adds once the frames are fitted anew, (K, rows), whitened."""
    fields, count = unseen.targets[1:], unseen.frames
    if not count:
        return fields
    columns = unseen.columns.chosen(np.arange(count)).written_out()
    normal = columns @ columns.T + np.diag(unseen.precision[:count])
    step = np.linalg.lstsq(normal, columns @ fields.T, rcond=None)[0]
    return np.asarray(fields - step.T @ columns)


def _metres(unseen: Unseen, rows: Array) -> list[Array]:
    """Return the position part of whitened rows, (M, 3) [m] for every recording."""
    return [part[:, :3] for part in unseen.problem.measured_rows(rows, unseen.scale)]
