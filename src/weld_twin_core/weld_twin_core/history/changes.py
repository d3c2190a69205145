# Copyright 2026 weld_twin contributors
# SPDX-License-Identifier: Apache-2.0
"""
What changed between diagnoses: steps, trends and seasons of single coordinates.

All diagnoses are one linear model: the arm as it was at first, plus a few shapes in time, each on one
coordinate. The shape that explains most is taken in, as long as it explains more than chance would
in all the shapes that were tried; then the next is looked for beside it. Coordinates that the
recordings tell apart badly explain a change equally well, so they come as a set. This is the
generalised likelihood ratio test of a change point [1]_ with nuisance parameters.

References
----------
.. [1] M. Basseville, I. V. Nikiforov, "Detection of Abrupt Changes", Prentice Hall 1993, section 2.4.

"""

from __future__ import annotations

from collections.abc import Collection, Iterator, Sequence
from dataclasses import dataclass, replace
from functools import cached_property
from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray
from scipy.special import chdtri

from ..arrays import Array
from ..errors import DataError
from .series import SHOWN, Batch, Observation, Series, Shape, series_of

_MOST = 8
"""Changes looked for; an arm with more of them was rebuilt."""
_ALIKE = 6.0
"""Sum of squares by which another coordinate may explain less and still be reported as alike:
a log Bayes factor of three, twenty to one."""
_DATED = 3.84
"""Fall within which another instant is as likely: 95 % of chi-square with one degree of freedom."""
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

    shape: Shape
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
    slow: Collection[str] = (),
    alarms: float = _ALARMS,
) -> tuple[Change, ...]:
    """
    Return what changed, the surest first, with a number of false alarms allowed in this look.

    Raises DataError: there is no observation, or two are of the same instant.

    named: coordinates that a diagnosis has named as causes: of those that explain a change equally
    well, they come first. likely: those that knocks, wear, service or warmth can change, before
    others. slow: those of them that do not change at once.
    """
    series = series_of(observations)
    if series.days.size < 2:
        return ()
    shapes = series.shapes
    tests = max(len(shapes), _TRIED) * len(series.things)
    kinds = {shape.kind for shape in shapes}
    believed = {kind: _sooner(series, kind, named, likely, slow) for kind in kinds}
    sooner = np.array([believed[shape.kind] for shape in shapes])
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


def _sooner(
    series: Series,
    kind: str,
    named: Collection[str],
    likely: Collection[str],
    slow: Collection[str],
) -> list[float]:
    """Return the log prior odds that every thing changes in this way, of those that explain as much."""
    able = set(likely) - set(slow) if kind == 'step' else set(likely)
    names = [{series.names[k] for k in places} for places in series.things]
    return [_NAMED * bool(of & set(named)) + _LIKELY * bool(of & able) for of in names]


def _on_top(result: Sequence[Change]) -> tuple[Change, ...]:
    """Return changes with each trend known for what it is beside an earlier one of its coordinate."""
    begun = [(each.name, each.day) for each in result if each.kind == 'trend']
    earlier = (any(n == one.name and day < one.day for n, day in begun) for one in result)
    pairs = zip(result, earlier, strict=True)
    return tuple(replace(one, faster=one.kind == 'trend' and more) for one, more in pairs)


class _Look(NamedTuple):
    """What is tried in one look, and how much each has to explain."""

    series: Series
    shapes: list[Shape]
    bar: Array
    """Shape (shapes, things)."""
    sooner: Array
    """Log prior odds of a thing before others that explain as much, shape (shapes, things)."""

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
        odds = {j: system.odds(k, j, scatter) + float(self.sooner[k, j]) for j, k in at.items()}
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


class _System:
    """The arm as it was at first and the changes found so far, fitted together."""

    def __init__(self, series: Series, result: Sequence[_Term]) -> None:
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
            floor = SHOWN * self._believed(each.shape, places)
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
            shown, axes = _shown(information / scatter, self._believed(shape, places))
            covariance = (axes / (1.0 + shown)) @ axes.T
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

    def _believed(self, shape: Shape, places: NDArray[np.int_]) -> Array:
        """Return the prior's precision (m s, m s): a value's own holds for how far it moves."""
        prior = self._series.prior[places]
        return np.asarray(np.diag(np.outer(np.ptp(shape.columns, axis=0) ** 2, prior).ravel()))

    def odds(self, shape: int, thing: int, scatter: float) -> float:
        """Return the logarithm of the odds of a shape on a thing against none, its prior in."""
        mean, information = self._size(shape, thing)
        prior = self._believed(self._series.shapes[shape], self._series.things[thing])
        shown, axes = _shown(information / scatter, prior)
        fall = (shown * (axes.T @ prior @ mean)) ** 2 / (1.0 + shown)
        return 0.5 * float(fall.sum() - np.log1p(shown).sum())

    @cached_property
    def _fits(self) -> list[list[tuple[Array, Array]]]:
        """Return of every batch the numbers (K, U, m s) and their information, by size of things."""
        return [list(self._fit(batch)) for batch in self._series.batches]

    def _fit(self, batch: Batch) -> Iterator[tuple[Array, Array]]:
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
            safe = information + SHOWN * (span[:, None] * prior)[..., None] * np.eye(size)
            towards = np.moveaxis(right[..., at], 1, 2).reshape(count, things, size, 1)
            yield np.linalg.solve(safe, towards)[..., 0], information


def _shown(information: Array, prior: Array) -> tuple[Array, Array]:
    """Return what data show along axes beside a precision of 1 before them, (L,), (m s, L)."""
    width = 1.0 / np.sqrt(np.diag(prior))
    shown, axes = np.linalg.eigh(information * np.outer(width, width))
    # Of what nobody has seen there is rounding alone, on either side of zero.
    return np.maximum(shown, 0.0), width[:, None] * axes


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
