# Copyright 2026 weld_twin contributors
# SPDX-License-Identifier: Apache-2.0
"""
Do the formulas of the names hold? Free forms at their places, and noise that comes from a joint.

At their places lost motion of a joint is free in the gaps it trails in, and in angle, speed and
load by the way it goes; what the instrument and the frames do is a free smooth field over the
workspace. They are added to everything that is named, so that they need to find no more than what
the name misses.

A link that sticks and jumps, or an encoder that rounds, is too quick for any curve: between one
measurement and the next it has gone through whole periods. Its scatter still lies along the one
direction in which that joint moves the tool. Third differences take away what is slow. Their squares
are shared out among the instrument's noise, of each coordinate and along, beside and above the line
of sight, stamps that are off, along the tool's velocity, and every joint while it moves: variances
that add up, fitted to all products of two coordinates by least squares [1]_.

References
----------
.. [1] C. R. Rao, "Estimation of variance and covariance components in linear models", J. Amer.
   Statist. Assoc. 67, 1972.

"""

from __future__ import annotations

from typing import NamedTuple

import numpy as np
from scipy.linalg import cholesky, solve_triangular
from scipy.optimize import nnls

from ...arrays import Array
from ...effects.curves import QUANTITIES
from ...twin.features import Features
from ..algebra.independent_rows import measured_axes
from ..beliefs import Beliefs
from ..hypotheses.search import Search
from ..hypotheses.usual_errors import UsualErrors
from ..unseen.folds import STRETCHES, jackknife, least_gain
from ..unseen.groups import plain_groups
from ..unseen.unseen_stretches import Unseen

FIELD = 'instrument'
"""A free field over the workspace speaks against every formula: it is what each of them bends to."""


class Beside(NamedTuple):
    """What a free form predicts that the names do not."""

    at: str
    on: str
    """Place and dependence of the free form."""
    gain: float
    """Share of the squared error that it takes off on unseen data, by the way of leaving out,
    stretches of time or regions of posture, that shows less."""
    steady: float
    """The same in standard errors between the parts left out."""
    share: float
    """RMS of what it takes off over that of the largest effect named at this place."""


class Missed(NamedTuple):
    """What the formulas of the names miss."""

    scattered: tuple[Scatter, ...] = ()
    """Joints that noise comes from beyond doubt, largest first."""
    forms: tuple[Beside, ...] = ()
    """Free forms that predict beyond doubt what a name should."""

    @property
    def in_words(self) -> tuple[tuple[str, str], ...]:
        """Return the places where formulas do not hold, each with the free form that predicts most."""
        best: dict[str, Beside] = {}
        for one in self.forms:
            if one.at not in best or one.gain > best[one.at].gain:
                best[one.at] = one
        return tuple(
            (
                at,
                f'a free curve at {at}, depending on {one.on}, still predicts {100.0 * one.gain:.0f} % '
                'of what is left on unseen stretches: the formula of what was found does not hold',
            )
            for at, one in best.items()
        )


def missed(result: Search, unseen: Unseen, beliefs: Beliefs) -> Missed:
    """Return what the formulas of the effects found miss, as far as it is beyond doubt."""
    if result.dense:
        return Missed()
    loose = [
        one
        for one in sorted(scatter(result, unseen), key=lambda one: -one.share)
        if one.share >= beliefs.beaten_share and one.steady >= beliefs.scatter_sure
    ]
    forms = [one for one in beside_names(result, unseen) if _fails(one, beliefs)]
    if forms:
        # A field is what small errors everywhere do as well: names fail by what is beyond those.
        own = result.problem, result.scale, result.final
        small = UsualErrors.beside(*own, lambda fit: float(fit.residual.size))
        at = {(one.at, one.on) for one in forms}
        beyond = beside_names(result, unseen.along(small.columns))
        forms = [one for one in beyond if (one.at, one.on) in at and _fails(one, beliefs)]
    return Missed(tuple(loose), tuple(forms))


def _fails(one: Beside, beliefs: Beliefs) -> bool:
    """Return whether a free form takes off more than what a formula may miss."""
    if one.on == 'place':
        clear = one.gain >= beliefs.dependence_gain and one.steady >= beliefs.dependence_sure
        return clear and one.share >= beliefs.field_misses
    clear = one.gain >= beliefs.group_share and one.steady >= beliefs.structure_sure
    return clear and one.share >= beliefs.misfit_share


def beside_names(result: Search, unseen: Unseen) -> list[Beside]:
    """Return what free forms at the places of the effects found predict beside all of them."""
    problem, model = unseen.problem, result.final.model
    if problem.touched or not model.found:
        return []
    sizes = [unseen.rms(part) for part in unseen.targets[1:]]
    bases, places = unseen.bases(), {e.at for e in model.found}
    out = []
    for group in plain_groups(problem, model, unseen.scale):
        if group.at != FIELD and (group.on != 'direction' or group.at not in places):
            continue
        own = [s for e, s in zip(model.found, sizes, strict=False) if group.at in (e.at, FIELD)]
        reported = least_gain([base.gain(group.columns) for base in bases])
        share = float(np.sqrt(max(reported.fall, 0.0))) / max([*own, 1e-12])
        out.append(Beside(group.at, group.on, reported.share, reported.steady, share))
    return out


