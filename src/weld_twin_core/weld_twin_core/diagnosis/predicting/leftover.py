# Copyright 2026 weld_twin contributors
# SPDX-License-Identifier: Apache-2.0
"""
What the model leaves on postures left out of the fit, beyond what open directions account for.

The recordings are cut into regions of posture. Each in turn is predicted by the model fitted on the
others; what is left over is as large as makes nine of ten of those predictions hold. Of that, what
the instrument's noise is made of is taken off: noise differs from one sample to the next, what the
arm does does not. Stations that lie apart do not tell the two from each other. There it counts for
how much the arm has of all the small errors that could be told.
"""

from __future__ import annotations

from collections.abc import Callable, Iterator, Sequence
from dataclasses import dataclass
from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray
from scipy.special import chdtri

from ...arrays import Array
from ...recording import Recording
from ...twin.turns import just_turned
from ..algebra.definite import Index, unit_diagonal
from ..algebra.designed import Design
from ..algebra.fit import TRUSTED, solve_scaled
from ..algebra.independent_rows import by_sample
from ..algebra.noise_floor import NoiseFloor
from ..algebra.problem import Problem, Scale

HOLD = 0.9
"""Share of unseen postures that their regions shall hold."""
SHARES = (0.0, 0.25, 0.5, 0.75, 0.95)
"""Shares of what is left over that may come from the gears; never all, for tools shake too."""
ROUGH = 0.5
"""Share of small errors of a usual size from which on all that is left is the arm's. A judgement: of two
real arms under a tracker it is 0.3 to 0.6, and their stations repeat better than models predict."""
NEIGHBOURS = (2, 8, 32, 128)
"""Samples that are looked at together for what they have in common: two show what changes from one to
the next, a hundred what is a tenth of the noise."""
SURE = 2.0
"""Standard errors from which on what neighbours have in common is no chance."""
ROUNDING = 1e-10
"""Added to a covariance of unit diagonal, so that it stays definite where its inverse hardly is."""
AXES = slice(0, 3)
"""Rows of a sample that are positions, or all that a contact sees."""
STEPS = 60
"""Halvings of the bracket in which the size is sought; far below rounding."""

FEW = 12
"""Samples after turns of a joint below which they tell nothing of what is left there."""
PEAK = 1.7321
"""Largest size of an error that grows from nothing and goes again, in that of its RMS: a triangle's."""
CLEAR = 2.0
"""Standard errors by which more must be left there than elsewhere: a bound that is told too wide does
less harm than one too narrow."""

Given = Callable[[NDArray[np.bool_]], tuple[Array, Array]]
"""Mean and covariance of the coordinates given all rows but those of a mask."""


@dataclass(frozen=True, eq=False)
class Unseen:
    """
    What predicts rows from others.

    Attributes
    ----------
    own : Design
        Whitened columns of frames and found effects: what the fit turned.
    precision, pull : array, shape (K,)
        Of the fit's prior, and how hard it pulls from where the fit is.
    columns : array, shape (P, rows)
        Those of the coordinates that are uncertain.
    turns : array, shape (n, rows)
        Those of the joints that turn.
    levers : array, shape (n, rows)
        Those of all joints.
    residual : array, shape (rows,)
    labels : array, shape (rows,)
        Block of like posture of every row.

    """

    own: Design
    precision: Array
    pull: Array
    columns: Array
    turns: Array
    levers: Array
    residual: Array
    labels: Array


class Rest(NamedTuple):
    """
    What is left over: per axis at the tool [m], about each axis [rad], in every gear [rad].

    ``turns``, shape (n,) [rad or m], is what is left over in joints that have just turned around,
    on top of that. ``middle`` is how far to go from the fitted model to the middle of those allowed, as
    a share of the way, to predict unseen postures best.
    """

    position: float
    orientation: float
    gear: float
    turns: Array
    middle: float


