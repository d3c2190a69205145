# Copyright 2026 weld_twin contributors
# SPDX-License-Identifier: Apache-2.0
"""
The evidence for a verdict, gathered from the fits, from unseen data, and from what scatters.

Noise that comes from a joint is larger along the way that the joint moves the tool. A link that sticks
and jumps, or an encoder that rounds, is too quick for any curve. Third differences take away what is
slow; their squares are shared out among the instrument's noise, of each coordinate and along, beside
and above the line of sight, stamps that are off, along the tool's velocity, and every joint while it
moves: variances that add up, fitted to all products of two coordinates by least squares [1]_.

References
----------
.. [1] C. R. Rao, "Estimation of variance and covariance components in linear models", J. Amer.
   Statist. Assoc. 67, 1972.

"""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np
from numpy.typing import NDArray
from scipy.linalg import cholesky, solve_triangular
from scipy.optimize import nnls

from ...arm.robot import Robot
from ...arrays import Array
from ...effects.curves import QUANTITIES
from ...effects.effect import Effect
from ...effects.plausible import beyond
from ...recording import Recording
from ...twin.features import Features
from ..algebra.independent_rows import ENOUGH, measured_axes
from ..algebra.noise_floor import THIRD, NoiseFloor
from ..beliefs import Beliefs
from ..evidence import Evidence, Scatter, Search
from ..negligible import EMPTY, FLAT
from ..result import Family, Shrink, Site, Structure
from ..unseen.chance import chance_ratio, may_be_chance
from ..unseen.folds import STRETCHES, jackknife, ways_to_divide
from ..unseen.unseen_stretches import Unseen

LEAST = ENOUGH * STRETCHES
"""Measurements of a recording from which on variances are estimated."""
GROSS = 6.0
"""Squared length over its median from which a difference holds a stray: by chance one in 500 does."""


def gathered(
    result: Search,
    unseen: Unseen,
    leftover: Structure,
    shrink: Shrink,
    floor: NoiseFloor,
    families: tuple[Family, ...] | None,
    beliefs: Beliefs,
    with_strays: float,
) -> Evidence:
    """Return the evidence for a verdict; with_strays: unseen RMS with readings that are left out [m]."""
    robot, parts = result.final.model.robot, unseen.targets[1:]
    total = parts.sum(axis=0)
    whole = max(float(total @ total), EMPTY)
    recordings = result.problem.recordings
    return Evidence(
        candidate_sets=result.candidate_sets,
        structure=leftover,
        gap=shrink.rms_before_m,
        after=shrink.rms_after_m,
        floor=floor.rms_m,
        independent=floor.independent,
        parts=tuple(float(part @ part) / whole for part in parts),
        refused=tuple(_refused(robot, e) for e in result.refused if beyond(robot, e)),
        lacking=tuple(f'{Site.of(e)}, which was taken out of the library' for e in result.lacking),
        families=families,
        leverage=_leverage(unseen, floor),
        sizes=tuple(unseen.rms(part) for part in parts),
        wandered=() if result.dense else tuple(unseen.wandered().tolist()),
        missed=() if result.dense else tuple(tuple(each) for each in unseen.missed().tolist()),
        rows=result.effective(result.small),
        travel=tuple(np.max([np.ptp(r.joints.q, axis=0) for r in recordings], axis=0).tolist()),
        strays=_named(recordings, result.scale.left_out),
        with_strays=with_strays,
        scattered=scattered(result, unseen, beliefs),
        stations=any(recording.joints.static for recording in recordings),
    )


def _named(
    recordings: Sequence[Recording], strays: Sequence[NDArray[np.bool_]]
) -> tuple[str, ...]:
    """Return where readings stand out, as people count: stations from one."""
    return tuple(
        f'station {k + 1}' if own.joints.static else f't = {own.seen.t[k]:.2f} s'
        for own, part in zip(recordings, strays, strict=True)
        for k in np.flatnonzero(part)
    )


def _leverage(unseen: Unseen, floor: NoiseFloor) -> float:
    """Return the ratio to the floor that noise hardly ever exceeds; one where there are many rows."""
    if not may_be_chance(unseen.residual.size, 0.0):
        return 1.0
    ways = ways_to_divide(unseen.problem)
    columns = unseen.columns.written_out()
    return chance_ratio(columns, unseen.precision, ways, known=floor.independent)


