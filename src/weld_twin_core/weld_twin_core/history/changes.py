# Copyright 2026 weld_twin contributors
# SPDX-License-Identifier: Apache-2.0
"""
What changed between diagnoses: steps, trends and seasons of single coordinates.

An observation is what one diagnosis says of an arm, as numbers that can be added to those of the
next. All are one linear model: the arm as it was at first, plus a few shapes in time, each on one
coordinate. The shape that explains most is taken in, as long as it explains more than chance would
in all the shapes that were tried; then the next is looked for beside it. Coordinates that the
recordings tell apart badly explain a change equally well, so they come as a set. This is the
generalised likelihood ratio test of a change point [1]_ with nuisance parameters.

What no coordinate explains, such as a little play, is part of what a diagnosis counts as noise. It
comes back at the same postures, and is another at others. So diagnoses of the same postures share an
error of their own; how large it is shows in how much less they scatter than they say.

References
----------
.. [1] M. Basseville, I. V. Nikiforov, "Detection of Abrupt Changes", Prentice Hall 1993, section 2.4.

"""

from __future__ import annotations

from collections.abc import Collection, Iterator, Sequence
from dataclasses import dataclass, replace
from functools import cached_property
from itertools import groupby, pairwise
from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray
from scipy.special import chdtri

from ..arrays import Array, readonly
from ..errors import DataError

_SHOWN = 1e-6
"""Share of the variance before the data that counts as taken away by them: less is a file's rounding."""
_SAME = 0.1
"""Mean distance of logarithms of what two diagnoses show of each coordinate, their noise apart, up to
which they are of the same postures. Of 16 to 25 stations other ones differ by 0.15 or more, the same
without one by up to 0.1."""
_REPEATED = 0.95
"""Most of the noise that comes back at the same postures: some is new each time."""
_MEDIAN = float(np.sqrt(0.5 * np.pi))
"""By how much the standard error of a median is that of a mean."""
_ABSENT = 3.0
"""Standard errors of the diagnoses that name an effect, within which it is taken to be zero in those
that do not name it: it would have been named beyond."""


@dataclass(frozen=True, eq=False)
class Observation:
    """One diagnosis: values of coordinates, and how sure they are; DataError where they do not agree."""

    day: float
    """When it was recorded [days]; the zero is the same for all."""
    names: tuple[str, ...]
    """Of the coordinates, such as 'joint_offset elbow_joint 0'; unique."""
    value: Array
    """SI units, counted from the model that was given, shape (P,)."""
    covariance: Array
    """Shape (P, P)."""
    prior_std: Array
    """What was believed of each before the data, about zero, shape (P,)."""
    steady: frozenset[str] = frozenset()
    """
    Those that stay as they are, such as the unevenness of gears; no change of them is looked for.
    That they are the same in all diagnoses is what makes these comparable: left open in each, a
    curve of a gear takes the place of a zero that was moved.
    """

    def __post_init__(self) -> None:
        count = len(self.names)
        if len(set(self.names)) != count:
            raise DataError('a coordinate comes twice in one diagnosis')
        for name, shape in (
            ('value', (count,)),
            ('covariance', (count,) * 2),
            ('prior_std', (count,)),
        ):
            object.__setattr__(self, name, readonly(getattr(self, name), shape, name))

    def information(self) -> tuple[Array, Array]:
        """Return the data's precision (P, P), and that times value (P,), without the prior."""
        return self._information

    @cached_property
    def _information(self) -> tuple[Array, Array]:
        variance, axes, shown = self._shown
        width = self.prior_std
        # value = variance * (precision of the data) * (what the data say), along each axis
        along = axes.T @ (self.value / width)
        values = np.where(shown > 0.0, along / variance, 0.0)
        precision = (axes * shown) @ axes.T / np.outer(width, width)
        return precision, (axes @ values) / width

    @cached_property
    def _shown(self) -> tuple[Array, Array, Array]:
        """Variances at unit prior, (P,), their axes in columns, and the precision of the data, (P,)."""
        width = self.prior_std
        # At unit prior the posterior variance along a direction is 1 less what the data showed.
        scaled = self.covariance / np.outer(width, width)
        variance, axes = np.linalg.eigh(0.5 * (scaled + scaled.T))
        variance = np.clip(variance, 1e-300, 1.0)
        return variance, axes, np.where(variance < 1.0 - _SHOWN, 1.0 / variance - 1.0, 0.0)

    @cached_property
    def whitening(self) -> Array:
        """Return independent directions (P, L) that data show beyond the prior, precision 1."""
        _, axes, shown = self._shown
        live = shown > 1.0
        return np.asarray(axes[:, live] / np.sqrt(shown[live]) * self.prior_std[:, None])

    def same_postures(self, other: Observation) -> bool:
        """Tell whether both are of the same postures: they show the same, up to their noise."""
        own, others = _shared(self.names, other.names)
        shown = np.diag(self.information()[0])[own] * self.prior_std[own] ** 2
        again = np.diag(other.information()[0])[others] * self.prior_std[own] ** 2
        both = (shown > 1.0) & (again > 1.0)
        if not both.any():
            return False
        again = again / np.median(again[both] / shown[both])
        seen = (shown > 1.0) | (again > 1.0)
        apart = np.log1p(again[seen]) - np.log1p(shown[seen])
        return bool(np.mean(np.abs(apart)) < _SAME)

    def scatter(self, other: Observation) -> float:
        """Return by how much two of the same postures differ, as a share of what both say they do."""
        sides = list(zip((self, other), _shared(self.names, other.names), strict=True))
        sums = [(e.information()[0][np.ix_(at, at)], e.information()[1][at]) for e, at in sides]
        prior = np.diag(self.prior_std[sides[0][1]] ** -2.0)
        both = np.linalg.solve(prior + sums[0][0] + sums[1][0], sums[0][1] + sums[1][1])
        apart = 0.0
        for (each, at), (precision, told) in zip(sides, sums, strict=True):
            apart += float(np.sum((each.whitening[at].T @ (told - precision @ both)) ** 2))
        return apart / max(int(self.whitening.shape[1]), 1)


