# Copyright 2026 weld_twin contributors
# SPDX-License-Identifier: Apache-2.0
"""Whether measured positions can belong to these joint angles at all."""

from __future__ import annotations

from itertools import permutations, product

import numpy as np

from weld_twin_core.arm.chain import forward
from weld_twin_core.arm.robot import Robot
from weld_twin_core.arrays import Array

_ROUNDS = 30
"""Rounds of fitting the frames in turn; a guess of units needs no more digits."""
_FIRST = 3
"""Rounds after which the best of several beginnings is told from the others."""
_FAR = 0.02
"""Share of the measured span that a fit may leave before others are begun elsewhere: units differ by
more, and errors of arms are less."""
_CORNERS = tuple(
    turn
    for order in permutations(range(3))
    for signs in product((1.0, -1.0), repeat=3)
    if np.linalg.det(turn := np.diag(signs) @ np.eye(3)[list(order)]) > 0.0
)
"""The 24 turns that put axes on axes: every turn is within 63 degrees of one of them."""


def misfit(robot: Robot, q: Array, position: Array) -> Array:
    """
    Return the distance of each position from the nominal arm, shape (M,) [m].

    Measuring frame and tool point are fitted, in turns: a rigid fit (Kabsch), then a linear one.

    q: shape (M, n).
    position: shape (M, 3) [m].
    """
    T = forward(robot, q)
    flange, turn = T[:, :3, 3], T[:, :3, :3]
    seen, count = position - position.mean(axis=0), len(q)
    # All that the rounds need are sums over the rows, so a long table is read once.
    turns, flanges = turn.sum(axis=0), flange.sum(axis=0)
    seen_turn = (seen.T @ turn.reshape(count, 9)).reshape(3, 3, 3)
    seen_flange = seen.T @ flange
    turned_flange = np.einsum('mbc,mb->c', turn, flange)

    def fitted(R: Array, rounds: int) -> tuple[Array, Array]:
        """Return what is left of every position, and the turn of the frame after so many rounds."""
        for _ in range(rounds):
            cross, own = R @ turns, count * np.eye(3)
            normal = np.block([[own, cross.T], [cross, own]])
            right = [np.einsum('ab,abc->c', R, seen_turn) - turned_flange, -R @ flanges]
            solution = np.linalg.lstsq(normal, np.concatenate(right), rcond=None)[0]
            last, R = R, _best_turn(seen_flange + seen_turn @ solution[:3])
        rest = seen - (flange + turn @ solution[:3]) @ last.T - solution[3:]
        return np.asarray(np.linalg.norm(rest, axis=1)), R

    result, _ = fitted(_best_turn(seen_flange), _ROUNDS)
    if np.median(result) > _FAR * np.linalg.norm(seen, axis=1).max(initial=0.0):
        # Few axes bring the flange along an arc: then the turns have ends that are not the best.
        begun = [fitted(turn, _FIRST) for turn in _CORNERS]
        _, R = min(begun, key=lambda one: float(np.median(one[0])))
        result = min(result, fitted(R, _ROUNDS)[0], key=np.median)
    return result


def _best_turn(products: Array) -> Array:
    """Return the rotation (3, 3) that turns points closest to others (Kabsch), by their products."""
    u, _, vt = np.linalg.svd(products)
    sign = np.sign(np.linalg.det(u @ vt))
    return np.asarray(u @ np.diag([1.0, 1.0, sign]) @ vt)
