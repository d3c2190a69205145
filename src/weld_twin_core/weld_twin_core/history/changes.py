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

References
----------
.. [1] M. Basseville, I. V. Nikiforov, "Detection of Abrupt Changes", Prentice Hall 1993, section 2.4.

"""

from __future__ import annotations

from collections.abc import Collection, Sequence
from dataclasses import dataclass, field, replace
from functools import cached_property
from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray
from scipy.special import chdtri

from ..arrays import Array, readonly
from ..errors import DataError

_SHOWN = 1e-6
"""Share of the variance before the data that counts as taken away by them: less is a file's rounding."""
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
    changing: NDArray[np.int_]
    """Places of the coordinates that may change, shape (C,)."""
    whitening: tuple[tuple[NDArray[np.int_], Array], ...]
    """Of every observation, the places of its coordinates and its `Observation.whitening`."""
    shapes: dict[tuple[str, int], tuple[Array, Array, Array]] = field(default_factory=dict)
    """Sums over the observations of every shape that was tried: the same whatever was found."""


def series_of(observations: Sequence[Observation]) -> _Series:
    """
    Return observations over all their coordinates.

    An effect that only some diagnoses name is taken to be zero in the others, as surely as three
    standard errors of those that name it. Of what is steady, one that lacks it says nothing.

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
    changing = [k for k, name in enumerate(names) if name not in steady]
    for k in changing:
        for w, each in enumerate(ordered):
            if names[k] not in each.names:
                precision[w, k, k] += 1.0 / (_ABSENT * float(np.median(error[k]))) ** 2
    return _Series(
        days,
        names,
        precision,
        products,
        1.0 / width**2,
        np.array(changing, dtype=int),
        tuple(whitening),
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


@dataclass(frozen=True)
class Change:
    """A change of one coordinate."""

    name: str
    """The coordinate."""
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
    """Other coordinates whose change would explain the same."""
    since: float | None = None
    """Of a step: earliest day from which a trend explains it as well; None where none does."""
    faster: bool = False
    """Of a trend: whether it comes on top of an earlier one of the same coordinate."""


class _Term(NamedTuple):
    """A shape on a coordinate that was taken in."""

    shape: _Shape
    place: int


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
    shapes = _shapes(series.days)
    tests = max(len(shapes), _TRIED) * series.changing.size
    sooner = np.array(
        [_NAMED * (name in named) + _LIKELY * (name in likely) for name in series.names]
    )
    # The last few diagnoses hardly tell a step from a trend; a step is the simpler.
    simple = np.array(
        [
            chdtri(shape.columns.shape[1], alarms / tests)
            + _ALIKE * (shape.kind == 'trend')
            + _FRESH * (shape.kind == 'step' and shape.begin == series.days.size - 1)
            for shape in shapes
        ]
    )
    # What use cannot change has to explain more, if it is known what use can.
    rare = np.array([bool(likely) and name not in {*named, *likely} for name in series.names])
    look = _Look(series, shapes, simple[:, None] + 2.0 * _LIKELY * rare, sooner)
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
    """Shape (shapes, P)."""
    sooner: Array
    """Log prior odds of a coordinate before others that explain as much, shape (P,)."""

    def next(self, result: Sequence[_Term]) -> tuple[_Term, Change] | None:
        """Return what explains most beside what was found, None if it is no more than chance."""
        system = _System(self.series, result)
        gain = np.array([system.gains(shape) for shape in self.shapes])
        row, column = np.unravel_index(int(np.argmax(gain - self.bar)), gain.shape)
        best = int(row), int(column)
        # Beside the change: without it, the change itself would count as scatter.
        scatter = _System(self.series, [*result, _Term(self.shapes[best[0]], best[1])]).scatter
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
        odds = {
            j: system.odds(shapes[k], j, scatter) + float(self.sooner[j]) for j, k in at.items()
        }
        place = max(odds, key=lambda j: odds[j])
        shape = shapes[at[place]]
        near = [shapes[k].begin for k in same if gain[k, place] > most[place] - _DATED]
        ranked = sorted(odds, key=lambda j: -odds[j])
        others = [j for j in ranked if j != place and odds[j] > odds[place] - 0.5 * _ALIKE]
        # From where on a trend explains as much as a step.
        slow = [
            each.begin
            for each, explained in zip(shapes, gain[:, place], strict=True)
            if kind == 'step' and each.kind == 'trend' and explained > top - _ALIKE
        ]
        first = max(min(near) - (kind == 'step'), 0)
        return _Term(shape, place), Change(
            series.names[place],
            kind,
            float(series.days[shape.begin]),
            (float(series.days[first]), float(series.days[max(near)])),
            *system.size([shapes[k] for k in same], gain[same, place], place, scatter),
            0.5 * float(most[place]),
            tuple(series.names[k] for k in others),
            float(series.days[min(slow)]) if slow else None,
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
    shapes = {(each.kind, float(series.days[each.begin])): each for each in _shapes(series.days)}
    taken = [_Term(shapes[each.kind, each.day], series.names.index(each.name)) for each in result]
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
        self._sizes: dict[tuple[str, int], tuple[Array, Array]] = {}
        first = series.precision.sum(axis=0)
        blocks = [[first + np.diag(series.prior)]]
        right = [series.weighted.sum(axis=0)]
        for each in result:
            cross, _, right_side = self._against(each.shape, np.array([each.place]))
            blocks.append([cross[..., 0], *self._among(each)])
            right.append(right_side[:, 0])
        self._matrix = _symmetric(blocks)
        self._right = np.concatenate([np.atleast_1d(r) for r in right])
        self._inverse = np.linalg.inv(self._matrix)
        self.solution = self._inverse @ self._right

    @cached_property
    def scatter(self) -> float:
        """Return by how much diagnoses scatter more than they say, at least 1: the median over them."""
        series, count = self._series, len(self._series.names)
        ratios = []
        for w, (own, whitening) in enumerate(series.whitening):
            state = self.solution[:count].copy()
            at = count
            for each in self._terms:
                width = each.shape.columns.shape[1]
                state[each.place] += each.shape.columns[w] @ self.solution[at : at + width]
                at += width
            if whitening.size:
                gap = whitening.T @ (series.weighted[w, own] - series.precision[w, own] @ state)
                ratios.append(float(gap @ gap) / gap.size)
        return max(1.0, float(np.median(ratios))) if ratios else 1.0

    def now(self, place: int) -> tuple[Array, Array]:
        """Return value and rise in a day of a coordinate at the end, and their covariance."""
        weights = np.zeros((2, self.solution.size))
        weights[0, place] = 1.0
        at = len(self._series.names)
        for each in self._terms:
            width = each.shape.columns.shape[1]
            if each.place == place:
                weights[0, at : at + width] = each.shape.columns[-1]
                weights[1, at] = float(each.shape.kind == 'trend')
            at += width
        return weights @ self.solution, self.scatter * (weights @ self._inverse @ weights.T)

    def _against(self, shape: _Shape, places: NDArray[np.int_]) -> tuple[Array, Array, Array]:
        """Return a shape on some coordinates: against the first state, itself, and the data."""
        x, series = shape.columns, self._series
        cross = np.tensordot(x, series.precision, axes=(0, 0))[..., places]
        own = np.einsum('wm,wn,wj->jmn', x, x, series.precision[:, places, places])
        return cross, own, x.T @ series.weighted[:, places]

    def _among(self, one: _Term) -> list[Array]:
        """Return the products of a change found with those found before it, and with itself."""
        series, out = self._series, []
        for other in self._terms:
            between = series.precision[:, one.place, other.place]
            out.append(np.einsum('wm,wn,w->mn', one.shape.columns, other.shape.columns, between))
            if other is one:
                break
        return out

    def gains(self, shape: _Shape) -> Array:
        """Return by how much the sum of squares falls with a shape on each coordinate, (P,)."""
        mean, information = self.sizes(shape)
        return np.asarray(np.einsum('jm,jmn,jn->j', mean, information, mean))

    def sizes(self, shape: _Shape) -> tuple[Array, Array]:
        """Return the size of a shape on each coordinate, (P, m), and its information, (P, m, m)."""
        key = shape.kind, shape.begin
        if key not in self._sizes:
            self._sizes[key] = self._fitted(shape)
        return self._sizes[key]

    def size(
        self, shapes: Sequence[_Shape], gain: Array, place: int, scatter: float
    ) -> tuple[float, float]:
        """Return the size of a change on a coordinate and its standard error, whenever it began."""
        weight = np.exp(0.5 * (gain - gain.max()))
        weight /= weight.sum()
        sizes, variances = [], []
        for shape in shapes:
            mean, information = self.sizes(shape)
            # Of a season, how far it swings; the worse known of its two parts says how well.
            sizes.append(
                float(np.hypot(*mean[place])) if mean.shape[1] == 2 else float(mean[place, 0])
            )
            known = information[place] / scatter + self._believed(shape, place)
            variances.append(1.0 / float(np.linalg.eigvalsh(known)[0]))
        middle = float(weight @ sizes)
        spread = weight @ (np.array(variances) + (np.array(sizes) - middle) ** 2)
        return middle, float(np.sqrt(spread))

    def _believed(self, shape: _Shape, place: int) -> Array:
        """Return the prior's precision (m, m): a value's own holds for how far it moves."""
        return np.asarray(self._series.prior[place] * np.diag(np.ptp(shape.columns, axis=0) ** 2))

    def odds(self, shape: _Shape, place: int, scatter: float) -> float:
        """Return the logarithm of the odds of a shape on a coordinate against none, its prior in."""
        mean, information = self.sizes(shape)
        known = information[place] / scatter
        prior = self._believed(shape, place)
        shown = known @ mean[place]
        fall = shown @ np.linalg.solve(known + prior, shown)
        return 0.5 * float(
            fall + np.linalg.slogdet(prior)[1] - np.linalg.slogdet(known + prior)[1]
        )

    def _fitted(self, shape: _Shape) -> tuple[Array, Array]:
        series = self._series
        places = series.changing
        key = shape.kind, shape.begin
        if key not in series.shapes:
            series.shapes[key] = self._against(shape, places)
        cross, own, right_side = series.shapes[key]
        rows = [np.moveaxis(cross, 0, -1)]  # (P first, C, m)
        for each in self._terms:
            between = series.precision[:, each.place, places]
            rows.append(np.einsum('wa,wm,wj->ajm', each.shape.columns, shape.columns, between))
        stacked = np.concatenate(rows, axis=0)  # (P + found, C, m)
        solved = np.tensordot(self._inverse, stacked, axes=1)
        information = own - np.einsum('ajm,ajn->jmn', stacked, solved)
        right = right_side.T - np.einsum('a,ajm->jm', self.solution, stacked)
        # A coordinate that nobody has seen carries no information; its size is zero.
        eye = np.eye(own.shape[1])
        floor = 1e-9 * np.maximum(np.trace(own, axis1=1, axis2=2), 1e-300)
        safe = information + floor[:, None, None] * eye
        size = np.zeros((len(series.names), shape.columns.shape[1]))
        known = np.zeros((*size.shape, size.shape[1]))
        size[places] = np.linalg.solve(safe, right[..., None])[..., 0]
        known[places] = information
        return size, known


def _symmetric(blocks: list[list[Array]]) -> Array:
    sizes = [np.atleast_2d(row[-1]).shape[0] for row in blocks]
    starts = np.concatenate([[0], np.cumsum(sizes)])
    out = np.zeros((starts[-1], starts[-1]))
    for i, row in enumerate(blocks):
        for j, block in enumerate(row):
            here = np.ix_(range(starts[i], starts[i + 1]), range(starts[j], starts[j + 1]))
            out[here] = np.reshape(block, (sizes[i], sizes[j]))
    return np.asarray(np.tril(out) + np.tril(out, -1).T)