_Places = NDArray[np.int_] | slice


def _shared(names: Sequence[str], others: Sequence[str]) -> tuple[list[int], list[int]]:
    """Return the places of the names that both have, in the first and in the second."""
    place = {name: k for k, name in enumerate(others)}
    own = [k for k, name in enumerate(names) if name in place]
    return own, [place[names[k]] for k in own]


def _flat(rows: Array) -> Array:
    """Return (K, m, R, L) as (K, m R, L)."""
    return rows.reshape(len(rows), -1, rows.shape[-1])


class _Batch(NamedTuple):
    """Shapes of as many columns, and what the observations say of them, whatever was found."""

    columns: Array
    """Shape (W, K, m)."""
    cross: Array
    """Precision with what does not change, shape (K, P, m, C)."""
    own: Array
    """Precision, shape (K, m, C, m, C)."""
    told: Array
    """Precision times value, shape (K, m, C)."""


class _Repeated(NamedTuple):
    """Observations of the same postures, whose common error was taken out of their sum."""

    members: list[int]
    pull: Array
    """What it takes of the precision of each, as a root, shape (members, P, L)."""
    told: Array
    """What it takes of precision times value, in the same directions, shape (L,)."""


@dataclass(frozen=True, eq=False)
class _Series:
    """Observations over the same coordinates, in the order of time."""

    days: Array
    """Shape (W,)."""
    names: tuple[str, ...]
    precision: Array
    """Shape (W, P, P)."""
    weighted: Array
    """Precision times value, shape (W, P)."""
    prior: Array
    """Precision of what was believed before any of them, shape (P,)."""
    things: tuple[NDArray[np.int_], ...]
    """Places of the coordinates that may change together: of each alone, or all of one effect."""
    whitening: tuple[tuple[NDArray[np.int_], Array], ...]
    """Of every observation, the places of its coordinates and its `Observation.whitening`."""
    repeated: tuple[_Repeated, ...] = ()

    def crossed(self, x: Array, at: _Places, y: Array, places: _Places) -> Array:
        """
        Return the precision of shapes at some places with others', (K, m, R, n, C).

        x, y: columns of K shapes, or of one beside all, (W, K, m) and (W, K, n).
        """
        weights = x[..., None] * y[..., None, :]
        whole = np.tensordot(weights, self.precision[:, at][:, :, places], axes=(0, 0))
        whole = np.moveaxis(whole, 2, 3)
        for members, pull, _ in self.repeated:
            one = np.tensordot(x[members], pull[:, at], axes=(0, 0))
            other = np.tensordot(y[members], pull[:, places], axes=(0, 0))
            taken = _flat(one) @ np.swapaxes(_flat(other), 1, 2)
            whole = whole - taken.reshape(whole.shape)
        return np.asarray(whole)

    @cached_property
    def shapes(self) -> list[_Shape]:
        return _shapes(self.days)

    @cached_property
    def batches(self) -> list[_Batch]:
        """Return the sums over the observations of all shapes, by how many columns these have."""
        out, places = [], self.changing
        one, every = np.ones((self.days.size, 1, 1)), slice(None)
        for _, group in groupby(self.shapes, lambda shape: shape.columns.shape[1]):
            x = np.stack([shape.columns for shape in group], axis=1)
            cross = self.crossed(one, every, x, places)[:, 0]
            own = self.crossed(x, places, x, places)
            told = self.told(x.reshape(len(x), -1))[:, places].reshape(*x.shape[1:], -1)
            out.append(_Batch(x, cross, own, told))
        return out

    def called(self, thing: int) -> str:
        """Return the coordinate that changes, or all of one effect."""
        places = self.things[thing]
        name = self.names[places[0]]
        return name if places.size == 1 else _stem(name) + ALL

    @cached_property
    def changing(self) -> NDArray[np.int_]:
        """Return the places of all coordinates that may change, shape (C,)."""
        return np.unique(np.concatenate(self.things))

    @cached_property
    def families(self) -> list[NDArray[np.int_]]:
        """Return the things of each number of coordinates, by their places in `changing`, (U, s)."""
        of: dict[int, list[NDArray[np.int_]]] = {}
        for places in self.things:
            of.setdefault(places.size, []).append(np.searchsorted(self.changing, places))
        return [np.array(each, dtype=int) for each in of.values()]

    @cached_property
    def first(self) -> Array:
        """Return the precision of what does not change, (P, P)."""
        one, every = np.ones((self.days.size, 1, 1)), slice(None)
        return self.crossed(one, every, one, every)[0, 0, :, 0]

    @cached_property
    def shown(self) -> Array:
        """Return how many directions of each thing the observations show beyond the prior, (things,)."""
        counts = []
        for places in self.things:
            width = 1.0 / np.sqrt(self.prior[places])
            whole = self.first[np.ix_(places, places)] * np.outer(width, width)
            counts.append(max(int((np.linalg.eigvalsh(whole) > 1.0).sum()), 1))
        return np.array(counts)

    def told(self, x: Array) -> Array:
        """Return precision times value of a shape on every coordinate, shape (m, P)."""
        out = x.T @ self.weighted
        for members, pull, told in self.repeated:
            out -= np.tensordot(x[members], pull, axes=(0, 0)) @ told
        return np.asarray(out)


