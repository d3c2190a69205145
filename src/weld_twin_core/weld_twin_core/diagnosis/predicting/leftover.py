# Copyright 2026 weld_twin contributors
# SPDX-License-Identifier: Apache-2.0
"""
What the model leaves on postures left out of the fit, beyond what open directions account for.

Each region of posture is predicted by the model fitted on the others; what is left over is as large as
makes nine of ten of those predictions hold. The instrument's noise, which differs from one sample to
the next, is taken off. Stations that lie apart do not tell the two from each other: there it counts
how much the arm has of all small errors that could be told, or that the model is known to lack
something.
"""

from __future__ import annotations

from collections.abc import Callable, Iterator, Sequence
from dataclasses import dataclass
from functools import cached_property
from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray
from scipy.special import chdtr, chdtri

from ...arrays import Array, spread_over
from ...twin.goal_motion import just_turned
from ..algebra.definite import unit_diagonal
from ..algebra.fit import trusted
from ..algebra.independent_rows import ENOUGH
from ..algebra.noise_floor import NoiseFloor
from ..algebra.problem import Problem
from ..negligible import EMPTY, NANOMETRE, REPEATED
from ..unseen.folds import COVERED
from ..unseen.unseen_stretches import Unseen
from .sizes import SIZES, Products

SHARES = (0.0, 0.25, 0.5, 0.75, 0.95)
"""Shares of what is left over that may come from the gears; never all, for tools shake too."""
ROUGH = 0.5
"""Share of small errors of a usual size from which on all that is left is the arm's. A judgement: of two
real arms under a tracker it is 0.3 to 0.6, and their stations repeat better than models predict."""
NEIGHBOURS = (2, 8, 32, 128)
"""Samples that are looked at together: two show what changes fast, a hundred a tenth of the noise."""
AGREED = 2.5
"""Standard errors from which neighbours agree by no chance, which gets so far once in twenty times."""
IN_COMMON = np.geomspace(SIZES[0] ** 2, 1.0, 100)
"""Parts of what is left that neighbours may have in common. Before the data every decade is as likely as
every other, down to that of a ten-thousandth of the size, which is none (`sizes.SIZES`)."""
MOST = 800
"""Samples that tell what is left over; more say the same."""
LONE = 3.0
"""Log odds against what is left coming from one gear alone, beside which one it is: a judgement."""
PARTS = (0.25, 0.5, 0.75, 1.0, 1.5)
"""Parts of the errors' own covariance that an instrument may leave."""
CERTAIN = 5.0
"""Log likelihood by which levers must explain what is left better than an instrument does."""
STEPS = 60
"""Halvings of the bracket in which the size is sought; far below rounding."""

PEAK = np.sqrt(3)
"""Largest size of an error that grows from nothing and goes again, in that of its RMS: a triangle's."""
STRAYED = 1.5
"""Times the largest miss of chance in a fold from which on it is more: that varies by a tenth."""
CLEAR = 2.0
"""Standard errors by which more must be left there: a bound too wide does less harm than too narrow."""

Given = Callable[[Products], tuple[Array, Array]]
"""Mean and covariance of the coordinates given all rows but those of a part."""


