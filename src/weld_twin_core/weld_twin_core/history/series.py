# Copyright 2026 weld_twin contributors
# SPDX-License-Identifier: Apache-2.0
"""
Diagnoses as observations of one arm, and all of them as one linear system.

An observation is what one diagnosis says of an arm, as numbers that can be added to those of the
next. What no coordinate explains, such as a little play, is part of what a diagnosis counts as
noise. It comes back at the same postures, and is another at others. So diagnoses of the same
postures share an error of their own; how large it is shows in how much less they scatter than they
say.
"""

from __future__ import annotations

from collections.abc import Collection, Sequence
from dataclasses import dataclass, replace
from functools import cached_property
from itertools import groupby, pairwise
from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray

from ..arrays import Array, readonly
from ..errors import DataError

SHOWN = 1e-6
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
_YEAR = 365.25
"""Days of a season."""
_SEASON_SPAN = 0.5
"""Share of a year from which on a season is looked for: less than half a wave is a trend."""


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
        return variance, axes, np.where(variance < 1.0 - SHOWN, 1.0 / variance - 1.0, 0.0)

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


class Shape(NamedTuple):
    """A kind of change, its instant (the first diagnosis after it) and its columns (W, m)."""

    kind: str
    begin: int
    columns: Array


class Batch(NamedTuple):
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
class Series:
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
    def shapes(self) -> list[Shape]:
        return _shapes(self.days)

    @cached_property
    def batches(self) -> list[Batch]:
        """Return the sums over the observations of all shapes, by how many columns these have."""
        out, places = [], self.changing
        one, every = np.ones((self.days.size, 1, 1)), slice(None)
        for _, group in groupby(self.shapes, lambda shape: shape.columns.shape[1]):
            x = np.stack([shape.columns for shape in group], axis=1)
            cross = self.crossed(one, every, x, places)[:, 0]
            own = self.crossed(x, places, x, places)
            told = self.told(x.reshape(len(x), -1))[:, places].reshape(*x.shape[1:], -1)
            out.append(Batch(x, cross, own, told))
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


def series_of(observations: Sequence[Observation]) -> Series:
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
    series = Series(
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


def _with_repeated(series: Series, ordered: Sequence[Observation]) -> Series:
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


def _shapes(days: Array) -> list[Shape]:
    """Return the steps before every diagnosis but the first, the trends from each, and a season."""
    count = days.size
    shapes = [
        Shape('step', k, (np.arange(count) >= k).astype(float)[:, None]) for k in range(1, count)
    ]
    shapes += [
        Shape('trend', k, np.maximum(days - days[k], 0.0)[:, None]) for k in range(count - 2)
    ]
    if days[-1] - days[0] > _SEASON_SPAN * _YEAR:
        phase = 2.0 * np.pi * days / _YEAR
        shapes.append(Shape('season', 0, np.column_stack([np.cos(phase), np.sin(phase)])))
    return shapes