def series_of(observations: Sequence[Observation]) -> _Series:
    """
    Return observations over all their coordinates.

    An effect that only some diagnoses name is taken to be zero in the others, as surely as three
    standard errors of those that name it. Of what is steady, one that lacks it says nothing. What
    comes back at the same postures is an error that their diagnoses share.

    Raises DataError: there are none, or two are of the same instant.
    """
    if not observations:
        raise DataError('there is no diagnosis yet; add some first')
    ordered = sorted(observations, key=lambda each: each.day)
    days = np.array([each.day for each in ordered])
    if (np.diff(days) <= 0.0).any():
        raise DataError('two diagnoses are of the same instant; give each its own date')
    names = tuple(dict.fromkeys(name for each in ordered for name in each.names))
    place = {name: k for k, name in enumerate(names)}
    width = np.zeros(len(names))
    error: list[list[float]] = [[] for _ in names]
    precision = np.zeros((days.size, len(names), len(names)))
    products = np.zeros((days.size, len(names)))
    whitening = []
    for w, each in enumerate(ordered):
        at = np.array([place[name] for name in each.names], int)
        precision[w][np.ix_(at, at)], products[w, at] = each.information()
        whitening.append((at, each.whitening))
        width[at] = np.maximum(width[at], each.prior_std)
        for k, std in zip(at, np.sqrt(np.diag(each.covariance)), strict=True):
            error[k].append(float(std))
    steady = frozenset().union(*(each.steady for each in ordered))
    for k in [k for k, name in enumerate(names) if name not in steady]:
        for w, each in enumerate(ordered):
            if names[k] not in each.names:
                precision[w, k, k] += 1.0 / (_ABSENT * float(np.median(error[k]))) ** 2
    series = _Series(
        days, names, precision, products, 1.0 / width**2, _things(names, steady), tuple(whitening)
    )
    return _with_repeated(series, ordered)


ALL = ' *'
"""Ends the name of an effect whose coordinates change together."""


def _stem(name: str) -> str:
    """Return what a coordinate is a number of: 'tool', 'tool_pose', 'joint_offset elbow_joint'."""
    return name.replace('.', ' ').rpartition(' ')[0]


