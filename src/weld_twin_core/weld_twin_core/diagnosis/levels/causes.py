# Copyright 2026 weld_twin contributors
# SPDX-License-Identifier: Apache-2.0
"""
Each cause level by level, with its share of the squared gap.

Every effect that was found stands by itself, whatever the status, and so does a place that curves
stand for. What is left beside them is one entry more. Shares are what every cause takes off the
squared gap on stretches that were not fitted, in proportion to how far it moves the tool along with
all of them together; with the noise and with what is left they add up to one.
"""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass, replace

import numpy as np

from ...arrays import Array
from ...effects.effect import Effect
from ...effects.registry import REGISTRY
from ..beliefs import Beliefs
from ..hypotheses.rivals import Rival
from ..hypotheses.search import Search
from ..result import NAMING, Cause, Shares, Site
from ..unseen.unseen_stretches import Unseen
from ..verdict.decision import Verdict
from .curved import Curved
from .free_form import FreeForm, Part

LISTED = 0.02
"""A place, dependence or name less probable than this is not listed."""
ALONE = 0.5
"""Belief at most in a lone name beside what has none: two cells of a delay and of a clock that gains,
both taken out of the library, were told as lags and as a delay. A judgement."""
LIKELY = 0.1
"""Weight from which a place or dependence of the free form counts as found."""
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
    found: Search,
    unseen: Unseen,
    verdict: Verdict,
    rival: Curved | None,
    floor: float,
    beliefs: Beliefs,
    placing: FreeForm | None = None,
) -> tuple[tuple[Cause, ...], Shares]:
    """
    Return the causes, largest share first, and what of the squared gap is left and is noise.

    Parameters
    ----------
    found : Search
    unseen : Unseen
        Of its final model.
    verdict : Verdict
    rival : Curved or None
        The free-form explanation; it is the model itself where ``unseen`` is its own.
    floor : float
        RMS of the noise alone [m].
    beliefs : Beliefs
    placing : FreeForm or None
        What tells the places of an unknown gap; the curves carried, where left out.

    """
    told = _told_claims(found, verdict, rival, beliefs)
    curved = rival if rival is not None and rival.unseen is unseen else None
    claims, rest = _nameless(found, told, verdict, curved, placing, beliefs)
    squares = (
        unseen.squares(unseen.predict([])),
        unseen.squares(unseen.predict(range(len(unseen.parts)))),
    )
    parts = _contributions(unseen)
    labels = unseen.trusted_labels()
    whole = _shares(squares, parts, claims, np.ones(labels.size, dtype=bool))
    spread = _spread(squares, parts, claims, labels)
    whole, spread = _as_placed(whole, spread, claims, placing)
    whole = np.array([s if c.kind is None else c.kind for c, s in zip(claims, whole, strict=True)])
    noise = min(floor**2 / max(float(squares[0].mean()), 1e-300), 1.0 - float(whole.sum()))
    left = max(1.0 - float(whole.sum()) - noise, 0.0)
    if verdict.status == 'unknown':
        claims = [_beside(c, float(s), left, told) for c, s in zip(claims, whole, strict=True)]
    out = [
        _cause(claim, float(share), float(error))
        for claim, share, error in zip(claims, whole, spread, strict=True)
    ]
    out.sort(key=lambda cause: -cause.share)
    # Of what nothing is known, neither a place nor what stands beside it, there is nothing to tell.
    much = left > beliefs.unexplained and bool(out)
    if rest is not None and (much or (rest.place and not out)):
        error = float(np.sqrt((spread**2).sum()))
        out.append(replace(_cause(rest, left, error), rest=True))
    return tuple(out), Shares(unexplained=left, noise=max(noise, 0.0))


def _beside(claim: _Claim, share: float, left: float, told: Sequence[_Claim]) -> _Claim:
    """
    Return a claim with its name believed as far as it outweighs what is left beside it.

    What is left may be what its formula misses. A lone name beside a rest is as likely as not an
    imitation of one cause that the library lacks.
    """
    if claim.slot is None:
        return claim
    factor = share / max(share + left, 1e-300)
    if len(told) == 1:
        factor = min(factor, ALONE / max(sum(claim.name.values()), ALONE))
    return replace(claim, name={site: factor * p for site, p in claim.name.items()})


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
    told = parts * explained / max(float(parts.sum()), 1e-300)
    error = np.hypot(spread, told / max(placing.steady, 1.0))
    return np.where(of_groups, told, whole), np.where(of_groups, error, spread)