@dataclass(frozen=True, eq=False)
class Predicted:
    """Every sample as other regions of posture foretell it: shifts [m], turns [rad], zero without."""

    error: Array  # what was measured less what was predicted, shape (N, 6)
    ways: Array
    """In which what was predicted may be off, each of one standard deviation, shape (R, N, 6);
    (R, N, 3) of points."""
    levers: Array  # d pose / d joint, shape (n, N, 6)
    speeds: Array  # of the joints, shape (N, n) [rad/s or m/s]
    shaken: Array  # how hard joints were accelerated just before, shape (N, n) [rad/s^2 or m/s^2]
    seen: NDArray[np.bool_]  # rows that a sample has, shape (N, 6)
    region: NDArray[np.int_]  # which region of posture it lies in, shape (N,)
    good: NDArray[np.bool_]  # samples that are no outliers, shape (N,)
    at_rest: bool  # whether all are stations
    left: Array
    """What is left of a sample, shape (N, 6). Of stations, which many coordinates follow closely, it is
    the error. Of a motion it is what the middle of the models leaves that all regions allow."""
    own: Array
    """The ways that belong to it, shaped alike: a middle that followed the samples hides so much."""

    @classmethod
    def of(
        cls,
        unseen: Unseen,
        columns: Array,
        parts: Sequence[Products],
        levers: Array,
        joints: tuple[Array, Array],
        given: Given,
        whole: tuple[Array, Array],
    ) -> Predicted:
        """
        Return what a model foretells of samples that it was not fitted to.

        columns, levers: whitened, of the coordinates that are uncertain and of all joints.
        parts: the columns' products in every region of posture, left out in turn.
        joints: how fast they were, and how hard accelerated just before, each (N, n).
        whole: mean and covariance of the coordinates given all rows.
        """
        error, ways = unseen.whole, _by_others(unseen, columns, parts, given)
        problem, scale, labels = unseen.problem, unseen.scale, unseen.labels
        seen = np.arange(6) < np.repeat(problem.rows, problem.samples)[:, None]
        place, wide = np.nonzero(seen), 3 if max(problem.rows) <= 3 else 6
        unit = np.repeat([scale.position, scale.orientation], 3)[place[1]]
        weight = np.concatenate(scale.weights)[place[0]]
        unit = np.divide(unit, np.sqrt(weight), out=np.zeros_like(unit), where=weight > 0.0)

        def by_sample(rows: Array, width: int = 6) -> Array:
            out = np.zeros((*rows.shape[:-1], len(seen), width))
            out[..., place[0], place[1]] = rows * unit
            return out

        left, own = error, ways
        if not problem.at_rest:
            left = unseen.residual - whole[0] @ columns
            own = _ways(whole[1], columns)
        good = np.concatenate(trusted(scale.weights))
        return cls(
            by_sample(error),
            by_sample(ways, wide),
            by_sample(levers),
            *joints,
            seen,
            labels[np.flatnonzero(place[1] == 0)].astype(int),
            good,
            problem.at_rest,
            by_sample(left),
            by_sample(own, wide),
        )

    @cached_property
    def swept(self) -> Array:
        """Return how fast the tool moved, shape (N, 6) [m/s, rad/s]."""
        return np.asarray(np.einsum('nki,kn->ki', self.levers, self.speeds))

    def axes(self, part: slice, swings: float) -> tuple[Array, Array, Array, Array]:
        """Return errors (K, c), moments (K, c, c), levers (K, c, n), velocities; swings count."""
        some = self.good & self.seen[:, part].all(axis=1)
        left, levers = self.left[some, part], self.levers[:, some, part]
        moved = levers.transpose(1, 2, 0) * (swings * self.shaken[some])[:, None]
        moments = np.einsum('kin,kjn->kij', moved, moved)
        if self.at_rest:
            own = self.own[:, some, part]
            moments = np.einsum('rki,rkj->kij', own, own, optimize=True)
        return left, moments, levers.transpose(1, 2, 0), self.swept[some, part]


def _by_others(unseen: Unseen, columns: Array, parts: Sequence[Products], given: Given) -> Array:
    """Return in which ways each region may be off what the others foretell, shape (P + 1, rows)."""
    labels = unseen.labels
    ways = np.empty((len(columns) + 1, labels.size))
    for region, part in zip(np.unique(labels), parts, strict=True):
        out = labels == region
        mean, covariance = given(part)
        ways[:-1, out] = _ways(covariance, columns[:, out])
        ways[-1, out] = beyond_named(unseen, columns, out, mean)
    return ways


def beyond_named(unseen: Unseen, columns: Array, out: NDArray[np.bool_], mean: Array) -> Array:
    """
    Return by how much a mean given other rows foretells some rows beyond the named causes alone.

    The mean is counted from the fit to all rows, what the named causes leave from that to the others.
    """
    return np.asarray(mean @ columns[:, out] + unseen.whole[out] - unseen.residual[out])


def _ways(covariance: Array, columns: Array) -> Array:
    """Return in which ways rows may be off, each of one standard deviation, shape (P, rows)."""
    scaled, size = unit_diagonal(covariance, REPEATED)
    return np.asarray((np.linalg.cholesky(scaled).T * size) @ columns)