def _things(names: Sequence[str], steady: Collection[str]) -> tuple[NDArray[np.int_], ...]:
    """
    Return what may change: each coordinate that is not steady, and all of one effect, such as a frame.

    What stands before the last word of a coordinate's name is what it is a coordinate of. Things of
    as many coordinates stand together.
    """
    of: dict[str, list[int]] = {}
    for k, name in enumerate(names):
        if name not in steady:
            of.setdefault(_stem(name), []).append(k)
    alone = [[k] for k, name in enumerate(names) if name not in steady]
    several = sorted((each for each in of.values() if len(each) > 1), key=len)
    return tuple(np.array(places) for places in alone + several)


def _share_repeated(ordered: Sequence[Observation], groups: Sequence[Sequence[int]]) -> float:
    """Return the share of the noise that comes back in groups of the same postures; 0 if unknown."""
    pairs = [(ordered[a], ordered[b]) for group in groups for a, b in pairwise(group)]
    if not pairs:
        return 0.0
    scatter = float(np.median([one.scatter(other) for one, other in pairs]))
    # Taken as large as it may be: the error of a median of means over as many directions.
    directions = float(np.median([one.whitening.shape[1] for one, _ in pairs]))
    unsure = _MEDIAN * np.sqrt(2.0 / (max(directions, 1.0) * len(pairs)))
    return float(np.clip(1.0 - scatter * (1.0 + unsure), 0.0, _REPEATED))


def _with_repeated(series: _Series, ordered: Sequence[Observation]) -> _Series:
    """Return a series whose diagnoses of the same postures share what is no noise of the instrument."""
    groups: list[list[int]] = []
    for w, each in enumerate(ordered):
        same = next((group for group in groups if ordered[group[0]].same_postures(each)), None)
        if same is None:
            groups.append([w])
        else:
            same.append(w)
    share = _share_repeated(ordered, groups)
    if share == 0.0:
        return series
    precision, weighted = series.precision.copy(), series.weighted.copy()
    repeated, whitening = [], list(series.whitening)
    for members in (group for group in groups if len(group) > 1):
        at, axes = series.whitening[members[0]]
        seen = np.einsum('wpq,ql->wpl', precision[members][:, :, at], axes)
        own = np.einsum('pl,wpm->lm', axes, seen[:, at])
        # The common error is one more coordinate of these alone, solved for beforehand.
        root = np.linalg.cholesky(np.linalg.inv(own + (1.0 / share - 1.0) * np.eye(len(own))))
        pull = seen @ root / np.sqrt(1.0 - share)
        told = root.T @ (axes.T @ weighted[members][:, at].sum(axis=0)) / np.sqrt(1.0 - share)
        repeated.append(_Repeated(members, pull, told))
        for w in members:
            precision[w] /= 1.0 - share
            weighted[w] /= 1.0 - share
            whitening[w] = whitening[w][0], (1.0 - share) * whitening[w][1]
    return replace(
        series,
        precision=precision,
        weighted=weighted,
        whitening=tuple(whitening),
        repeated=tuple(repeated),
    )


_YEAR = 365.25
"""Days of a season."""
_MOST = 8
"""Changes looked for; an arm with more of them was rebuilt."""
_ALIKE = 6.0
"""Sum of squares by which another coordinate may explain less and still be reported as alike:
a log Bayes factor of three, twenty to one."""
_DATED = 3.84
"""Fall within which another instant is as likely: 95 % of chi-square with one degree of freedom."""
_SEASON_SPAN = 0.5
"""Share of a year from which on a season is looked for: less than half a wave is a trend."""
_NAMED = 3.0
"""Log Bayes factor by which a coordinate that a diagnosis has named goes before others: 20 to 1."""
_LIKELY = 3.0
"""Log Bayes factor by which a coordinate that use can change goes before others: twenty to one."""
_FRESH = 6.0
"""By how much more a step before the last diagnosis has to explain: its noise is new in every look, that
of earlier steps was looked at before. A large step is reported at once all the same."""
_ALARMS = 12.0 / 52.0
"""
False alarms allowed in one look, were all that is tried independent. It is not: steps a week apart
are nearly one, and next week's look sees the same diagnoses again.
"""
_TRIED = 2 * 52
"""Shapes that a year of weekly diagnoses has at the end. Each of its looks is a new chance for a false
alarm, so the first ones, which try few shapes, are held to as much as the last."""


class _Shape(NamedTuple):
    """A kind of change, its instant (the first diagnosis after it) and its columns (W, m)."""

    kind: str
    begin: int
    columns: Array


class Moved(NamedTuple):
    """How far one coordinate moved, as `Change.size` and `Change.std` have it."""

    name: str
    size: float
    std: float


