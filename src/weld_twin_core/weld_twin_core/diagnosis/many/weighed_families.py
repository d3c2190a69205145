# Copyright 2026 weld_twin contributors
# SPDX-License-Identifier: Apache-2.0
"""
Which kinds of error unseen data need, of all kinds fitted together, and on which joints.

All kinds at once predict well, and hardly one of them is missed: the others take its place. So
kinds are added one after the other, each as large as machines have it, and the one that leaves
least on unseen data first, until no other takes a tenth off. Each is then taken out of what was
chosen, with all others and the frames fitted anew: a kind is needed where unseen data get worse.
What would do as well in its place is told beside it.
"""

from __future__ import annotations

from collections.abc import Iterable, Mapping, Sequence
from dataclasses import dataclass, replace

import numpy as np
from numpy.typing import NDArray

from ...arrays import Array
from ..beliefs import Beliefs
from ..hypotheses.search import Search
from ..result import Family, Site
from ..unseen.folds import STRETCHES
from ..unseen.unseen_stretches import Unseen
from .shrinkage import believed

TINY = 1e-9
"""Least error [m] divided by: a nanometre, far below any instrument."""
MOST_LIKE = 2
"""Kinds told beside one at the most; what more than three would explain is no name."""
Members = Mapping[str, Sequence[int]]


def weighed_families(result: Search, unseen: Unseen, beliefs: Beliefs) -> tuple[Family, ...]:
    """
    Return what every kind of the final model accounts for on unseen data.

    result: of all kinds fitted together.
    """
    effects = result.final.model.found
    members: dict[str, list[int]] = {}
    for k, effect in enumerate(effects):
        if effect.traits.cause or effect.traits.bends:
            members.setdefault(effect.name, []).append(k)
    always = [
        k for k, effect in enumerate(effects) if not (effect.traits.cause or effect.traits.bends)
    ]
    case = _Case.of(result, unseen, always)
    chosen = _chosen(case, members, beliefs.family_worth)
    out = []
    for name, index in members.items():
        if not effects[index[0]].traits.cause:
            continue
        sizes = [(Site(name, effects[k].site), unseen.rms(unseen.targets[1 + k])) for k in index]
        sizes.sort(key=lambda item: -item[1])
        out.append(_weighed(case, members, chosen, name, tuple(sizes), beliefs.family_worth))
    return _with_shares(out, case, _all(members, chosen))


def _with_shares(
    families: Sequence[Family], case: _Case, chosen: Sequence[int]
) -> tuple[Family, ...]:
    """Return the kinds with their shares of what those chosen take off together."""
    bare, remaining = (float((case.left(kept) ** 2).mean()) for kept in ((), chosen))
    explained = max(1.0 - remaining / max(bare, TINY**2), 0.0)
    whole = sum(one.rms_m**2 for one in families if one.chosen)
    return tuple(
        replace(one, share=explained * one.rms_m**2 / max(whole, TINY**2)) if one.chosen else one
        for one in families
    )


@dataclass(frozen=True, eq=False)
class _Case:
    """
    What models of some effects leave on what they were not fitted to, each as large as machines have it.

    Every view leaves out other parts: stretches of time, and regions of posture. ``parts`` is the part
    of every sample, those of all views one after the other.
    """

    views: tuple[Unseen, ...]
    parts: NDArray[np.intp]
    always: Sequence[int]
    sites: tuple[Site, ...]
    causes: tuple[bool, ...]
    known: dict[tuple[int, ...], Array]

    @classmethod
    def of(cls, result: Search, unseen: Unseen, always: Sequence[int]) -> _Case:
        model = result.final.model
        usual = believed(model)
        usual = np.where(usual > 0.0, usual, result.precision)
        views = unseen.held(usual, result.final.coordinates).every_way()
        parts, first = [], 0
        for view in views:
            parts.append(first + _neighbours(view))
            first = int(parts[-1].max()) + 1
        sites = tuple(Site(effect.name, effect.site) for effect in model.found)
        causes = tuple(effect.traits.cause for effect in model.found)
        return cls(tuple(views), np.concatenate(parts), always, sites, causes, {})

    def named(self, effects: Sequence[int]) -> bool:
        """Return whether some effects may be named as a cause."""
        return all(self.causes[k] for k in effects)

    def squares(self, kept: Iterable[int]) -> Array:
        """Return the squared error of every sample, with some effects in the model, [m^2]."""
        index = tuple(sorted({*kept, *self.always}))
        if index not in self.known:
            each = [view.squares(view.predict(index)) for view in self.views]
            self.known[index] = np.concatenate(each)
        return self.known[index]

    def left(self, kept: Iterable[int]) -> Array:
        """Return the RMS error [m] of every part, shape (parts,)."""
        return np.asarray(np.sqrt(self._mean(self.squares(kept))))

    def growth(self, kept: Iterable[int], less: Iterable[int]) -> Array:
        """
        Return by what share the error of every part grows from one model to a lesser one.

        It shrinks where that is beyond its standard error: a part of a few stations varies by chance.
        """
        out = self.left(less) / np.maximum(self.left(kept), TINY) - 1.0
        more = self.squares(less) - self.squares(kept)
        mean = self._mean(more)
        spread = self._mean((more - mean[self.parts]) ** 2)
        error = np.sqrt(spread / np.maximum(np.bincount(self.parts) - 1, 1))
        return np.where((out < 0.0) & (mean > -error), 0.0, out)

    def _mean(self, values: Array) -> Array:
        return np.bincount(self.parts, weights=values) / np.bincount(self.parts)