class Rest(NamedTuple):
    """
    What is left over per axis at the tool [m], about each axis [rad], in every gear, (n,) [rad].

    ``turns`` (n,) [rad or m] is left in joints that have just turned around, besides; ``peaks`` (K,)
    [m] is how far each region was off at its worst, beyond chance; ``swings`` [s^2] how far joints are
    off for how hard they were just accelerated.
    """

    position: float
    orientation: float
    gears: Array
    turns: Array
    peaks: Array
    swings: float


def leftover(
    problem: Problem,
    predicted: Predicted,
    turning: NDArray[np.bool_],
    noise: float | None,
    rough: float,
    lost: Array,
) -> Rest:
    """
    Return the standard deviations of what is left over.

    turning: joints that turn, shape (n,); what slides has no gear.
    noise, rough: of a measured coordinate [m], if known; share of small errors of a usual size.
    lost: how much motion was found to be lost in every joint, shape (n,) [rad or m].
    """
    swings = _swings(predicted)
    if predicted.seen[:, :3].all(axis=1).any():
        spread = _shared(*predicted.axes(slice(0, 3), swings), turning)
    else:
        # Faces and lengths show one way each: nothing parts what is left by axes or gears.
        error, moment, *_ = predicted.axes(slice(0, 1), swings)
        remaining = max(float((error**2).mean() - moment.mean()), 0.0)
        spread = Spread(float(np.sqrt(remaining)), np.zeros(lost.size), False)
    error, moment, lever, _ = predicted.axes(slice(3, 6), swings)
    # Without measured turns the tool turns as much as it shifts on an arm of a metre.
    orientation = spread.position
    if error.size:
        moved = lever * spread.gears
        orientation = _size(error, moment + np.einsum('kin,kjn->kij', moved, moved), np.eye(3))
    common = _in_common(problem, predicted)
    beside = _open(predicted) / max(spread.position**2, NANOMETRE**2)
    share = _of_the_arm(spread.position**2, common, noise, rough, beside, problem.at_rest)
    of_gears = 1.0 if spread.surely else share
    at_turns = _at_turns(problem, predicted, lost)
    return Rest(
        spread.position * share,
        orientation * share,
        spread.gears * of_gears,
        at_turns,
        # An instrument strays as well, and no more of that is the arm's than of the rest.
        _peaks(predicted) * of_gears,
        swings,
    )


def _swings(predicted: Predicted) -> float:
    """
    Return how far joints are off for how hard they were just accelerated [s^2].

    An arm swings on springs that no law of the model has, where it starts, stops and turns a corner, and
    errs little in between. What samples leave is held against how far a joint's swing would move the
    tool there: the slope is the variance. What the middle of the models followed is no less of the arm.
    Stamps that jitter are off by more the faster the tool moves, which is the instrument's: that is
    taken off both.
    """
    use = predicted.good & predicted.seen[:, :3].all(axis=1)
    moved = predicted.levers[:, use, :3] * predicted.shaken[use].T[:, :, None]
    far = (moved**2).sum(axis=0).mean(axis=1)
    if predicted.at_rest or not far.any():
        return 0.0
    own = predicted.own[:, use, :3]
    left = (predicted.left[use, :3] ** 2 + np.einsum('rki,rki->ki', own, own)).mean(axis=1)
    fast = (predicted.swept[use, :3] ** 2).sum(axis=1)
    beside = np.stack([np.ones_like(fast), fast / max(float(fast.max()), EMPTY)], axis=1)
    both = np.stack([far, left], axis=1)
    apart, rest = (both - beside @ np.linalg.lstsq(beside, both, rcond=None)[0]).T
    slope = float(apart @ rest / (apart @ apart))
    rest -= slope * apart
    chance = float(np.sqrt(apart**2 @ rest**2) / (apart @ apart))
    return float(np.sqrt(slope)) if slope > AGREED * chance else 0.0