def _listed(beliefs: Mapping[str, float]) -> tuple[tuple[str, float], ...]:
    ordered = sorted(beliefs.items(), key=lambda item: -item[1])
    return tuple((name, belief) for name, belief in ordered if belief >= LISTED)


def _told_claims(
    found: Search, verdict: Verdict, rival: Curved | None, beliefs: Beliefs
) -> list[_Claim]:
    """Return a claim for every effect that is told, or for every group of many small ones."""
    model = found.final.model.found
    if found.dense:
        return _claims_of_many(model, verdict, beliefs.families)
    each = verdict.confidence ** (1.0 / max(len(verdict.sets), 1))
    belief = each if verdict.status in NAMING else beliefs.calibration
    out: list[_Claim] = []
    for at, group in enumerate(verdict.sets):
        k = next(i for i, slot in enumerate(found.slots) if slot[0].site in group)
        taken = {member for claim in out for member in claim.members}
        member = _member(model, group, found.slots[k], taken)
        if member is not None:
            claim = _named_claim(member, k, found.slots[k], belief, rival, beliefs)
            out.append(replace(claim, group=at))
    return out


def _member(
    model: Sequence[Effect], group: Sequence[Site], slot: tuple[Rival, ...], taken: set[int]
) -> int | None:
    """
    Return which effect of the model stands for a set.

    A member that was taken out of the library may lead its set; the model holds another.
    """
    sites = [Site(effect.name, effect.site) for effect in model]
    for among in (group, [rival.site for rival in slot]):
        for at, site in enumerate(sites):
            if site in among and at not in taken:
                return at
    return None


def _nameless(
    found: Search,
    told: list[_Claim],
    verdict: Verdict,
    curved: Curved | None,
    placing: FreeForm | None,
    beliefs: Beliefs,
) -> tuple[list[_Claim], _Claim | None]:
    """Return all claims with those of curves that the model holds, and what is left beside."""
    if verdict.status != 'unknown':
        return told, None
    model = found.final.model.found
    if placing is None and curved is not None:
        placing = curved.form
    parts = placing.parts if placing is not None else ()
    places: dict[str, list[Part]] = {}
    for part in parts:
        places.setdefault(part.group.at, []).append(part)
    places = _merged(places)
    held = _carried_by(places, curved) if places else {}
    claims, left = list(told), list[Part]()
    taken = {at for claim in told for at in claim.members}
    free = beliefs.level_free
    for k, effect in enumerate(model if curved is not None else ()):
        if k not in taken and not effect.bends:
            levels = {effect.at: free}, {effect.on: free}
            claims.append(_Claim((k,), *levels, {Site(effect.name, effect.site): free}))
    for place, own in places.items():
        if not held[place]:
            left += own
            continue
        curves = {Site(model[k].name, model[k].site): free for k in held[place]}
        levels = (_place_of(place, own, beliefs), _dependence_of(own, beliefs))
        share = float(sum(part.share for part in own))
        claims.append(_Claim(held[place], *levels, curves, share))
    return claims, _rest(left, beliefs)


def _rest(left: list[Part], beliefs: Beliefs) -> _Claim:
    """Return what is left beside everything told, where the most of it is."""
    if not left:
        return _Claim((), {}, {}, {})
    places: dict[str, list[Part]] = {}
    for part in left:
        places.setdefault(part.group.at, []).append(part)
    places = _merged(places)
    first = max(places, key=lambda at: sum(part.share for part in places[at]))
    own = places[first]
    return _Claim((), _place_of(first, own, beliefs), _dependence_of(own, beliefs), {})