@dataclass(frozen=True)
class Change:
    """A change of one coordinate, or of those of one effect together, such as a frame."""

    name: str
    """The coordinate; of several, the one that is surest to have moved."""
    kind: str
    """'step', 'trend' or 'season'."""
    day: float
    """Of the first diagnosis that shows a step; where a trend begins."""
    between: tuple[float, float]
    """Earliest and latest day that explain it as well (95 %); of a step, the last day before."""
    size: float
    std: float
    """Height of a step, rise of a trend in a day, half the swing of a season; SI units."""
    log_bayes: float
    """By how much it is more likely than no change."""
    alike: tuple[str, ...] = ()
    """Other coordinates whose change would explain the same; of all of a frame, 'tool_pose *'."""
    since: float | None = None
    """Of a step: earliest day from which a trend explains it as well; None where none does."""
    faster: bool = False
    """Of a trend: whether it comes on top of an earlier one of the same coordinate."""
    together: tuple[Moved, ...] = ()
    """Of an effect of several: all its coordinates, each as far as it moved; empty for one alone."""


class _Term(NamedTuple):
    """A shape that was taken in, and the coordinates that it is on."""

    shape: _Shape
    places: NDArray[np.int_]

    @property
    def width(self) -> int:
        """Numbers that it has: of every column on every coordinate."""
        return int(self.shape.columns.shape[1] * self.places.size)


def changes(
    observations: Sequence[Observation],
    *,
    named: Collection[str] = (),
    likely: Collection[str] = (),
    alarms: float = _ALARMS,
) -> tuple[Change, ...]:
    """
    Return what changed, the surest first, with a number of false alarms allowed in this look.

    Raises DataError: there is no observation, or two are of the same instant.

    named: coordinates that a diagnosis has named as causes: of those that explain a change equally
    well, they come first. likely: those that knocks, wear, service or warmth can change, before
    others.
    """
    series = series_of(observations)
    if series.days.size < 2:
        return ()
    shapes = series.shapes
    tests = max(len(shapes), _TRIED) * len(series.things)
    sooner = np.array(
        [
            _NAMED * any(series.names[k] in named for k in places)
            + _LIKELY * any(series.names[k] in likely for k in places)
            for places in series.things
        ]
    )
    # The last few diagnoses hardly tell a step from a trend; a step is the simpler.
    simple = np.array(
        [
            chdtri(shape.columns.shape[1] * series.shown, alarms / tests)
            + _ALIKE * (shape.kind == 'trend')
            + _FRESH * (shape.kind == 'step' and shape.begin == series.days.size - 1)
            for shape in shapes
        ]
    )
    # What use cannot change has to explain more, if it is known what use can.
    rare = bool(likely) * (sooner == 0.0)
    look = _Look(series, shapes, simple + 2.0 * _LIKELY * rare, sooner)
    taken: list[tuple[_Term, Change]] = []
    while len(taken) < _MOST:
        more = look.next([result for result, _ in taken])
        if more is None:
            break
        taken.append(more)
    return _on_top([change for _, change in look.settled(taken)])


def _on_top(result: Sequence[Change]) -> tuple[Change, ...]:
    """Return changes with each trend known for what it is beside an earlier one of its coordinate."""
    begun = [(each.name, each.day) for each in result if each.kind == 'trend']
    earlier = (any(n == one.name and day < one.day for n, day in begun) for one in result)
    pairs = zip(result, earlier, strict=True)
    return tuple(replace(one, faster=one.kind == 'trend' and more) for one, more in pairs)