LEAST = 80
"""Measurements of a recording from which on variances are told: ten for each stretch."""
GROSS = 6.0
"""Squared length over its median from which on a difference holds a stray reading: of three
coordinates one in 500 does by chance."""
THIRD = 20.0
"""Variance of a third difference, 1 -3 3 -1, over that of what it is taken of."""
TINY = 1e-9
"""Part of the diagonal added to a system of variances: two joints may move the tool alike."""


class Scatter(NamedTuple):
    """Scatter along one joint."""

    joint: str
    share: float
    """Of the squared noise."""
    size: float
    """RMS in units of noise."""
    steady: float
    """The share in its standard errors between stretches."""


def scatter(result: Search, unseen: Unseen) -> list[Scatter]:
    """Return the scatter of every joint; none where the data cannot tell it from the instrument's."""
    problem, model = unseen.problem, result.final.model
    features = problem.features(model)
    parts = problem.by_sample(unseen.targets[0])
    static = any(recording.joints.static for recording in problem.recordings)
    if problem.touched or static or min(problem.samples) < LEAST:
        return []
    if any(len(measured_axes(part[:, :3].T)) < 3 for part in parts):
        return []
    noise = np.repeat([unseen.scale.position, unseen.scale.orientation], 3)
    sums = []
    for k, part in enumerate(parts):
        ways = problem.seen(k, _ways(features[k])) / noise[: problem.rows[k], None]
        left = np.diff(part, n=3, axis=0) / np.sqrt(THIRD)
        length = (left**2).sum(axis=1)
        usual = length < GROSS * np.median(length)
        if usual.sum() < STRETCHES:  # repeats with jumps between
            return []
        sums.append(_products(left[usual], ways[..., 1:-2][..., usual]))
    normal, right, sizes = (np.sum(parts, axis=0) for parts in zip(*sums, strict=True))
    whole = _shared_out(normal.sum(axis=0), right.sum(axis=0))
    error = _errors(normal, right)
    names = model.robot.joint_names
    return [
        Scatter(
            joint,
            float(whole[at] * sizes[at] / sizes[-2]),
            float(np.sqrt(whole[at] * sizes[at] / sizes[-1])),
            float(whole[at] / max(error[at], 1e-300)),
        )
        for at, joint in enumerate(names, start=whole.size - len(names))
    ]


def _ways(maker: Features) -> Array:
    """Return ways along which noise may lie, (K, 6, M): axes, sight, velocity, joints last."""
    view, count = maker.run.view, maker.at.size
    coordinates = np.broadcast_to(np.eye(6)[:, :, None], (6, 6, count))
    sight = np.zeros((3, 6, count))
    along = maker.run.poses.position.T
    beside = np.cross(along.T, (0.0, 0.0, 1.0)).T
    for k, way in enumerate((along, beside, np.cross(along.T, beside.T).T)):
        sight[k, :3] = way / np.maximum(np.linalg.norm(way, axis=0), 1e-9)
    joints = range(maker.twin.robot.n)
    columns = [maker.column(('q', i)) for i in joints]
    velocity = np.sum([column * view.qd[:, i] for i, column in enumerate(columns)], axis=0)
    moved = [np.abs(QUANTITIES['direction'](view, i)) * columns[i] for i in joints]
    return np.concatenate([coordinates, sight, velocity[None], np.array(moved)])


def _products(remaining: Array, ways: Array) -> tuple[Array, Array, Array]:
    """
    Return the variances' normal equations, (stretches, K, K) and (stretches, K), and sizes, (K + 2,).

    Sizes are the sums of squares of each way and of the differences, and the number of rows.

    remaining: differences in units of noise, shape (M, c).
    ways: shape (K, c, M).
    """
    cross = np.einsum('acm,bcm->abm', ways, ways, optimize=True) ** 2
    along = np.einsum('acm,mc->am', ways, remaining) ** 2
    ends = [part[0] for part in np.array_split(np.arange(len(remaining)), STRETCHES)]
    return (
        np.moveaxis(np.add.reduceat(cross, ends, axis=-1), -1, 0),
        np.moveaxis(np.add.reduceat(along, ends, axis=-1), -1, 0),
        np.array(
            [*(ways**2).sum(axis=(1, 2)), float((remaining**2).sum()), float(remaining.size)]
        ),
    )


def _shared_out(normal: Array, right: Array) -> Array:
    """Return the variances along every way, none below zero, shape (K,)."""
    size = np.sqrt(np.maximum(np.diag(normal), 1e-300))
    live = np.diag(normal) > 0.0
    out = np.zeros(right.size)
    scaled = (normal / np.outer(size, size))[np.ix_(live, live)]
    half = cholesky(scaled + TINY * np.eye(len(scaled)), lower=True)
    out[live] = nnls(half.T, solve_triangular(half, (right / size)[live], lower=True))[0]
    return np.asarray(out / size)


def _errors(normal: Array, right: Array) -> Array:
    """Return the standard errors of the variances, by leaving out one stretch at a time."""
    whole, pulls = normal.sum(axis=0), right.sum(axis=0)
    tries = np.array(
        [_shared_out(whole - a, pulls - b) for a, b in zip(normal, right, strict=True)]
    )
    return np.asarray(np.sqrt(jackknife(tries)))
