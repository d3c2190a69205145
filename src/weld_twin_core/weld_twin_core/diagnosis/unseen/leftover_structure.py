# Copyright 2026 weld_twin contributors
# SPDX-License-Identifier: Apache-2.0
"""
Is something left that no named effect explains?

Generic columns that know no physics (each joint bent by splines of its own angle, by its speed
and acceleration; the frame moved by splines of time and by the place in the workspace) are given
to the model. If they predict unseen stretches better, the residual has structure, and the columns
that bring it say what it depends on.
"""

from __future__ import annotations

from collections.abc import Iterator, Sequence
from dataclasses import dataclass

import numpy as np

from ...arrays import Array
from ...twin.features import Features
from ..algebra.problem import Model, Problem, Scale
from ..beliefs import Beliefs
from .chance import Candidates, chance_gain, may_be_chance
from .unseen_stretches import RIDGES, Unseen

KNOTS = 8
"""Bumps over a range of angle or time: a bump is as wide as an eighth of it, finer ones would
follow the noise."""
TURNS = 1e-4
"""Travel [rad, m] from which on a joint counts as moving."""
TOLD = 3
"""Things that what remains depends on, told at the most; further ones are echoes of these."""


@dataclass(frozen=True, eq=False)
class Structure:
    """
    What generic columns find.

    Attributes
    ----------
    rms_m : float
        RMS error on unseen stretches with them, [m].
    gain : float
        Share of the squared error on unseen stretches that they take away.
    sure : float
        The gain over its standard error between stretches.
    chance : float
        Share that the best of them hardly ever takes off noise alone; 0 where rows are many.

    """

    rms_m: float
    gain: float
    sure: float
    depends_on: tuple[str, ...]
    chance: float = 0.0


def structure(unseen: Unseen, model: Model, beliefs: Beliefs) -> Structure:
    """Return what generic columns add to a model on stretches not used for fitting."""
    base = unseen.base(range(len(model.found)))
    groups = list(_generic(unseen.problem, model, unseen.scale))
    result = [(base.gain(columns), name) for name, columns in groups]
    result.sort(key=lambda item: -item[0].share)
    best = result[0][0]
    least, certain = beliefs.dependence_gain, beliefs.dependence_sure
    names = tuple(n for one, n in result[:TOLD] if one.share > least and one.steady > certain)
    chance = 0.0
    counts = best.share > beliefs.structure_gain and best.steady > beliefs.blatant_sure
    if counts and may_be_chance(unseen.residual.size, best.share):
        each = (columns for _, columns in groups)
        tried = Candidates(
            unseen.columns.written_out(), unseen.precision, each, RIDGES, [unseen.labels]
        )
        chance = chance_gain(tried, beliefs.blatant_sure)
    return Structure(best.rms_m, best.share, best.steady, names, chance)


def _generic(problem: Problem, model: Model, scale: Scale) -> Iterator[tuple[str, Array]]:
    """Yield named groups of whitened generic columns, (E, rows) of unit mean square."""
    features = problem.features(model)
    for i, joint in enumerate(model.robot.joint_names):
        angles = [maker.run.view.q[:, i] for maker in features]
        low, high = min(float(q.min()) for q in angles), max(float(q.max()) for q in angles)
        if high - low >= TURNS:
            each = [bumps(q, low, high) for q in angles]
            yield f'the angle of {joint}', of_joint(problem, features, scale, i, each)
            each = [_motion(maker, i) for maker in features]
            motion = of_joint(problem, features, scale, i, each)
            yield f'the speed and acceleration of {joint}', motion
    if problem.untracked and not problem.placed:
        return  # no instrument measured, and nothing shows where the base stands
    time, steps, place = ([f(maker) for maker in features] for f in (_time, _steps, _place))
    yield 'time', _of_pose(problem, features, scale, time)
    yield 'a step in time', _of_pose(problem, features, scale, steps)
    yield 'the place in the workspace', _of_pose(problem, features, scale, place)
    seen = 'seen from the tool'
    yield f'time, {seen}', _of_pose(problem, features, scale, time, of_tool=True)
    yield f'a step in time, {seen}', _of_pose(problem, features, scale, steps, of_tool=True)