def _peaks(predicted: Predicted) -> Array:
    """Return how far each region of posture was off at its worst, beyond chance, shape (K,) [m]."""
    use = predicted.good & predicted.seen[:, :3].all(axis=1)
    off, regions = (predicted.error[use, :3] ** 2).sum(axis=1), predicted.region[use]
    out = []
    for region in np.unique(regions):
        here = off[regions == region]
        usual = np.median(here) / float(chdtri(3, 0.5))
        chance = usual * float(chdtri(3, 1.0 - 0.5 ** (1.0 / here.size)))
        strayed = here.max() > STRAYED**2 * chance
        out.append(np.sqrt(here.max() - chance) if strayed else 0.0)
    return np.array(out)


def _at_turns(problem: Problem, predicted: Predicted, lost: Array) -> Array:
    """
    Return how far joints may be off where they have just turned around, shape (n,) [rad or m].

    Laws of lost motion differ on that way alone, and look alike on the rest of a recording. Where more
    is left there than elsewhere, the law that was found does not hold, and any part of the motion may
    be lost: evenly likely ones have this standard deviation. Else it is as much as the noise may hide.
    """
    out = np.zeros(lost.size)
    use = predicted.good & predicted.seen[:, :3].all(axis=1)
    if not lost.any() or problem.at_rest or not use.any():
        return out
    ways = predicted.ways[:, use, :3]
    open_ = np.einsum('rki,rki->ki', ways, ways)
    excess = (predicted.error[use, :3] ** 2 - open_).mean(axis=1)
    near = np.concatenate([_turned(problem, k) for k in range(len(problem.recordings))])[use]
    for i in np.flatnonzero(lost):
        here, beside = excess[near[:, i]], excess[~near[:, i]]
        out[i] = lost[i] / np.sqrt(3)
        if min(here.size, beside.size) < ENOUGH:
            continue
        doubt = CLEAR * np.sqrt(here.var() / here.size + beside.var() / beside.size)
        more = here.mean() - beside.mean()
        if more <= doubt:
            size = (predicted.levers[i, use, :3][near[:, i]] ** 2).mean()
            out[i] = min(out[i], PEAK * np.sqrt(max(more + doubt, 0.0) / max(size, EMPTY)))
    return out


def _turned(problem: Problem, k: int) -> NDArray[np.bool_]:
    """Return which joints have just turned at the samples of a recording; none where it touched."""
    recording = problem.recordings[k]
    if problem.contact(k) is not None:
        return np.zeros((problem.samples[k], recording.joints.q.shape[1]), dtype=bool)
    return just_turned(recording.joints, recording.seen.t)


def _open(predicted: Predicted) -> float:
    """Return the variance that open directions leave of a coordinate [m^2]."""
    seen = predicted.seen[:, :3] & predicted.good[:, None]
    return float((predicted.own[:, :, :3] ** 2).sum(axis=0)[seen].mean())


def _of_the_arm(
    remaining: float,
    common: float,
    noise: float | None,
    rough: float,
    beside: float,
    at_rest: bool,
) -> float:
    """
    Return the part of what is left over that is the arm's, as a factor of its size.

    remaining, common: variance [m^2], and the share of it that neighbours have in common.
    noise: standard deviation of the instrument [m]; None where nothing tells it. Then all is the arm's
    as probably as it is rough, or nothing.
    beside: variance that open directions leave, in that of what is left over.
    """
    alone = 1.0 - common
    if noise is None:
        surely = min(rough / ROUGH, 1.0)
        common += _holding(
            np.array([0.0, alone]), np.array([1.0 - surely, surely]), beside + common
        )
    elif at_rest:
        common += max(alone - noise**2 / max(remaining, EMPTY), 0.0)
    return float(np.sqrt(common))


def _holding(variances: Array, likely: Array, beside: float) -> float:
    """
    Return the variance with which regions hold as many errors as they shall, of some that are likely.

    Their mean would be that of the few largest, which hardly any arm has: a promise of nine in ten is
    kept by less where they are rare, and by more where they are not.

    beside: variance of what is on top in any case.
    """
    limit = float(chdtri(3, 1.0 - COVERED))

    def held(variance: float) -> float:
        return float(likely @ chdtr(3, limit * (beside + variance) / (beside + variances + EMPTY)))

    return _least(held, COVERED, float(variances.max()))