def _neighbours(view: Unseen) -> NDArray[np.intp]:
    """Return the part of every sample; of eight, two neighbours together tell more steadily."""
    names, parts = np.unique(view.trusted_labels(), return_inverse=True)
    return np.asarray(parts // 2 if names.size >= STRETCHES else parts, dtype=np.intp)


def _chosen(case: _Case, members: Members, worth: float) -> tuple[str, ...]:
    """Return the kinds that unseen data need together, added one by one, and held to it."""
    chosen: list[str] = []
    while len(chosen) < len(members):
        best = _next(case, members, chosen, worth)
        if best is None:
            break
        chosen.append(best)
    while chosen:
        grows = [
            float(np.median(case.growth(_all(members, chosen), _all(members, chosen, name))))
            for name in chosen
        ]
        if min(grows) >= worth:
            break
        del chosen[int(np.argmin(grows))]
    return tuple(chosen)


def _next(case: _Case, members: Members, chosen: Sequence[str], worth: float) -> str | None:
    """
    Return the kind that takes most off unseen data beside those chosen; None where none takes enough.

    What makes no part worse comes first: it is no whim of a few stations. Free curves take the place
    of many kinds; they are chosen where no kind does nearly as much.
    """
    now = _all(members, chosen)
    order = []
    for name in members:
        if name not in chosen:
            fall = case.growth([*now, *members[name]], now)
            median = float(np.median(fall))
            if median >= worth:
                order.append((bool(fall.min() >= 0.0), median, name))
    if not order:
        return None
    first = max(order)[2]
    causes = [item for item in order if case.named(members[item[2]])]
    if causes and not case.named(members[first]):
        other = max(causes)[2]
        loss = case.growth([*now, *members[first]], [*now, *members[other]])
        return other if float(np.median(loss)) < worth else first
    return first


def _all(members: Members, names: Iterable[str], without: str | None = None) -> list[int]:
    """Return the effects of some kinds."""
    return [k for name in names if name != without for k in members[name]]


def _weighed(
    case: _Case,
    members: Members,
    chosen: Sequence[str],
    name: str,
    sizes: tuple[tuple[Site, float], ...],
    worth: float,
) -> Family:
    """Return one kind with all that is told of it."""
    others = _all(members, chosen, name)
    own = list(members[name])
    growths = tuple(case.growth([*others, *own], others).tolist())
    before, after = (float((case.left(kept) ** 2).mean()) for kept in (others, [*others, *own]))
    fall = max(before - after, 0.0)
    out = Family(name, growths, name in chosen, sizes, rms_m=float(np.sqrt(fall)))
    if name not in chosen:
        return out
    like = []
    for other in members:
        if other not in chosen and case.named(members[other]):
            loss = case.growth([*others, *own], [*others, *members[other]])
            part = 1.0 - max(float(np.median(loss)), 0.0) / worth
            if part > 0.0:
                like.append((part, other))
    like = sorted(like, key=lambda item: -item[0])[:MOST_LIKE]
    reported = tuple((_largest(case, others, members[other]), part) for part, other in like)
    return replace(out, needed=_needed(case, others, own), like=reported)


def _needed(
    case: _Case, others: Sequence[int], own: Sequence[int]
) -> tuple[tuple[Site, float], ...]:
    """Return the members of a kind that are missed, each with its share, largest first."""
    if len(own) == 1:
        return ((case.sites[own[0]], 1.0),)
    every = [*others, *own]
    missed = np.array(
        [np.median(case.growth(every, [k for k in every if k != one])) for one in own]
    )
    missed = np.maximum(missed, 0.0)
    if missed.sum() <= 0.0:
        # Each takes the place of another: the one that does most by itself stands for them.
        return ((_largest(case, others, own), 1.0),)
    shares = missed / missed.sum()
    ordered = np.argsort(-shares, kind='stable')
    return tuple((case.sites[own[k]], float(shares[k])) for k in ordered if shares[k] > 0.0)


def _largest(case: _Case, others: Sequence[int], own: Sequence[int]) -> Site:
    """Return the member of a kind that does most by itself."""
    remaining = [float(np.median(case.left([*others, k]))) for k in own]
    return case.sites[own[int(np.argmin(remaining))]]