def of_joint(
    problem: Problem, features: Sequence[Features], scale: Scale, i: int, each: Sequence[Array]
) -> Array:
    """
    Return what a joint does to the tool if it moves by some amounts, (E, rows), in units.

    Parameters
    ----------
    i : int
        The joint, counted from 0.
    each : sequence of array, shape (E, M)
        The amounts, for every recording; of stations the side alone, where paths have more.

    """
    most = max(map(len, each))
    parts = [
        problem.seen(k, maker.column(('q', i)))[None] * _padded(values, most)[:, None, :]
        for k, (maker, values) in enumerate(zip(features, each, strict=True))
    ]
    return in_units(problem.whitened(parts, scale))


def _padded(values: Array, most: int) -> Array:
    """Return as many rows for stations as for paths: of the motion they show its side alone."""
    if len(values) == most:
        return values
    out = np.zeros((most, values.shape[1]))
    out[SIDE] = values[0]
    return out


def _of_pose(
    problem: Problem,
    features: Sequence[Features],
    scale: Scale,
    each: Sequence[Array],
    *,
    of_tool: bool = False,
) -> Array:
    parts = []
    for k, (maker, values) in enumerate(zip(features, each, strict=True)):
        block = np.zeros((3, values.shape[0], 6, values.shape[1]))
        axes = maker.run.poses.rotation if of_tool else np.eye(3)[None]
        for j in range(3):
            block[j, :, :3] = (axes[:, :, j].T)[None] * values[:, None, :]
        parts.append(problem.seen(k, block.reshape(-1, 6, values.shape[1])))
    return in_units(problem.whitened(parts, scale))


def in_units(columns: Array) -> Array:
    """Return columns, (E, rows), scaled to unit mean square, without those that show nothing."""
    size = np.sqrt((columns**2).mean(axis=1, keepdims=True))
    live = size[:, 0] > 1e-12
    return np.asarray(columns[live] / size[live])


SIDE = 2
"""Row of `_motion` that holds the direction."""


def bumps(x: Array, low: float, high: float, count: int = KNOTS) -> Array:
    """Return smooth bumps over a range, shape (count, M)."""
    width = (high - low) / (count - 1)
    centres = np.linspace(low, high, count)[:, None]
    return np.exp(-0.5 * ((x - centres) / width) ** 2)


def _motion(maker: Features, i: int) -> Array:
    view = maker.run.view
    if view.static or view.t.size < 4:
        step = np.sign(np.diff(view.q[:, i], prepend=view.q[:1, i]))
        return np.stack([step])
    speed = view.qd[:, i]
    size = max(float(np.abs(speed).max()), 1e-12)
    acceleration = np.gradient(speed, view.t)
    direction = np.tanh(speed / (0.02 * size))
    return np.stack([speed, np.abs(speed), direction, acceleration, speed * np.abs(speed)])


def _time(maker: Features) -> Array:
    t = maker.run.view.elapsed
    return bumps(t, float(t[0]), float(max(t[-1], t[0] + 1e-9)))


def _steps(maker: Features) -> Array:
    share = np.linspace(0.0, 1.0, maker.at.size)
    return (share > np.linspace(0.08, 0.92, 12)[:, None]).astype(np.float64)


def _place(maker: Features) -> Array:
    p = maker.run.poses.position
    x = ((p - p.mean(axis=0)) / np.maximum(p.std(axis=0), 1e-9)).T
    pairs = [x[a] * x[b] for a in range(3) for b in range(a, 3)]
    cubes = [x[a] ** 3 for a in range(3)]
    return np.stack([*x, *pairs, *cubes])