def leftover(
    problem: Problem,
    scale: Scale,
    unseen: Unseen,
    given: Given,
    floor: NoiseFloor,
    rough: float,
    lost: Array,
) -> Rest:
    """
    Return the standard deviations of what is left over.

    Parameters
    ----------
    given : callable
        Mean and covariance of the uncertain coordinates given all rows but those of a mask.
    floor : NoiseFloor
        What the recordings themselves say of the instrument's noise.
    rough : float
        Share of the arm's small errors that are of a usual size.
    lost : array, shape (n,) [rad or m]
        How much motion was found to be lost in every joint.

    """
    samples, weight = _by_sample(problem), np.concatenate(scale.weights)
    errors, moments, beside, middle = _predicted(problem, unseen, given, samples, weight > TRUSTED)
    levers = [unseen.turns[:, index].T @ unseen.turns[:, index] for index in samples]

    def part(axes: slice) -> tuple[Array, Array, Array]:
        """Return errors, moments and levers on three axes of the samples that have them."""
        wide = [k for k, index in enumerate(samples) if index.size >= axes.stop]
        unit = (scale.position if axes.start < 3 else scale.orientation) / np.sqrt(weight[wide])
        count = axes.stop - axes.start
        square = [
            np.array([each[k][axes, axes] for k in wide]).reshape(-1, count, count)
            * unit[:, None, None] ** 2
            for each in (moments, levers)
        ]
        off = np.array([errors[k][axes] for k in wide]).reshape(-1, count) * unit[:, None]
        return off, square[0], square[1]

    if all(index.size < 3 for index in samples):
        # Faces and lengths show one way each: nothing parts what is left by axes or gears.
        off, moment, _ = part(slice(0, 1))
        remaining = max(float((off**2).mean() - moment.mean()), 0.0)
        position, gear = float(np.sqrt(remaining)), 0.0
    else:
        position, gear, remaining = _shared(*part(AXES))
    e, v, levered = part(slice(3, 6))
    # Without measured turns the tool turns as much as it shifts on an arm of a metre.
    turn = _size(e, v + gear**2 * levered, np.eye(3)) if e.size else position
    noise = _noise(problem, floor, scale.position)
    share = _of_the_arm(remaining / scale.position**2, beside, noise, rough, problem.at_rest)
    at_turns = _at_turns(problem, unseen, samples, errors, moments, lost)
    return Rest(position * share, turn * share, gear * share, at_turns, middle)


def _at_turns(
    problem: Problem,
    unseen: Unseen,
    samples: list[Index],
    errors: list[Array],
    moments: list[Array],
    lost: Array,
) -> Array:
    """
    Return how far joints may be off where they have just turned around, shape (n,) [rad or m].

    Laws of lost motion differ on that way alone, and look alike on the rest of a recording. Where more
    is left there than elsewhere, the law that was found does not hold, and any part of the motion may
    be lost: evenly likely ones have this standard deviation. Else it is as much as the noise may hide.
    """
    out = np.zeros(lost.size)
    seen = np.array([k for k, error in enumerate(errors) if error.size >= 3], dtype=int)
    if not lost.any() or problem.at_rest or not seen.size:
        return out
    excess = np.array(
        [(errors[k][AXES] ** 2).mean() - moments[k].diagonal()[AXES].mean() for k in seen]
    )
    near = np.concatenate([_turned(problem, k) for k in range(len(problem.recordings))])[seen]
    for i in np.flatnonzero(lost):
        here, beside = excess[near[:, i]], excess[~near[:, i]]
        if min(here.size, beside.size) < FEW:
            continue
        doubt = CLEAR * np.sqrt(here.var() / here.size + beside.var() / beside.size)
        more, out[i] = here.mean() - beside.mean(), lost[i] / np.sqrt(3.0)
        if more <= doubt:
            size = np.mean(
                [(unseen.levers[i, samples[k][:3]] ** 2).mean() for k in seen[near[:, i]]]
            )
            out[i] = min(out[i], PEAK * np.sqrt(max(more + doubt, 0.0) / max(size, 1e-300)))
    return out


def _turned(problem: Problem, k: int) -> NDArray[np.bool_]:
    """Return which joints have just turned at the samples of a recording; none where it touched."""
    recording = problem.recordings[k]
    if recording.measured is None or problem.contact(k) is not None:
        return np.zeros((problem.samples[k], recording.joints.q.shape[1]), dtype=bool)
    return just_turned(recording.joints, recording.measured.t)


def _of_the_arm(
    remaining: float, beside: float, noise: float | None, rough: float, at_rest: bool
) -> float:
    """
    Return the part of what is left over that is the arm's, as a factor of its size.

    Parameters
    ----------
    remaining, beside : float
        Variance of what is left, and what of it neighbours have in common [noise of the fit].
    noise : float, optional
        Standard deviation of the instrument [noise of the fit]; None where nothing tells it.
    at_rest : bool
        Whether stations were measured, which lie apart.

    """
    # Where open directions account for all of it, neighbours have nothing in common either.
    remaining = max(remaining, 1e-12)
    common = min(max(beside, 0.0), remaining)
    alone = remaining - common
    if noise is None:
        common += alone * min(rough / ROUGH, 1.0)
    elif at_rest:
        common += max(alone - noise**2, 0.0)
    return float(np.sqrt(common / remaining))