def _refused(robot: Robot, effect: Effect) -> str:
    units = {parameter.name: parameter.unit for parameter in effect.parameters}
    values = ', '.join(
        f'{name} {value:.3g} {units[name]} (the limit of machines is {limit:.3g})'
        for name, value, limit in beyond(robot, effect)
    )
    return f'{Site.of(effect)} with {values}'


def scattered(result: Search, unseen: Unseen, beliefs: Beliefs) -> tuple[Scatter, ...]:
    """Return the joints that noise comes from beyond doubt, largest first."""
    return tuple(
        one
        for one in sorted(scatter(result, unseen), key=lambda one: -one.share)
        if one.share >= beliefs.beaten_share and one.steady >= beliefs.scatter_sure
    )


def scatter(result: Search, unseen: Unseen) -> list[Scatter]:
    """Return the scatter of every joint; none where the data cannot tell it from the instrument's."""
    problem, model = unseen.problem, result.final.model
    features = problem.features(model)
    parts = problem.by_sample(unseen.targets[0])
    static = any(recording.joints.static for recording in problem.recordings)
    if result.dense or problem.touched or static or min(problem.samples) < LEAST:
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
    shares, steady = whole * sizes[:-1] / sizes[-1], whole / np.maximum(error, EMPTY)
    joints = slice(-model.robot.n, None)  # the last of the ways
    own = shares[joints].tolist(), steady[joints].tolist()
    return [Scatter(*each) for each in zip(model.robot.joint_names, *own, strict=True)]


def _ways(maker: Features) -> Array:
    """Return ways along which noise may lie, (K, 6, M): axes, sight, velocity, joints last."""
    view, count = maker.run.view, maker.at.size
    coordinates = np.broadcast_to(np.eye(6)[:, :, None], (6, 6, count))
    sight = np.zeros((3, 6, count))
    along = maker.run.poses.position.T
    beside = np.cross(along.T, (0.0, 0.0, 1.0)).T
    for k, way in enumerate((along, beside, np.cross(along.T, beside.T).T)):
        sight[k, :3] = way / np.maximum(np.linalg.norm(way, axis=0), FLAT)
    joints = range(maker.twin.robot.n)
    columns = [maker.column(('q', i)) for i in joints]
    velocity = np.sum([column * view.qd[:, i] for i, column in enumerate(columns)], axis=0)
    moved = [np.abs(QUANTITIES['direction'](view, i)) * columns[i] for i in joints]
    return np.concatenate([coordinates, sight, velocity[None], np.array(moved)])


def _products(remaining: Array, ways: Array) -> tuple[Array, Array, Array]:
    """Return variances' equations (folds, K, K), (folds, K), and sizes of ways (K, c, M) and all."""
    cross = np.einsum('acm,bcm->abm', ways, ways, optimize=True) ** 2
    along = np.einsum('acm,mc->am', ways, remaining) ** 2
    ends = [part[0] for part in np.array_split(np.arange(len(remaining)), STRETCHES)]
    return (
        np.moveaxis(np.add.reduceat(cross, ends, axis=-1), -1, 0),
        np.moveaxis(np.add.reduceat(along, ends, axis=-1), -1, 0),
        np.append((ways**2).sum(axis=(1, 2)), (remaining**2).sum()),
    )


def _shared_out(normal: Array, right: Array) -> Array:
    """Return the variances along every way, none below zero, shape (K,)."""
    size = np.sqrt(np.maximum(np.diag(normal), EMPTY))
    live = np.diag(normal) > 0.0
    out = np.zeros(right.size)
    scaled = (normal / np.outer(size, size))[np.ix_(live, live)]
    half = cholesky(scaled + FLAT * np.eye(len(scaled)), lower=True)
    out[live] = nnls(half.T, solve_triangular(half, (right / size)[live], lower=True))[0]
    return np.asarray(out / size)


def _errors(normal: Array, right: Array) -> Array:
    whole, pulls = normal.sum(axis=0), right.sum(axis=0)
    folds = zip(normal, right, strict=True)
    tries = np.array([_shared_out(whole - a, pulls - b) for a, b in folds])
    return np.asarray(np.sqrt(jackknife(tries)))