class _Look(NamedTuple):
    """What is tried in one look, and how much each has to explain."""

    series: _Series
    shapes: list[_Shape]
    bar: Array
    """Shape (shapes, things)."""
    sooner: Array
    """Log prior odds of a thing before others that explain as much, shape (things,)."""

    def next(self, result: Sequence[_Term]) -> tuple[_Term, Change] | None:
        """Return what explains most beside what was found, None if it is no more than chance."""
        system = _System(self.series, result)
        gain = system.gains()
        row, column = np.unravel_index(int(np.argmax(gain - self.bar)), gain.shape)
        best = int(row), int(column)
        # Beside the change: without it, the change itself would count as scatter.
        beside = _Term(self.shapes[best[0]], self.series.things[best[1]])
        scatter = _System(self.series, [*result, beside]).scatter
        gain /= scatter
        if gain[best] <= self.bar[best]:
            return None
        return self._described(system, gain, best, scatter)

    def _described(
        self, system: _System, gain: Array, best: tuple[int, int], scatter: float
    ) -> tuple[_Term, Change]:
        """Return the simplest change that explains as much as the best, and what else would."""
        shapes, series = self.shapes, self.series
        kind, top = shapes[best[0]].kind, gain[best]
        same = [k for k, each in enumerate(shapes) if each.kind == kind]
        most = gain[same].max(axis=0)
        alike = np.flatnonzero(most > top - _ALIKE)
        at = {int(j): same[int(np.argmax(gain[same][:, j]))] for j in alike}
        odds = {j: system.odds(k, j, scatter) + float(self.sooner[j]) for j, k in at.items()}
        thing = max(odds, key=lambda j: odds[j])
        shape = shapes[at[thing]]
        near = [shapes[k].begin for k in same if gain[k, thing] > most[thing] - _DATED]
        ranked = sorted(odds, key=lambda j: -odds[j])
        close = [j for j in ranked if odds[j] > odds[thing] - 0.5 * _ALIKE]
        # A frame is no other answer than its own coordinates.
        others = [j for j in close if not np.isin(series.things[j], series.things[thing]).any()]
        # From where on a trend explains as much as a step.
        slow = [
            each.begin
            for each, explained in zip(shapes, gain[:, thing], strict=True)
            if kind == 'step' and each.kind == 'trend' and explained > top - _ALIKE
        ]
        first = max(min(near) - (kind == 'step'), 0)
        moved = system.moved(same, gain[same, thing], thing, scatter)
        lead = max(moved, key=lambda each: abs(each.size) / each.std)
        return _Term(shape, series.things[thing]), Change(
            lead.name,
            kind,
            float(series.days[shape.begin]),
            (float(series.days[first]), float(series.days[max(near)])),
            lead.size,
            lead.std,
            0.5 * float(most[thing]),
            tuple(series.called(k) for k in others),
            float(series.days[min(slow)]) if slow else None,
            together=moved if len(moved) > 1 else (),
        )

    def settled(self, taken: Sequence[tuple[_Term, Change]]) -> list[tuple[_Term, Change]]:
        """Return the changes that are more than chance, each looked for once more beside all others."""
        if len(taken) < 2:
            return list(taken)
        out: list[tuple[_Term, Change]] = []
        for k in range(len(taken)):
            again = self.next([result for result, _ in (*out, *taken[k + 1 :])])
            out += [again] if again else []
        return out


class Outlook(NamedTuple):
    """Where a coordinate is at the last diagnosis, and how fast it moves."""

    value: Array
    """Value [SI], and rise in a day, shape (2,)."""
    covariance: Array
    """Shape (2, 2)."""


def outlook(
    observations: Sequence[Observation], result: Sequence[Change], name: str
) -> Outlook | None:
    """Return where a coordinate is and how fast it moves, all fitted together; None without a trend."""
    if not any(each.name == name and each.kind == 'trend' for each in result):
        return None
    series = series_of(observations)
    shapes = {(each.kind, float(series.days[each.begin])): each for each in series.shapes}
    taken = [
        _Term(
            shapes[each.kind, each.day],
            np.array([series.names.index(m.name) for m in each.together or (each,)]),
        )
        for each in result
    ]
    return Outlook(*_System(series, taken).now(series.names.index(name)))


_DRAWS = 20_000
"""Draws of a trend; an interval's ends are good to 1 % of its width."""
_SEED = 7
"""The same trend gives the same interval."""


def reaches(limit: float, now: Outlook) -> tuple[float, float, float]:
    """
    Return in how many days a size reaches a limit: 5 %, 50 % and 95 % of the chances.

    0 where it is beyond already, infinity where it never is. Raises DataError: a limit that is not
    positive.
    """
    if not limit > 0.0:
        raise DataError(f'a limit must be positive, got {limit}')
    rng = np.random.default_rng(_SEED)
    spread, axes = np.linalg.eigh(now.covariance)
    root = axes * np.sqrt(np.maximum(spread, 0.0))
    value, slope = now.value[:, None] + root @ rng.standard_normal((2, _DRAWS))
    side = np.where(slope >= 0.0, limit, -limit)
    with np.errstate(divide='ignore', invalid='ignore'):
        days = np.where(np.abs(value) >= limit, 0.0, (side - value) / slope)
    days = np.where(np.isnan(days), np.inf, np.maximum(days, 0.0))
    low, middle, high = np.quantile(days, [0.05, 0.5, 0.95], method='inverted_cdf')
    return float(low), float(middle), float(high)


