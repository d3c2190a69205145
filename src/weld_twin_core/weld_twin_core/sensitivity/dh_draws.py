# Copyright 2026 weld_twin contributors
# SPDX-License-Identifier: Apache-2.0
"""
How far very many draws of the DH values move the tool along one seam, exactly.

The tool point is carried down the chain for all draws of a block at once, two of its coordinates
in one complex number. A turn about the first axis is the same for all draws and comes last.

Products of the joints' sines and cosines are the *features* of a sample, and positions of any draw
are linear in them. Along a smooth seam the features are nearly dependent: as functions of the
sample they span a dozen dimensions to rounding. Then positions are known from as many samples by
one matrix product. Those samples and that matrix come from a pivoted QR factorisation of the
features [1]_, whose remainder bounds the error.

References
----------
.. [1] H. Cheng et al., "On the compression of low rank matrices", SIAM J. Sci. Comput. 26, 2005
   (the interpolative decomposition); of random mixtures: P.-G. Martinsson, V. Rokhlin, M. Tygert,
   "A randomized algorithm for the decomposition of matrices", ACHA 30, 2011.

"""

from __future__ import annotations

from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray
from scipy.linalg import qr, solve_triangular

from ..arm.bulk.buffers import unbuffered
from ..arm.robot import Robot
from ..arm.rotation import rotation_matrix
from ..arrays import Array
from ..errors import ModelError

_ROUNDING = 1e-14
"""Remainder of the features, relative to the strongest, that counts as none."""
_NEGLIGIBLE = 1e-13
"""What features may differ from those determined by a few samples, relative to the largest."""
_MIXTURES = 48
"""Mixtures that stand for all features; a motion with more independent ones is worked on whole."""
_BLOCK = 504
"""Draws that are carried down the chain at once; a few of such arrays fit the processor's cache."""


class DhDraws(NamedTuple):
    """Draws of the DH values of every row, shape (D, n) each [rad, m]."""

    theta: Array
    d: Array
    a: Array
    alpha: Array


class SeamDraws:
    """
    A robot of revolute joints at samples (N, n) [rad] of a seam, ready for draws of its DH values.

    Raises ModelError: it has modified rows, Hayati angles, joints that slide or a positioner.
    """

    def __init__(self, robot: Robot, q: Array) -> None:
        plain = robot.convention == 'standard' and not robot.behind
        if not plain or robot.prismatic.any() or robot.beta.any():
            raise ModelError(
                f'robot {robot.name!r} must have standard rows, revolute joints, no beta and no '
                'positioner for fast draws of its DH values; the twin runs draws of any robot'
            )
        self.robot = robot
        self._count = len(q)
        turn = rotation_matrix(q[:, :1] * np.array([0.0, 0.0, 1.0]))
        self._first = robot.T_world_base[:3, :3] @ turn
        self.samples: NDArray[np.int_] = np.arange(len(q))
        """Those at which draws are worked out."""
        self.spread: Array | None = None
        """From values at those to values at all samples; None where they are all."""
        result = _determining(_features(q[:, 1:]))
        if result is not None:
            self.samples, self.spread = result
        self._phases = np.exp(1j * q[self.samples].T)[..., None]
        nominal = DhDraws(*(getattr(robot, key)[None] for key in DhDraws._fields))
        self._nominal = self._tool_points(nominal)

    def deviations(self, draws: DhDraws) -> Array:
        """Return the tool point's deviations from nominal in the world, (D, N, 3) [m]."""
        out = np.empty((len(draws.theta), self._count, 3))
        with unbuffered():
            for start in range(0, len(out), _BLOCK):
                part = slice(start, start + _BLOCK)
                away = (
                    self._tool_points(DhDraws(*(values[part] for values in draws))) - self._nominal
                )
                if self.spread is not None:
                    away = self.spread @ away
                away = np.swapaxes(away, 1, 2)
                out[part] = np.einsum('nij,jdn->dni', self._first, away, optimize=True)
        return out

    def _tool_points(self, draws: DhDraws) -> Array:
        """Return tool points before the first joint's turn, shape (3, S, D)."""
        turns, twists = (np.cos(v.T) + 1j * np.sin(v.T) for v in (draws.theta, draws.alpha))
        yz, xy, spin = np.empty((3, len(self.samples), len(draws.theta)), dtype=complex)
        x, yz.real, yz.imag = self.robot.T_flange_tool[:3, 3]
        for i in range(self.robot.n - 1, -1, -1):
            yz *= twists[i]
            np.add(x, draws.a[:, i], out=xy.real)
            xy.imag = yz.real
            xy *= np.multiply(self._phases[i], turns[i], out=spin) if i > 0 else turns[i]
            x = xy.real
            yz.real = xy.imag
            yz.imag += draws.d[:, i]
        return np.stack([x, yz.real, yz.imag])


def _determining(features: Array) -> tuple[NDArray[np.int_], Array] | None:
    """
    Return samples, and the matrix (N, S) that turns values there into values everywhere.

    The factorisation is of random mixtures of the features, which depend on each other as the
    features do. None if the samples are half of all or more, or if the features themselves differ
    from those so determined by more than rounding.
    """
    mixing = np.random.default_rng(0).random((_MIXTURES, len(features))) - 0.5
    mixtures = mixing @ features
    upper, order = qr(mixtures, mode='r', pivoting=True, check_finite=False)
    strength = np.abs(np.diagonal(upper))
    rank = int((strength > _ROUNDING * strength[0]).sum())
    if 2 * rank >= features.shape[1]:
        return None
    spread = np.empty((rank, features.shape[1]))
    spread[:, order[:rank]] = np.eye(rank)
    spread[:, order[rank:]] = solve_triangular(upper[:rank, :rank], upper[:rank, rank:])
    off = np.abs(features[:, order[:rank]] @ spread - features).max()
    if off > _NEGLIGIBLE * np.abs(features).max():
        return None
    return order[:rank], np.ascontiguousarray(spread.T)


def _features(q: Array) -> Array:
    """Return products of (1, c, s), shape (3^joints, N), the last joint varying fastest."""
    out = np.ones((1, len(q)))
    for angle in q.T[::-1]:
        own = np.stack([np.ones_like(angle), np.cos(angle), np.sin(angle)])
        out = (own[:, None] * out[None]).reshape(-1, len(q))
    return out
