# Copyright 2026 weld_twin contributors
# SPDX-License-Identifier: Apache-2.0
"""Narrow lines of high order in waves of a joint's angle, looked for one by one."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from ...arrays import Array
from ...effects.effect import Effect
from ...twin.features import Features
from ..algebra.problem import Model, Problem, Scale
from ..beliefs import Beliefs
from ..hypotheses.still_joints import orders_told

LINES = 40
"""Lines at the most; the weakest of so many is far below what decides anything."""


@dataclass(frozen=True, eq=False)
class Waves:
    """
    Sine and cosine of every order of one joint, and what never changes from look to look.

    Attributes
    ----------
    columns : list of array, shape (c, M)
        d pose / d joint of every recording.
    masses : list of array, shape (c, M)
        The same, weighted by the noise.
    waves : list of array, shape (2 O, M)
        Single precision: their sums over thousands of stations are good to 1e-6.
    normal : array, shape (O, 2, 2)
    apart : float
        Half the resolution in orders that the range of motion allows.

    """

    joint: int
    columns: list[Array]
    masses: list[Array]
    waves: list[np.ndarray]
    normal: Array
    apart: float

    @classmethod
    def of(
        cls,
        problem: Problem,
        features: list[Features],
        scale: Scale,
        joint: int,
        orders: Array,
        least: float,
    ) -> Waves | None:
        """
        Return the waves of a joint, or None when it travels less than ``least`` [rad].

        Parameters
        ----------
        joint : int
            Counted from 0.
        orders : array, shape (K,) [1/rev]
            Orders to look at.
        least : float [rad]
            Travel below which nothing is looked for.

        """
        low = min(float(maker.view.q[:, joint].min()) for maker in features)
        high = max(float(maker.view.q[:, joint].max()) for maker in features)
        if high - low < least:
            return None
        columns, masses, waves = [], [], []
        normal = np.zeros((orders.size, 2, 2))
        for r, maker in enumerate(features):
            column = problem.seen(r, maker.column(('q', joint)))
            mass = problem.informed(r, column, scale)
            angle = orders[:, None] * maker.view.q[:, joint]
            sine, cosine = np.sin(angle), np.cos(angle)
            weight = (column * mass).sum(axis=0)
            squares = sine**2 @ weight
            cross = (sine * cosine) @ weight
            terms = [squares, cross, cross, weight.sum() - squares]
            normal += np.stack(terms, -1).reshape(-1, 2, 2)
            columns.append(column)
            masses.append(mass)
            waves.append(np.concatenate([sine, cosine]).astype(np.float32))
        normal += 1e-9 * np.eye(2) * np.trace(normal[0])
        apart = float(np.ceil(np.pi / (high - low)))
        return cls(joint, columns, masses, waves, normal, apart)

    def peak(
        self, residual: list[Array], free: NDArray[np.bool_]
    ) -> tuple[float, int, int, Array]:
        """
        Return the strongest order: chi-square, joint, its place among the orders, (sine, cosine).

        ``free``, shape (O,), marks the orders that may enter.
        """
        pull = np.zeros(2 * free.size)
        for mass, part, wave in zip(self.masses, residual, self.waves, strict=True):
            pull += wave @ (mass * part).sum(axis=0).astype(np.float32)
        right = np.where(free, pull.reshape(2, -1), 0.0).T
        step = np.linalg.solve(self.normal, right[..., None])[..., 0]
        chi = (right * step).sum(axis=-1)
        k = int(np.argmax(chi))
        return float(chi[k]), self.joint, k, step[k]


def with_lines(problem: Problem, model: Model, scale: Scale, beliefs: Beliefs) -> Model:
    """
    Return the model with narrow lines above the dense orders of its waves.

    The score statistic of sine and cosine at every order costs one small product per joint; the
    strongest line enters, the residual it explains is taken off, and the look is repeated.
    """
    kinds = [effect.waves for effect in model.found if effect.waves is not None]
    if not kinds:
        return model
    residual = problem.residuals(model)
    features = problem.features(model)
    orders = np.arange(kinds[0].dense + 1.0, kinds[0].highest + 1.0)
    each = [
        Waves.of(problem, features, scale, i, orders, beliefs.wave_range)
        for i in range(model.robot.n)
    ]
    waves = {w.joint: w for w in each if w is not None}
    free = {i: _free(model, features, w, orders) for i, w in waves.items()}
    found = list(model.found)
    for _ in range(LINES if waves else 0):
        chi, i, k, step = max(
            (w.peak(residual, free[i]) for i, w in waves.items()), key=lambda item: item[0]
        )
        if chi < beliefs.line_chi2:
            break
        for r, maker in enumerate(features):
            angle = orders[k] * maker.view.q[:, i]
            wave = step[0] * np.sin(angle) + step[1] * np.cos(angle)
            residual[r] = residual[r] - waves[i].columns[r] * wave
        free[i] = free[i] & (np.abs(orders - orders[k]) >= waves[i].apart)
        found = _with_order(found, model.robot.joint_names[i], float(orders[k]))
    return model.with_found(tuple(found))


def _free(
    model: Model, features: list[Features], waves: Waves, orders: Array
) -> NDArray[np.bool_]:
    """Return which orders no wave of the joint is too close to, shape (O,)."""
    joint = model.robot.joint_names[waves.joint]
    free: NDArray[np.bool_] = orders <= orders_told(features, joint)
    for effect in model.found:
        if effect.site == joint:
            for order in effect.orders():
                free &= np.abs(orders - order) >= waves.apart
    return free


def _with_order(found: list[Effect], joint: str, order: float) -> list[Effect]:
    return [
        effect.with_orders(np.append(effect.orders(), order))
        if effect.waves and effect.site == joint
        else effect
        for effect in found
    ]