def _shared(errors: Array, moments: Array, levers: Array) -> tuple[float, float, float]:
    """
    Return what is left over per axis [m] and per gear [rad]: the likeliest mixture.

    And the variance of an axis by both together [m^2].
    """
    lever = float(np.trace(levers, axis1=1, axis2=2).mean()) / 3.0
    best = (-np.inf, 0.0, 0.0, 0.0)
    for share in SHARES if lever > 0.0 else SHARES[:1]:
        shape = (1.0 - share) * np.eye(3) + share * levers / max(lever, 1e-300)
        size = _size(errors, moments, shape)
        whole = moments + (size**2 + 1e-18) * shape + 1e-18 * np.eye(3)
        solved = np.linalg.solve(whole, errors[..., None])[..., 0]
        likely = -0.5 * float(((errors * solved).sum(axis=1) + np.linalg.slogdet(whole)[1]).sum())
        gear = size * np.sqrt(share / max(lever, 1e-300))
        best = max(best, (likely, size * np.sqrt(1.0 - share), float(gear), size**2))
    return best[1], best[2], best[3]


def _by_sample(problem: Problem) -> list[Index]:
    """Return the row numbers of every sample."""
    size = sum(c * m for c, m in zip(problem.rows, problem.samples, strict=True))
    parts = by_sample(np.arange(size), problem.rows, problem.samples)
    return [row for part in parts for row in part]


def _predicted(
    problem: Problem,
    unseen: Unseen,
    given: Given,
    samples: list[Index],
    good: NDArray[np.bool_],
) -> tuple[list[Array], list[Array], float, float]:
    """
    Return the error of every sample predicted from other regions, and its second moment.

    And the variance that good samples have in common with their neighbours, and `_middle`.
    """
    errors, shifts = np.array(unseen.residual), np.zeros(unseen.residual.size)
    normal = unseen.own.normal()
    normal[np.diag_indices_from(normal)] += unseen.precision
    right = unseen.own.times(unseen.residual) - unseen.pull
    place = np.repeat(np.arange(len(samples)), [index.size for index in samples])
    moments: list[Array] = [np.zeros((0, 0))] * len(samples)
    alike: list[_Alike] = []
    for b in np.unique(unseen.labels):
        out = unseen.labels == b
        mine, columns = unseen.own.within(np.flatnonzero(out)), unseen.columns[:, out]
        pulled = right - mine.times(unseen.residual[out])
        moved = mine.mixed(solve_scaled(normal - mine.normal(), pulled, 1e-9))
        mean, covariance = given(out)
        errors[out] -= moved
        # The mean is counted from the fit to all rows, the error from the fit to the others.
        shifts[out] = mean @ columns - moved
        ways = np.vstack([_ways(covariance) @ columns, shifts[out]])
        here = np.unique(place[out])
        ends = np.cumsum([0, *(samples[k].size for k in here)])
        own = {k: ways[:, a:b] for k, a, b in zip(here, ends[:-1], ends[1:], strict=True)}
        for k in here:
            moments[k] = own[k].T @ own[k]
        for size, group in _neighbours(problem, here[good[here]]):
            # Touches of several kinds see a point by so many rows each; the like are compared.
            like = [k for k in group if samples[k].size == samples[group[0]].size]
            if len(like) > 1:
                each = [(errors[samples[k]][AXES], own[k][:, AXES]) for k in like]
                alike.append(_Alike.of(size, each))
    left = [errors[index] for index in samples]
    use = np.concatenate([samples[k] for k in np.flatnonzero(good)])
    return left, moments, _common(alike), _middle(errors[use], shifts[use], unseen.labels[use])


def _ways(covariance: Array) -> Array:
    """Return the ways in which coordinates may be off, of one standard deviation each, shape (P, P)."""
    scaled, deviation = unit_diagonal(covariance, ROUNDING)
    return np.asarray(np.linalg.cholesky(scaled).T * deviation)


def _middle(errors: Array, shifts: Array, labels: Array) -> float:
    """
    Return how far to go from the fitted model to the middle of those allowed, from 0 to 1.

    Both predict every region from the others, and are weighed by how well they do [1]_. Not at all
    where the gain is no more than chance from region to region: of an arm that is exact but for what
    was found, all else that was allowed is noise.

    References
    ----------
    .. [1] L. Breiman, "Stacked regressions", Machine Learning 24, 1996.

    """
    share = float(np.clip(errors @ shifts / max(float(shifts @ shifts), 1e-300), 0.0, 1.0))
    gain = errors**2 - (errors - share * shifts) ** 2
    each = np.array([gain[labels == b].sum() for b in np.unique(labels)])
    sure = each.size > 1 and each.sum() > SURE * np.sqrt(each.size) * each.std(ddof=1)
    return share if sure else 0.0


