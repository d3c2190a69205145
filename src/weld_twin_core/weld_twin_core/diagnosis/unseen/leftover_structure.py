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

from collections.abc import Iterator
from dataclasses import dataclass

import numpy as np

from ...arrays import Array
from ...twin.features import Features
from ..algebra.problem import Model, Problem, Scale
from ..beliefs import Beliefs
from .unseen_stretches import Unseen

KNOTS = 8
"""Bumps over a range of angle or time: a bump is as wide as an eighth of it, finer ones would
follow the noise."""
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
    depends_on : tuple of str

    """

    rms_m: float
    gain: float
    sure: float
    depends_on: tuple[str, ...]


def structure(unseen: Unseen, model: Model, beliefs: Beliefs) -> Structure:
    """
    Return what generic columns add to a model on stretches not used for fitting.

    Parameters
    ----------
    unseen : Unseen
        What models with more or fewer effects predict on stretches left out.
    model : Model
        What is believed so far; everything is taken about it.
    beliefs : Beliefs
        The numbers that decide.

    """
    base = unseen.base(range(len(model.found)))
    found = [
        (base.gain(columns), name)
        for name, columns in _generic(unseen.problem, model, unseen.scale)
    ]
    found.sort(key=lambda item: -item[0].share)
    best = found[0][0]
    least, certain = beliefs.dependence_gain, beliefs.dependence_sure
    names = tuple(n for one, n in found[:TOLD] if one.share > least and one.steady > certain)
    return Structure(best.rms_m, best.share, best.steady, names)


def _generic(problem: Problem, model: Model, scale: Scale) -> Iterator[tuple[str, Array]]:
    """Yield named groups of whitened generic columns, (E, rows) of unit mean square."""
    features = problem.features(model)
    for i, joint in enumerate(model.robot.joint_names):
        angle = _column_group(problem, features, scale, i, _angle)
        if angle is not None:
            yield f'the angle of {joint}', angle
        motion = _column_group(problem, features, scale, i, _motion)
        if motion is not None:
            yield f'the speed and acceleration of {joint}', motion
    if problem.untracked and not problem.placed:
        return  # no instrument measured, and nothing shows where the base stands
    yield 'time', _pose_group(problem, features, scale, _time)
    yield 'a step in time', _pose_group(problem, features, scale, _steps)
    yield 'the place in the workspace', _pose_group(problem, features, scale, _place)
    yield 'time, seen from the tool', _pose_group(problem, features, scale, _time, of_tool=True)
    yield (
        'a step in time, seen from the tool',
        _pose_group(problem, features, scale, _steps, of_tool=True),
    )


def _column_group(
    problem: Problem, features: list[Features], scale: Scale, i: int, regressors: object
) -> Array | None:
    lows = min(float(m.run.view.q[:, i].min()) for m in features)
    highs = max(float(m.run.view.q[:, i].max()) for m in features)
    if highs - lows < 1e-4:
        return None
    each = [regressors(maker, i, lows, highs) for maker in features]  # type: ignore[operator]
    if any(values.size == 0 for values in each):
        return None
    parts = [
        problem.seen(k, maker.column(('q', i)))[None] * values[:, None, :]
        for k, (maker, values) in enumerate(zip(features, _alike_in_number(each), strict=True))
    ]
    return in_units(problem.whitened(parts, scale))


def _alike_in_number(each: list[Array]) -> list[Array]:
    """Return as many rows for stations as for paths: of the motion they show its side alone."""
    most = max(len(values) for values in each)
    out = []
    for values in each:
        if len(values) < most:
            padded = np.zeros((most, values.shape[1]))
            padded[SIDE] = values[0]
            out.append(padded)
        else:
            out.append(values)
    return out


def _pose_group(
    problem: Problem,
    features: list[Features],
    scale: Scale,
    regressors: object,
    *,
    of_tool: bool = False,
) -> Array:
    parts = []
    for k, maker in enumerate(features):
        values = regressors(maker)  # type: ignore[operator]
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


def _angle(maker: Features, i: int, low: float, high: float) -> Array:
    return bumps(maker.run.view.q[:, i], low, high)


def _motion(maker: Features, i: int, low: float, high: float) -> Array:
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