def _least(held: Callable[[float], float], wanted: float, high: float) -> float:
    """Return the least variance up to a high one with which as many errors are held as shall be."""
    low = 0.0
    if held(low) >= wanted:
        return low
    for _ in range(STEPS):
        middle = (low + high) / 2.0
        low, high = (low, middle) if held(middle) >= wanted else (middle, high)
    return high


class Spread(NamedTuple):
    """What is left over per axis [m] and in every gear, (n,) [rad]; ``surely`` of no instrument."""

    position: float
    gears: Array
    surely: bool


def _shared(
    errors: Array, moments: Array, levers: Array, swept: Array, turning: NDArray[np.bool_]
) -> Spread:
    """
    Return what is left over as the likeliest mixture of what is alike in all directions and of gears.

    Of all gears alike, or of one alone. An instrument is less sure along some directions than along
    others, and these stay where they are; levers turn with the arm. Stamps that jitter are off along
    the way, and more the faster the tool moves.
    """
    few = spread_over(len(errors), MOST)
    errors, moments, levers, swept = errors[few], moments[few], levers[few], swept[few]
    best = (-np.inf, 0.0, np.zeros(turning.size))
    singles = np.eye(turning.size)[turning]
    cost = np.log(max(len(singles), 1)) + LONE
    joints = [
        (levers * gears, gears, price)
        for gears, price in ((turning * 1.0, 0.0), *((one, cost) for one in singles))
    ]
    for moved, gears, price in (*joints, (swept[..., None], np.zeros(turning.size), 0.0)):
        lever = np.einsum('kin,kjn->kij', moved, moved)
        reach = max(float(np.trace(lever, axis1=1, axis2=2).mean()) / 3, EMPTY)
        for share in SHARES if reach > EMPTY else SHARES[:1]:
            shape = (1.0 - share) * np.eye(3) + share * lever / reach
            size = _size(errors, moments, shape)
            likely = _likelihood(errors, moments + size**2 * shape) - price * (share > 0.0)
            each = size * np.sqrt(np.array([1.0 - share, share / reach]))
            best = max(best, (likely, float(each[0]), each[1] * gears), key=lambda one: one[0])
    fixed = errors.T @ errors / len(errors)
    still = max(_likelihood(errors, moments + part * fixed) for part in PARTS)
    return Spread(best[1], best[2], bool(best[2].any()) and best[0] > still + CERTAIN)


def _likelihood(errors: Array, covariances: Array) -> float:
    """Return how likely errors (K, 3) of given covariances (K, 3, 3) are, as a logarithm."""
    whole = covariances + NANOMETRE**2 * np.eye(3)
    solved = np.linalg.solve(whole, errors[..., None])[..., 0]
    return -float(((errors * solved).sum(axis=1) + np.linalg.slogdet(whole)[1]).sum()) / 2.0


