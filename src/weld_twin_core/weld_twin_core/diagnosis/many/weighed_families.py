# Copyright 2026 weld_twin contributors
# SPDX-License-Identifier: Apache-2.0
"""
Which kinds of error unseen data need, of all kinds fitted together, and on which joints.

All kinds at once predict well, and hardly one of them is missed: the others take its place. So
kinds are added one after the other, each as large as machines have it, and the one that leaves
least on unseen data first, until no other takes a tenth off. Kinds that resemble each other may show
only together, as wrong lengths and twists do: where none takes enough off by itself, two may. A kind
that not every arm has is one of them only where unseen data get worse without it beside all that every
arm has. Each is then taken out of what was chosen, with all others and the frames fitted anew: a kind
is needed where unseen data get worse. What may do as well in its place is reported beside it: of few
stations the parts differ, and a kind is told from another only where they agree.

Of kinds that are each likelier wrong than right, as they take each other's place, one of them may be
right beyond much doubt: two or three of them are one set, if unseen data bear that out.
"""

from __future__ import annotations

from collections.abc import Callable, Iterable, Sequence
from dataclasses import dataclass, field, replace
from functools import cached_property
from itertools import combinations
from operator import itemgetter

import numpy as np
from numpy.typing import NDArray
from scipy.special import stdtr

from ...arm.robot import Robot
from ...arrays import Array
from ...effects.effect import Effect
from ..algebra.motions import same_error
from ..beliefs import Beliefs
from ..evidence import LIKELIER, Search
from ..negligible import EMPTY, NANOMETRE
from ..result import Family, Site
from ..unseen.folds import growth, means, parts_of
from ..unseen.unseen_stretches import Unseen
from .small_errors import believed

MOST_LIKE = 2
"""Kinds reported beside one at the most; what more than three would explain is no name."""
JOINED = (2, 1 + MOST_LIKE)
"""Kinds that are put together to one set."""
Believed = Callable[[Family, int], float]
"""How probable it is that a kind is right, where so many are named."""


@dataclass(frozen=True, eq=False)
class Weighed:
    """Kinds of error, and what models of some of them leave on unseen data."""

    families: tuple[Family, ...]
    case: _Case

    def joined(self, verdict: Sequence[Family], believed: Believed) -> tuple[Family, ...]:
        """
        Return the kinds with those put together that are likelier right than wrong as a set alone.

        verdict: the kinds as a verdict has them that puts none together.
        """
        named = [one for one in verdict if one.named and one.needed]
        told = [one for one in named if believed(one, len(named)) > LIKELIER]
        chosen = [one for one in verdict if one.chosen and self.case.named(one.effect)]
        doubted = [one for one in chosen if one.effect not in {own.effect for own in told}]
        while (best := self._set(doubted, chosen, told, believed)) is not None:
            told.append(best)
            doubted = [one for one in doubted if one.effect not in {best.effect, *best.joined}]
        sets = {one.effect: one for one in told if one.joined}
        gone = {name for one in sets.values() for name in one.joined}
        return tuple(
            replace(one, chosen=False, share=0.0)
            if one.effect in gone
            else sets.get(one.effect, one)
            for one in self.families
        )

    def _set(
        self,
        doubted: Sequence[Family],
        chosen: Sequence[Family],
        told: Sequence[Family],
        believed: Believed,
    ) -> Family | None:
        """Return the fewest of the kinds doubted that are likelier right than wrong together."""
        kinds = sum(one.kinds for one in told)
        for size in JOINED:
            sets = [self.case.together(group, chosen) for group in combinations(doubted, size)]
            each = [
                (believed(one, kinds + size), one) for one in sets if one.missed(self.case.worth)
            ]
            probability, best = max(each, key=itemgetter(0), default=(0.0, None))
            if probability > LIKELIER:
                return best
        return None


