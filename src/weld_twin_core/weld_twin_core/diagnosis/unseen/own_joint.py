# Copyright 2026 weld_twin contributors
# SPDX-License-Identifier: Apache-2.0
"""
Does the formula of an effect hold at its own joint?

Columns that follow the joint's angle forth and back, its way since it last turned round, its speed
and its load are given to the whole model. A formula that holds leaves them nothing on unseen
stretches; one that stands in for another leaves what the two do not share.
"""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np

from ...arrays import Array
from ...effects.curve import QUANTITIES
from ...twin.features import Features
from ..algebra.problem import Model, Problem, Scale
from .leftover_structure import best_of, bumps, in_units
from .unseen_stretches import Base, Unseen

BENDS = 5
"""Bumps over the range of the angle, forth and back each: half a period of a wave."""
TURNS = (1e-3, 5e-3, 2.5e-2)
"""Ways [rad or m] after a reversal over which something lost may come back: play of a tight gear,
wind-up of a soft one, and a tenth of a usual move."""
SLOW = (0.03, 0.3)
"""Shares of the highest speed below which friction may rise."""
MOVING = 2e-3
"""Speed [rad/s or m/s] below which noise makes the direction."""


def free_columns(unseen: Unseen, model: Model, joint: str) -> Array | None:
    """
    Return free columns at one joint, (E, rows), in units of noise and of unit mean square.

    Parameters
    ----------
    unseen : Unseen
    model : Model
        Everything is taken about it.
    joint : str
        By name.

    Returns
    -------
    array or None
        None where the joint rests, or some recordings are stations and others paths.

    """
    features = unseen.problem.features(model)
    index = model.robot.joint_names.index(joint)
    columns = _columns(unseen.problem, features, unseen.scale, index)
    return columns if columns is not None and columns.size else None


def added(base: Base, columns: Array) -> tuple[float, float]:
    """
    Return what columns add to a model on unseen stretches.

    Parameters
    ----------
    base : Base
        The model, fitted with each stretch left out in turn.
    columns : array, shape (E, rows)

    Returns
    -------
    (gain, sure) : (float, float)
        Share of the squared error that they take away, and the same in standard errors between
        stretches.

    """
    before, labels = base.unseen.squares(base.residual), base.unseen.trusted_labels()
    gain, sure, _ = best_of(base, columns, before, labels)
    return gain, sure


def _columns(
    problem: Problem, features: Sequence[Features], scale: Scale, index: int
) -> Array | None:
    angles = [maker.run.view.q[:, index] for maker in features]
    low, high = min(float(q.min()) for q in angles), max(float(q.max()) for q in angles)
    still = {maker.run.view.static or maker.at.size < 4 for maker in features}
    if high - low < 1e-4 or len(still) > 1:
        return None
    shapes = _of_stations if still.pop() else _of_motion
    parts = []
    for k, maker in enumerate(features):
        values = shapes(maker, index, low, high)
        parts.append(problem.seen(k, maker.column(('q', index)))[None] * values[:, None, :])
    return in_units(problem.whitened(parts, scale))


def _of_stations(maker: Features, index: int, low: float, high: float) -> Array:
    q = maker.run.view.q[:, index]
    side = np.sign(np.diff(q, prepend=q[:1]))
    load = QUANTITIES['load'](maker.view, index)
    return np.stack([*bumps(q, low, high, BENDS), side, side * (q - q.mean()), load, load * side])


def _of_motion(maker: Features, index: int, low: float, high: float) -> Array:
    view = maker.run.view
    q, speed = view.q[:, index], view.qd[:, index]
    way = np.tanh(speed / MOVING)
    over = bumps(q, low, high, BENDS)
    since = since_turned(q, speed)
    fastest = max(float(np.abs(speed).max()), 1e-12)
    load = QUANTITIES['load'](maker.view, index)
    return np.stack(
        [
            *(over * (1.0 + way)),
            *(over * (1.0 - way)),
            *(way * np.exp(-since / length) for length in TURNS),
            *(way * np.exp(-np.abs(speed) / (share * fastest)) for share in SLOW),
            speed,
            speed * np.abs(speed),
            load,
            load * way,
            way * view.elapsed,
        ]
    )


def since_turned(q: Array, speed: Array) -> Array:
    """
    Return how far a joint has come since it last turned round, shape (M,).

    Parameters
    ----------
    q, speed : array, shape (M,)
        Position and velocity; slower than `MOVING` the joint keeps its direction.

    """
    each = np.arange(q.size)
    last = np.maximum.accumulate(np.where(np.abs(speed) > MOVING, each, 0))
    side = np.sign(speed[last])
    turned = np.flatnonzero(np.diff(side, prepend=side[:1]) != 0.0)
    start = np.zeros(q.size, dtype=int)
    start[turned] = turned
    return np.asarray(np.abs(q - q[np.maximum.accumulate(start)]))
