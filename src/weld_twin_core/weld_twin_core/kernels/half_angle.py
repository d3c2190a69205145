# SPDX-FileCopyrightText: weld_twin contributors
# SPDX-License-Identifier: Apache-2.0
"""
Sine and cosine from multiplications and one small matrix product.

numpy takes sine and cosine of doubles one by one. Here an angle is counted in turns, reduced to
r in [-1/2, 1/2], and sin(pi r) = r S(r^2) and cos(pi r) = C(r^2), the sine and cosine of *half*
the angle, are polynomials of degree 8: Chebyshev series, cut where what is left is below the last
digit, written in powers. Products of the two give the angle itself::

    u = sin(x/2) cos(x/2),  v = sin(x/2)^2,  sin x = 2 u,  cos x = 1 - 2 v

and are the same for x + 2 pi, so that the sign lost in the reduction does not matter. The error
is below 2e-15 for angles within a turn; further out it is that of the angle's own last digit.
"""

from __future__ import annotations

import numpy as np

from ..arrays import Array
from .buffers import aligned

SINE = (
    3.141592653589793,
    -5.167712780049969,
    2.5501640398773007,
    -0.599264529318946,
    0.08214588657312355,
    -0.007370430506093225,
    0.00046629981702308817,
    -2.1903499125519212e-05,
    7.697847275590284e-07,
)
COSINE = (
    1.0,
    -4.934802200544676,
    4.058712126416498,
    -1.335262768843456,
    0.23533063012967062,
    -0.02580688873817758,
    0.001929556278037417,
    -0.00010456656706174584,
    4.149578027057121e-06,
)
DEGREE = len(COSINE) - 1
_POLYNOMIALS = np.array([SINE, COSINE])


class HalfAngle:
    """
    Takes the features (u, v) of many angles, in memory of its own.

    Parameters
    ----------
    *shape : int
        Shape of the angles.
    powers : array, shape (DEGREE + 1, size), optional
        Memory that is free during a call and may be used otherwise between calls.

    """

    def __init__(self, *shape: int, powers: Array | None = None) -> None:
        self.shape = shape
        size = int(np.prod(shape))
        self._turns = aligned(size)
        self._powers = aligned(DEGREE + 1, size) if powers is None else powers
        self._half = aligned(2, size)

    def __call__(self, angles: Array) -> tuple[Array, Array]:
        """
        Return sin(x/2) and cos(x/2), up to a common sign, of angles [rad].

        Both have the shape given at the start, and are overwritten by the next call.
        """
        r, power, half = self._turns, self._powers, self._half
        np.multiply(angles, 0.5 / np.pi, out=r.reshape(self.shape))
        power[0] = 1.0
        np.rint(r, out=power[1])
        np.subtract(r, power[1], out=r)
        np.multiply(r, r, out=power[1])
        np.multiply(power[1], power[1], out=power[2])
        np.multiply(power[1:3], power[2], out=power[3:5])
        np.multiply(power[1:5], power[4], out=power[5:9])
        np.matmul(_POLYNOMIALS, power, out=half)
        np.multiply(half[0], r, out=half[0])
        return half[0].reshape(self.shape), half[1].reshape(self.shape)


def sincos(angles: Array) -> tuple[Array, Array]:
    """Return sine and cosine of angles of any shape [rad]."""
    sine, cosine = HalfAngle(*angles.shape)(angles)
    cosine *= sine
    sine *= sine
    cosine *= 2.0
    sine *= -2.0
    sine += 1.0
    return cosine, sine
