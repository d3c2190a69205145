# Copyright 2026 weld_twin contributors
# SPDX-License-Identifier: Apache-2.0
"""
Cubic curves through samples.

scipy has them too, but with its interpolation come sparse matrices, optimizers and spatial trees: a
third of a second at every start of a program, for two dozen lines.
"""

from __future__ import annotations

import numpy as np

from .arrays import Array


def hermite(x: Array, y: Array, slope: Array, at: Array) -> tuple[Array, Array]:
    """Return values and slopes, at.shape + (n,), of cubic pieces given by those at their ends."""
    low = np.clip(np.searchsorted(x, at, side='right') - 1, 0, x.size - 2)
    width = (x[low + 1] - x[low])[..., None]
    s = (at - x[low])[..., None]
    chord = (y[low + 1] - y[low]) / width
    first, last = slope[low], slope[low + 1]
    bend = (first + last - 2.0 * chord) / width
    c3, c2 = bend / width, (chord - first) / width - bend
    return y[low] + s * (first + s * (c2 + s * c3)), first + s * (2.0 * c2 + 3.0 * s * c3)


def natural_slopes(x: Array, y: Array) -> Array:
    """Return slopes (N, n) of the natural spline through few knots (N,), by one full matrix."""
    h, count = np.diff(x), x.size
    chord = np.diff(y, axis=0) / h[:, None]
    system, wanted = np.zeros((count, count)), np.zeros(y.shape)
    inner = np.arange(1, count - 1)
    system[inner, inner - 1], system[inner, inner + 1] = h[1:], h[:-1]
    system[inner, inner] = 2.0 * (h[:-1] + h[1:])
    wanted[1:-1] = 3.0 * (h[1:, None] * chord[:-1] + h[:-1, None] * chord[1:])
    system[0, :2], system[-1, -2:] = (2.0, 1.0), (1.0, 2.0)
    wanted[0], wanted[-1] = 3.0 * chord[0], 3.0 * chord[-1]
    return np.asarray(np.linalg.solve(system, wanted))