def weighed_families(result: Search, unseen: Unseen, beliefs: Beliefs) -> Weighed:
    """
    Return what every kind of the final model accounts for on unseen data.

    result: of all kinds fitted together.
    """
    case, out = _Case.of(result, unseen, beliefs.family_worth), list[Family]()
    chosen = case.chosen()
    for name, index in case.members.items():
        if case.named(name):
            sizes = [(case.sites[k], unseen.rms(unseen.targets[1 + k])) for k in index]
            sizes.sort(key=lambda item: -item[1])
            out.append(case.weighed(name, chosen, tuple(sizes)))
    # Their shares are of what those chosen take off together.
    bare, remaining = (case.mean_square(kept) for kept in ((), case.of_kinds(chosen)))
    explained = max(1.0 - remaining / max(bare, NANOMETRE**2), 0.0)
    whole = max(sum(one.rms_m**2 for one in out if one.chosen), NANOMETRE**2)
    shared = (
        replace(one, share=explained * one.rms_m**2 / whole) if one.chosen else one for one in out
    )
    return Weighed(tuple(shared), case)


@dataclass(frozen=True, eq=False)
class _Case:
    """
    What models of some effects leave on what they were not fitted to, each as large as machines have it.

    Every view leaves out other parts: stretches of time, and regions of posture. ``parts`` is the part
    of every sample, those of all views one after the other.
    """

    robot: Robot
    align: frozenset[str]
    effects: tuple[Effect, ...]
    views: tuple[Unseen, ...]
    parts: NDArray[np.intp]
    worth: float
    """Share by which unseen data get worse without a kind that is needed."""
    _known: dict[tuple[int, ...], Array] = field(default_factory=dict)

    @classmethod
    def of(cls, result: Search, unseen: Unseen, worth: float) -> _Case:
        """Return the case of all kinds fitted together."""
        model = result.final.model
        usual = believed(model)
        usual = np.where(usual > 0.0, usual, result.precision)
        views = unseen.held(usual, result.final.coordinates).every_way()
        parts = parts_of([view.trusted_labels() for view in views])
        where = model.robot, result.problem.align
        return cls(*where, model.found, tuple(views), parts, worth)

    @cached_property
    def sites(self) -> list[Site]:
        """Return family and joint of every effect."""
        return [Site.of(effect) for effect in self.effects]

    @cached_property
    def members(self) -> dict[str, list[int]]:
        """Return the effects of every kind; others, as motions of the set-up, are in every model."""
        out: dict[str, list[int]] = {}
        for k, effect in enumerate(self.effects):
            if effect.traits.cause or effect.traits.bends:
                out.setdefault(effect.name, []).append(k)
        return out

    def of_kinds(self, names: Iterable[str], but: str | None = None) -> list[int]:
        """Return the effects of some kinds."""
        return [k for name in names if name != but for k in self.members[name]]

    def named(self, name: str) -> bool:
        """Return whether a kind may be named as a cause."""
        return self.effects[self.members[name][0]].traits.cause

    def squares(self, kept: Iterable[int]) -> Array:
        """Return the squared error of every sample, with some effects in the model, [m^2]."""
        always = set(range(len(self.effects))).difference(*self.members.values())
        index = tuple(sorted({*kept, *always}))
        if index not in self._known:
            each = [view.squares(view.predict(index)) for view in self.views]
            self._known[index] = np.concatenate(each)
        return self._known[index]

    def left(self, kept: Iterable[int]) -> Array:
        """Return the RMS error [m] of every part, shape (parts,)."""
        return np.sqrt(means(self.squares(kept), self.parts))

    def mean_square(self, kept: Iterable[int]) -> float:
        """Return the mean squared error of a part [m^2]."""
        return float((self.left(kept) ** 2).mean())

    def growth(self, kept: Iterable[int], less: Iterable[int]) -> Array:
        """Return by what share the error of every part grows to a lesser model, chance aside."""
        return growth(self.squares(kept), self.squares(less), self.parts)

    def _loss(self, kept: Iterable[int], less: Iterable[int]) -> float:
        """Return by what share the error grows in the median part."""
        return float(np.median(self.growth(kept, less)))

    def chosen(self) -> list[str]:
        """Return the kinds that unseen data need together, as long as more of them leave less."""
        open_to = [name for name in self.members if self._in_every_arm(name) or self._beyond(name)]
        out = self._needed_of((), open_to)
        while two := self._next_two(out, open_to):
            more = self._needed_of((*out, *two), open_to)
            if self.mean_square(self.of_kinds(more)) >= self.mean_square(self.of_kinds(out)):
                break
            out = more
        return out

    def _needed_of(self, first: Iterable[str], open_to: Sequence[str]) -> list[str]:
        """Return some kinds with those added that take enough off, one by one, and held to it."""
        out = list(first)
        while (best := self._next(out, open_to)) is not None:
            out.append(best)
        while out:
            every = self.of_kinds(out)
            losses = [self._loss(every, self.of_kinds(out, but=name)) for name in out]
            if min(losses) >= self.worth:
                break
            del out[int(np.argmin(losses))]
        return out

    def _in_every_arm(self, name: str) -> bool:
        return self.effects[self.members[name][0]].traits.common

    def _beyond(self, name: str) -> bool:
        """Return whether unseen data need a kind beside all that every arm has."""
        usual = self.of_kinds(other for other in self.members if self._in_every_arm(other))
        return self._loss([*usual, *self.members[name]], usual) >= self.worth

    def _next(self, chosen: Sequence[str], open_to: Sequence[str]) -> str | None:
        """
        Return the kind that takes most off unseen data beside those chosen, if one takes enough.

        What makes no part worse comes first: it is no whim of a few stations. Free curves take the place
        of many kinds; they are chosen where no kind does nearly as much.
        """
        now, order = self.of_kinds(chosen), []
        for name in open_to:
            if name not in chosen:
                fall = self.growth([*now, *self.members[name]], now)
                median = float(np.median(fall))
                if median >= self.worth:
                    order.append((bool(fall.min() >= 0.0), median, name))
        if not order:
            return None
        first = max(order)[2]
        causes = [item for item in order if self.named(item[2])]
        if causes and not self.named(first):
            other = max(causes)[2]
            with_first, with_other = ([*now, *self.members[name]] for name in (first, other))
            return other if self._loss(with_first, with_other) < self.worth else first
        return first

    def _next_two(self, chosen: Sequence[str], open_to: Sequence[str]) -> tuple[str, ...]:
        """
        Return the two kinds that take most off together, if they take enough and each needs the other.

        Both have to do some good by themselves: of all pairs some do by chance.
        """
        now, order = self.of_kinds(chosen), []
        others = [name for name in open_to if name not in chosen and self.named(name)]
        some = [name for name in others if self._loss([*now, *self.members[name]], now) > 0.0]
        for pair in combinations(some, 2):
            both = [*now, *self.of_kinds(pair)]
            fall = self.growth(both, now)
            without = [self._loss(both, [*now, *self.members[name]]) for name in pair]
            if min(float(np.median(fall)), *without) >= self.worth:
                order.append((bool(fall.min() >= 0.0), float(np.median(fall)), pair))
        return max(order)[2] if order else ()

    def weighed(
        self, name: str, chosen: Sequence[str], sizes: tuple[tuple[Site, float], ...]
    ) -> Family:
        """Return one kind with all that is reported of it."""
        others, own = self.of_kinds(chosen, but=name), self.members[name]
        every = [*others, *own]
        growths = tuple(self.growth(every, others).tolist())
        fall = max(self.mean_square(others) - self.mean_square(every), 0.0)
        out = Family(name, growths, name in chosen, sizes, rms_m=float(np.sqrt(fall)))
        if name not in chosen:
            return out
        like = []
        for other, instead in self.members.items():
            if other not in chosen and self.named(other):
                part = self._does_as_well([*others, *instead], every)
                # What not every arm has is told only where it is likelier than not.
                if self._in_every_arm(other) or part > LIKELIER:
                    like.append((part, instead))
        like = sorted(like, key=lambda item: -item[0])[:MOST_LIKE]
        reported = tuple((self._largest(others, instead), part) for part, instead in like)
        needed, alike = self._needed(others, own)
        return replace(out, needed=needed, alike=alike, like=reported)

    def _does_as_well(self, other: Iterable[int], kept: Iterable[int]) -> float:
        """
        Return how probable it is that a model leaves no more than another by what a kind is worth.

        By how far the parts left out agree on it.
        """
        loss = self.growth(kept, other)
        error = float(loss.std(ddof=1)) / np.sqrt(loss.size) if loss.size > 1 else np.inf
        room = self.worth - max(float(np.median(loss)), 0.0)
        return float(stdtr(max(loss.size - 1, 1), room / max(error, EMPTY)))

    def together(self, group: Sequence[Family], chosen: Sequence[Family]) -> Family:
        """Return some kinds as one set: what they account for together, and the largest before all."""
        first, *more = sorted(group, key=lambda one: -one.rms_m)
        out = {one.effect for one in group}
        every = self.of_kinds(one.effect for one in chosen)
        others = self.of_kinds(one.effect for one in chosen if one.effect not in out)
        fall = max(self.mean_square(others) - self.mean_square(every), 0.0)
        like = [member for one in more for member in one.needed]
        room = 1 + MOST_LIKE - len(group)
        like += [item for item in first.like if item[0].effect not in out][:room]
        return replace(
            first,
            growths=tuple(self.growth(every, others).tolist()),
            rms_m=float(np.sqrt(fall)),
            like=tuple(like),
            share=sum(one.share for one in group),
            joined=tuple(one.effect for one in more),
        )

    def _needed(
        self, others: Sequence[int], own: Sequence[int]
    ) -> tuple[tuple[tuple[Site, float], ...], tuple[tuple[Site, ...], ...]]:
        """
        Return the members of a kind that are missed, each with its share, largest first.

        Those that are one error are missed together; they are returned beside them.
        """
        if len(own) == 1:
            return ((self.sites[own[0]], 1.0),), ()
        every = [*others, *own]
        groups = self._alike(own)
        missed = np.array([self._loss(every, [k for k in every if k not in g]) for g in groups])
        missed = np.maximum(missed, 0.0)
        if missed.sum() <= 0.0:
            # Each takes the place of another: the one that does most by itself stands for them.
            return ((self._largest(others, own), 1.0),), ()
        shares = missed / missed.sum()
        ordered = [int(g) for g in np.argsort(-shares, kind='stable') if shares[g] > 0.0]
        needed = [
            (self.sites[k], float(shares[g]) / len(groups[g])) for g in ordered for k in groups[g]
        ]
        alike = [tuple(self.sites[k] for k in groups[g]) for g in ordered if len(groups[g]) > 1]
        return tuple(needed), tuple(alike)

    def _alike(self, own: Sequence[int]) -> list[list[int]]:
        """Return members of a kind in groups of those that are one and the same error everywhere."""
        out: dict[int, list[int]] = {}
        for k in own:
            first = next((one for one in out if self._same(one, k)), k)
            out.setdefault(first, []).append(k)
        return list(out.values())

    def _same(self, one: int, other: int) -> bool:
        first, second = self.effects[one], self.effects[other]
        if first.traits.depends_on != 'constant':
            return False
        return same_error(self.robot, first, second, self.align, both=True)

    def _largest(self, others: Sequence[int], own: Sequence[int]) -> Site:
        """Return the member of a kind that does most by itself."""
        remaining = [float(np.median(self.left([*others, k]))) for k in own]
        return self.sites[own[int(np.argmin(remaining))]]