def _in_common(problem: Problem, predicted: Predicted) -> float:
    """
    Return the share of what is left that neighbours have in common, beyond open directions and chance.

    What the instrument does differs from one sample to the next, what the arm does does not. Over few
    neighbours what changes fast shows, over many what is small: the number counts at which it is
    surest. Samples that err against each other have no white noise either. Where none shows anything, a
    motion may still hide some: as much as is believed where chance is least. Shifts count, or all that a
    contact sees.
    """
    estimates, regions = list[tuple[float, float, float]](), np.unique(predicted.region)
    sign = 1.0 if predicted.at_rest else -1.0
    sums: dict[int, list[Array]] = {}
    foreseen = np.sqrt(2.0 / regions.size)  # how far a variance of so many draws may be off
    for region in regions:
        here = np.flatnonzero((predicted.region == region) & predicted.good)
        for size, order, starts in _neighbours(problem, here):
            error, ways = predicted.left[order, :3], predicted.own[:, order, :3]
            open_ = np.einsum('rki,rki->ki', ways, ways)
            alone = np.stack([error**2, open_, predicted.seen[order, :3]])
            each = np.add.reduceat(alone, starts, axis=1)
            together = [
                np.add.reduceat(error, starts) ** 2,
                (np.add.reduceat(ways, starts, axis=1) ** 2).sum(axis=0),
                each[2] ** 2,
            ]
            # Of all pairs of a group: products of errors, those by open directions, how many pairs.
            pairs = (np.stack(together) - each).sum(axis=(1, 2))
            sums.setdefault(size, []).append(np.concatenate([pairs, each.sum(axis=(1, 2))]))
    for total in (np.sum(parts, axis=0) for parts in sums.values()):
        agree, open_ = total[:2] / max(total[2], 1.0) * (1.0, sign)
        square, each_open = total[3:5] / max(total[5], 1.0) * (1.0, sign)
        chance = np.hypot(square * np.sqrt(2.0 / max(total[2], 1.0)), open_ * foreseen)
        common = max(agree - open_, min(open_, 0.0) - agree)
        whole, chance = max(square - each_open, common, EMPTY), max(chance, EMPTY)
        estimates.append((common / chance, chance / whole, (agree - open_) / whole))
    if not estimates:
        return float(not predicted.at_rest)
    steps, chance, _ = max(estimates)
    if steps > AGREED:
        return steps * chance
    return 0.0 if predicted.at_rest else _believed(*min(one[1:] for one in estimates))


def _believed(chance: float, common: float) -> float:
    """Return the mean of `IN_COMMON` given what is seen in common, and its standard error."""
    likely = np.exp(-(((common - IN_COMMON) / chance) ** 2) / 2.0)
    return float(likely @ IN_COMMON / max(float(likely.sum()), EMPTY))


def _neighbours(
    problem: Problem, here: NDArray[np.int_]
) -> Iterator[tuple[int, NDArray[np.int_], NDArray[np.int_]]]:
    """Yield groups of neighbours in time or posture: most in one, samples in order, first of each."""
    if here.size < 2:
        return
    if not problem.at_rest:
        for size in NEIGHBOURS:
            yield size, here, np.arange(0, here.size, size)
        return
    q = np.concatenate([r.joints.at(r.seen.t)[0] for r in problem.recordings])[here]
    apart = ((q[:, None] - q[None]) ** 2).sum(axis=2)
    np.fill_diagonal(apart, np.inf)
    pairs = np.stack([np.arange(here.size), apart.argmin(axis=1)], axis=1)
    pairs = np.unique(np.sort(pairs, axis=1), axis=0)
    yield 2, here[pairs.ravel()], np.arange(0, pairs.size, 2)


def _size(errors: Array, moments: Array, shape: Array) -> float:
    """Return the factor of a shape's root that makes regions hold as many errors as they shall."""
    limit = float(chdtri(3, 1.0 - COVERED))
    # Of few errors the largest say more of those to come than their count: conformal level.
    wanted = min(COVERED * (1.0 + 1.0 / len(errors)), 1.0)

    # On the axes in which both are diagonal, every size asked for costs a division.
    root = np.linalg.inv(np.linalg.cholesky(np.broadcast_to(shape, moments.shape)))
    whole = moments + NANOMETRE**2 * np.eye(3)
    spread, turn = np.linalg.eigh(root @ whole @ np.swapaxes(root, -1, -2))
    along = (np.swapaxes(turn, -1, -2) @ (root @ errors[..., None]))[..., 0] ** 2
    # Axes first: a sum over three neighbours in memory takes longer than all divisions.
    along, spread = np.ascontiguousarray(along.T), np.ascontiguousarray(spread.T)

    def held(variance: float) -> float:
        return float(np.mean((along / (spread + variance)).sum(axis=0) <= limit))

    high = 100.0 * float((errors**2).sum(axis=1).max()) + NANOMETRE**2
    return float(np.sqrt(_least(held, wanted, high)))


def known_noise(problem: Problem, floor: NoiseFloor) -> float | None:
    """Return the instrument's noise [m], given with the data or seen in them; None without."""
    given = (recording.seen.sigma for recording in problem.recordings)
    if reported := [float(np.median(sigma)) for sigma in given if sigma is not None]:
        return float(np.mean(reported))
    return floor.sigma if floor.independent else None