def _shapes(days: Array) -> list[_Shape]:
    """Return the steps before every diagnosis but the first, the trends from each, and a season."""
    count = days.size
    shapes = [
        _Shape('step', k, (np.arange(count) >= k).astype(float)[:, None]) for k in range(1, count)
    ]
    shapes += [
        _Shape('trend', k, np.maximum(days - days[k], 0.0)[:, None]) for k in range(count - 2)
    ]
    if days[-1] - days[0] > _SEASON_SPAN * _YEAR:
        phase = 2.0 * np.pi * days / _YEAR
        shapes.append(_Shape('season', 0, np.column_stack([np.cos(phase), np.sin(phase)])))
    return shapes


class _System:
    """The arm as it was at first and the changes found so far, fitted together."""

    def __init__(self, series: _Series, result: Sequence[_Term]) -> None:
        self._series, self._terms = series, tuple(result)
        every = slice(None)
        one = np.ones((series.days.size, 1, 1))
        blocks = [[series.first + np.diag(series.prior)]]
        right = [series.told(one[:, 0])[0]]
        for k, each in enumerate(result):
            columns, places = each.shape.columns, each.places
            row = [series.crossed(one, every, columns[:, None], places)]
            row += [
                series.crossed(
                    other.shape.columns[:, None], other.places, columns[:, None], places
                )
                for other in result[: k + 1]
            ]
            # Of what nobody has seen there is rounding alone.
            floor = _SHOWN * self._believed(each.shape, places)
            row[-1] = row[-1] + floor.reshape(row[-1].shape)
            blocks.append([b.reshape(-1, each.width).T for b in row])
            right.append(series.told(columns)[:, places].ravel())
        self._matrix = _symmetric(blocks)
        self._right = np.concatenate(right)
        self._inverse = np.linalg.inv(self._matrix)
        self.solution = self._inverse @ self._right

    @cached_property
    def scatter(self) -> float:
        """Return by how much diagnoses scatter more than they say, at least 1: the median over them."""
        series = self._series
        ratios = []
        for w, (own, whitening) in enumerate(series.whitening):
            state = self.solution[: len(series.names)].copy()
            for each, numbers in self._taken():
                state[each.places] += each.shape.columns[w] @ numbers
            if whitening.size:
                gap = whitening.T @ (series.weighted[w, own] - series.precision[w, own] @ state)
                ratios.append(float(gap @ gap) / gap.size)
        return max(1.0, float(np.median(ratios))) if ratios else 1.0

    def _taken(self) -> Iterator[tuple[_Term, Array]]:
        """Yield what was taken in, with its numbers (m, coordinates)."""
        at = len(self._series.names)
        for each in self._terms:
            yield each, self.solution[at : at + each.width].reshape(-1, each.places.size)
            at += each.width

    def now(self, place: int) -> tuple[Array, Array]:
        """Return value and rise in a day of a coordinate at the end, and their covariance."""
        weights = np.zeros((2, self.solution.size))
        weights[0, place] = 1.0
        at = len(self._series.names)
        for each in self._terms:
            here = np.flatnonzero(np.tile(each.places == place, each.shape.columns.shape[1]))
            weights[0, at + here] = each.shape.columns[-1, : here.size]
            weights[1, at + here] = float(each.shape.kind == 'trend')
            at += each.width
        return weights @ self.solution, self.scatter * (weights @ self._inverse @ weights.T)

    def gains(self) -> Array:
        """Return by how much the sum of squares falls with a shape on a thing, (shapes, things)."""
        rows = [
            [np.einsum('kum,kumn,kun->ku', mean, known, mean) for mean, known in batch]
            for batch in self._fits
        ]
        return np.concatenate([np.concatenate(each, axis=1) for each in rows])

    def _size(self, shape: int, thing: int) -> tuple[Array, Array]:
        """Return the numbers of a shape on one thing, (m s,), and their information."""
        batch, row = _found([len(each[0][0]) for each in self._fits], shape)
        family, column = _found([mean.shape[1] for mean, _ in self._fits[batch]], thing)
        mean, information = self._fits[batch][family]
        return mean[row, column], information[row, column]

    def moved(
        self, shapes: Sequence[int], gain: Array, thing: int, scatter: float
    ) -> tuple[Moved, ...]:
        """Return by how much each coordinate of a thing changed, whenever it began."""
        places = self._series.things[thing]
        weight = np.exp(0.5 * (gain - gain.max()))
        weight /= weight.sum()
        sizes, variances = [], []
        for k in shapes:
            shape = self._series.shapes[k]
            mean, information = self._size(k, thing)
            covariance = np.linalg.inv(information / scatter + self._believed(shape, places))
            columns = shape.columns.shape[1]
            # Of a season, how far it swings; the worse known of its two parts says how well.
            each = mean.reshape(columns, -1)
            sizes.append(np.linalg.norm(each, axis=0) if columns > 1 else each[0])
            parts = covariance.reshape(columns, places.size, columns, places.size)
            variances.append(
                [float(np.linalg.eigvalsh(parts[:, k, :, k])[-1]) for k in range(places.size)]
            )
        middle = weight @ sizes
        spread = np.sqrt(weight @ (np.array(variances) + (np.array(sizes) - middle) ** 2))
        return tuple(
            Moved(self._series.names[k], float(size), float(std))
            for k, size, std in zip(places, middle, spread, strict=True)
        )

    def _believed(self, shape: _Shape, places: NDArray[np.int_]) -> Array:
        """Return the prior's precision (m s, m s): a value's own holds for how far it moves."""
        prior = self._series.prior[places]
        return np.asarray(np.diag(np.outer(np.ptp(shape.columns, axis=0) ** 2, prior).ravel()))

    def odds(self, shape: int, thing: int, scatter: float) -> float:
        """Return the logarithm of the odds of a shape on a thing against none, its prior in."""
        mean, information = self._size(shape, thing)
        known = information / scatter
        prior = self._believed(self._series.shapes[shape], self._series.things[thing])
        shown = known @ mean
        fall = shown @ np.linalg.solve(known + prior, shown)
        return 0.5 * float(
            fall + np.linalg.slogdet(prior)[1] - np.linalg.slogdet(known + prior)[1]
        )

    @cached_property
    def _fits(self) -> list[list[tuple[Array, Array]]]:
        """Return of every batch the numbers (K, U, m s) and their information, by size of things."""
        return [list(self._fit(batch)) for batch in self._series.batches]

    def _fit(self, batch: _Batch) -> Iterator[tuple[Array, Array]]:
        series = self._series
        count, _, columns, _ = batch.cross.shape
        rows = [batch.cross]
        for each in self._terms:
            x = each.shape.columns[:, None]
            between = series.crossed(x, each.places, batch.columns, series.changing)
            rows.append(between.reshape(count, -1, *batch.cross.shape[2:]))
        stacked = np.concatenate(rows, axis=1)  # (K, P + found, m, C)
        solved = (self._inverse @ stacked.reshape(count, len(self._inverse), -1)).reshape(
            stacked.shape
        )
        right = batch.told - np.tensordot(self.solution, stacked, axes=(0, 1))
        own = batch.own.transpose(2, 4, 0, 1, 3)  # (C, C, K, m, m)
        for at in series.families:  # (U, s), of the coordinates that change
            things, size = len(at), at.shape[1] * columns
            # (U, s, s, K, m, m) to (K, U, m s, m s)
            whole = own[at[:, :, None], at[:, None]].transpose(3, 0, 4, 1, 5, 2)
            whole = whole.reshape(count, things, size, size)
            beside, pulled = (
                np.moveaxis(each[..., at], 3, 2).reshape(count, -1, things, size)
                for each in (stacked, solved)
            )
            information = whole - np.einsum('kaum,kaun->kumn', beside, pulled)
            # Of what nobody has seen there is rounding alone; its size is zero.
            prior = np.tile(series.prior[series.changing[at]], columns)
            span = np.repeat(np.ptp(batch.columns, axis=0) ** 2, at.shape[1], axis=-1)
            safe = information + _SHOWN * (span[:, None] * prior)[..., None] * np.eye(size)
            towards = np.moveaxis(right[..., at], 1, 2).reshape(count, things, size, 1)
            yield np.linalg.solve(safe, towards)[..., 0], information


def _found(counts: Sequence[int], index: int) -> tuple[int, int]:
    """Return in which of stretches, one after the other, an index lies, and where in it."""
    ends = np.cumsum(counts)
    k = int(np.searchsorted(ends, index, side='right'))
    return k, index - int(ends[k] - counts[k])


def _symmetric(blocks: list[list[Array]]) -> Array:
    sizes = [np.atleast_2d(row[-1]).shape[0] for row in blocks]
    starts = np.concatenate([[0], np.cumsum(sizes)])
    out = np.zeros((starts[-1], starts[-1]))
    for i, row in enumerate(blocks):
        for j, block in enumerate(row):
            here = np.ix_(range(starts[i], starts[i + 1]), range(starts[j], starts[j + 1]))
            out[here] = np.reshape(block, (sizes[i], sizes[j]))
    return np.asarray(np.tril(out) + np.tril(out, -1).T)