class _Alike(NamedTuple):
    """
    What neighbours have in common, summed over all pairs of a group of ``size`` or fewer.

    ``agree`` is the sum of products of errors, ``open`` that of what open directions account for,
    ``square`` the sum of squared errors over samples, ``pairs`` and ``rows`` how many there are.
    """

    size: int
    agree: float
    open: float
    square: float
    pairs: int
    rows: int

    @classmethod
    def of(cls, size: int, each: Sequence[tuple[Array, Array]]) -> _Alike:
        """Return the sums of a group, of errors (c,) and ways to be off (R, c) each."""
        square = sum(float(e @ e) for e, _ in each)
        own = sum(float((w**2).sum()) for _, w in each)
        whole, ways = (np.sum(part, axis=0) for part in zip(*each, strict=True))
        agree, together = float(whole @ whole) - square, float((ways**2).sum()) - own
        width = whole.size
        return cls(
            size, agree, together, square, width * len(each) * (len(each) - 1), width * len(each)
        )


def _common(alike: Sequence[_Alike]) -> float:
    """
    Return the variance that neighbours have in common, beyond open directions and chance.

    Over few neighbours what changes fast shows, over many what is small. Samples that err against
    each other have no white noise either.
    """
    result = [0.0]
    for size in dict.fromkeys(one.size for one in alike):
        mine = [one for one in alike if one.size == size]
        pairs = sum(one.pairs for one in mine)
        noise = sum(one.square for one in mine) / sum(one.rows for one in mine)
        agree, own = (sum(v) / pairs for v in zip(*((o.agree, o.open) for o in mine), strict=True))
        chance = SURE * float(np.hypot(noise * np.sqrt(2.0 / pairs), own))
        result += [agree - own] * (agree - own > chance) + [-agree] * (-agree > chance)
    return max(result)


def _neighbours(problem: Problem, here: Array) -> Iterator[tuple[int, Array]]:
    """Yield groups of neighbours in time, and how many there are at most; of stations, in posture."""
    if not problem.at_rest:
        for size in NEIGHBOURS:
            for start in range(0, here.size - 1, size):
                yield size, here[start : start + size]
    elif here.size > 1:
        q = np.concatenate([_postures(r) for r in problem.recordings])[here]
        apart = ((q[:, None] - q[None]) ** 2).sum(axis=2)
        np.fill_diagonal(apart, np.inf)
        pairs = np.stack([np.arange(here.size), apart.argmin(axis=1)], axis=1)
        for pair in np.unique(np.sort(pairs, axis=1), axis=0):
            yield 2, here[pair]


def _postures(recording: Recording) -> Array:
    assert recording.measured is not None
    return recording.joints.at(recording.measured.t)[0]


def _size(errors: Array, moments: Array, shape: Array) -> float:
    """Return the factor of a shape's root that makes regions hold as many errors as they shall."""
    limit = float(chdtri(3.0, 1.0 - HOLD))
    # Of few errors the largest say more of those to come than their count: conformal level.
    wanted = min(HOLD * (1.0 + 1.0 / len(errors)), 1.0)

    # On the axes in which both are diagonal, every size asked for costs a division.
    root = np.linalg.inv(np.linalg.cholesky(np.broadcast_to(shape, moments.shape)))
    spread, turn = np.linalg.eigh(root @ (moments + 1e-18 * np.eye(3)) @ np.swapaxes(root, -1, -2))
    along = (np.swapaxes(turn, -1, -2) @ (root @ errors[..., None]))[..., 0] ** 2

    def held(variance: float) -> float:
        return float(np.mean((along / (spread + variance)).sum(axis=1) <= limit))

    low, high = 0.0, 100.0 * float((errors**2).sum(axis=1).max()) + 1e-18
    if held(low) >= wanted:
        return 0.0
    for _ in range(STEPS):
        middle = 0.5 * (low + high)
        low, high = (low, middle) if held(middle) >= wanted else (middle, high)
    return float(np.sqrt(high))


def _noise(problem: Problem, floor: NoiseFloor, unit: float) -> float | None:
    """Return the instrument's noise in units [m], told with the data or seen in them; None without."""
    reported = [
        float(np.median(r.measured.sigma))
        for r in problem.recordings
        if r.measured is not None and r.measured.sigma is not None
    ]
    if reported:
        return float(np.mean(reported)) / unit
    return floor.sigma / unit if floor.independent else None