def _named_claim(
    member: int,
    k: int,
    slot: tuple[Rival, ...],
    belief: float,
    rival: Curved | None,
    beliefs: Beliefs,
) -> _Claim:
    """Return what is believed of an effect found one by one, from its rivals."""
    place: dict[str, float] = {}
    dependence: dict[str, float] = {}
    name: dict[Site, float] = {}
    for other in slot:
        effect = _effect_of(other)
        at = effect.at if effect is not None else str(other.site.joint)
        on = effect.on if effect is not None else REGISTRY[other.site.effect].depends_on
        place[at] = place.get(at, 0.0) + other.probability
        dependence[on] = dependence.get(on, 0.0) + other.probability
        name[other.site] = other.probability * belief
    seen = rival.form.parts if rival is not None else ()
    return _Claim(
        (member,),
        {at: p * _agreement(seen, 'at', at, beliefs) for at, p in place.items()},
        {on: p * _agreement(seen, 'on', on, beliefs) for on, p in dependence.items()},
        name,
        slot=k,
    )


def _agreement(parts: Sequence[Part], kind: str, value: str, beliefs: Beliefs) -> float:
    same = any(part.weight_of(kind).get(value, 0.0) > LIKELY for part in parts)
    return beliefs.level_agreed if same else beliefs.level_alone


def _effect_of(rival: Rival) -> Effect | None:
    for effect in rival.fit.model.found:
        if (effect.name, effect.site) == (rival.site.effect, rival.site.joint):
            return effect
    return None


def _carried_by(places: dict[str, list[Part]], rival: Curved | None) -> dict[str, Members]:
    """Return the curves of the model that stand for each place; the largest has what is over."""
    out: dict[str, Members] = dict.fromkeys(places, ())
    if rival is None:
        return out
    largest = max(places, key=lambda place: sum(part.share for part in places[place]))
    # Joints that were put under one cause bring their curves along.
    owner = {part.group.at: place for place, parts in places.items() for part in parts}
    at = len(rival.kept)
    for part in rival.form.parts:
        members = tuple(range(at, at + len(part.group.carried)))
        out[owner.get(part.group.at, largest)] += members
        at += len(members)
    return out


def _place_of(place: str, parts: list[Part], beliefs: Beliefs) -> dict[str, float]:
    """Return what is believed of the place of some parts, by the one that does most."""
    free, shared = beliefs.level_free, beliefs.level_shared
    weights = max(parts, key=lambda part: part.share).weight_of('at')
    if place in weights:
        return {at: w * free for at, w in weights.items()}
    return {place: shared, **{at: w * (free - shared) for at, w in weights.items()}}


def _dependence_of(parts: list[Part], beliefs: Beliefs) -> dict[str, float]:
    """Return what is believed of the dependence of some parts, each counted by its share."""
    whole = sum(part.share for part in parts)
    out: dict[str, float] = {}
    for part in parts:
        size = part.share / whole if whole > 0.0 else 1.0 / len(parts)
        for on, weight in part.weight_of('on').items():
            out[on] = out.get(on, 0.0) + size * weight * beliefs.level_free
    return out


def _merged(places: dict[str, list[Part]]) -> dict[str, list[Part]]:
    """Return the places, with joints that all depend on the load, or lag, put under one cause."""
    out = dict(places)
    for on, together, least in (('load', 'load', 2), ('speed', 'clock', 3)):
        joints = [
            place
            for place, parts in out.items()
            if place != together and all(part.group.on == on for part in parts)
        ]
        if len(joints) >= least or (joints and together in out):
            out.setdefault(together, [])
            out[together] = [
                *out[together],
                *(part for place in joints for part in out.pop(place)),
            ]
    return out


def _claims_of_many(model: tuple[Effect, ...], verdict: Verdict, belief: float) -> list[_Claim]:
    """Return a claim for every kind that unseen data need, with its joints and with what is like it."""
    out = []
    for family in verdict.families:
        if not (family.named and family.needed):
            continue
        whole = 1.0 + sum(part for _, part in family.like)
        told = [(site, share / whole) for site, share in family.needed]
        told += [(site, part / whole) for site, part in family.like]
        place: dict[str, float] = {}
        dependence: dict[str, float] = {}
        name: dict[Site, float] = {}
        for site, part in told:
            own = next(e for e in model if (e.name, e.site) == (site.effect, site.joint))
            place[own.at] = place.get(own.at, 0.0) + belief * part
            dependence[own.on] = dependence.get(own.on, 0.0) + belief * part
            name[site] = belief * part
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
    count = names.size
    return np.asarray(np.sqrt((count - 1) / count * ((tries - tries.mean(axis=0)) ** 2).sum(0)))
