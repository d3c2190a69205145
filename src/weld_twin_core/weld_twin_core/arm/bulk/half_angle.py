# Copyright 2026 weld_twin contributors
# SPDX-License-Identifier: Apache-2.0
"""
Sine and cosine from half the angle, several times as fast as numpy's, which take one by one.

Two features do for everything that is linear in 1, sin x and cos x::

    u = sin(x/2) cos(x/2),  v = sin(x/2)^2,  sin x = 2 u,  cos x = 1 - 2 v

Where numpy has a vectorised tangent (AVX-512), t = tan(x/2) gives u = t / (1 + t^2) and v = t u.
Elsewhere an angle is counted in turns, reduced to r in [-1/2, 1/2], and sin(pi r) = r S(r^2) and
cos(pi r) = C(r^2) are polynomials of degree 8: Chebyshev series, cut where what is left is below
the last digit, written in powers, so that they are array products and one small matrix product.
Their products are the same for x + 2 pi, so that the sign lost in the reduction does not matter.
The error is below 4e-15 for angles within a turn; further out it is that of the angle's own last
digit.
"""

from __future__ import annotations

from collections.abc import Iterator
from contextlib import contextmanager
from math import prod

import numpy as np

from ...arrays import Array

_CACHE_LINE = 64
"""Bytes; arrays begin at a multiple of it."""
_SHORT = 512
"""Numbers in numpy's buffer while rows are worked on."""


def aligned(*shape: int) -> Array:
    """
    Return memory, not yet filled, that begins on a cache line.

    numpy begins large arrays 16 bytes after one; every vector store then straddles two lines and
    costs twice as much. Rows stay aligned when their length is a multiple of 8.
    """
    size = prod(shape) * 8
    raw = np.empty(size + _CACHE_LINE, dtype=np.uint8)
    start = -raw.ctypes.data % _CACHE_LINE
    return raw[start : start + size].view(np.float64).reshape(shape)


@contextmanager
def unbuffered() -> Iterator[None]:
    """
    Have numpy work on rows of more than a few hundred numbers where they are.

    Where operands are not one contiguous run, numpy 2 copies rows shorter than half its buffer of
    8192 numbers into it and back, though nothing has to be converted: four times the work. With a
    buffer that is shorter than a row it does not.
    """
    usual = np.setbufsize(_SHORT)
    try:
        yield
    finally:
        np.setbufsize(usual)


_SINE = (
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
"""Coefficients of sin(pi x) / x in powers of x^2."""
_COSINE = (
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
"""Coefficients of cos(pi x) in powers of x^2."""
DEGREE = len(_COSINE) - 1
"""Of the polynomials, in the square of the angle."""
_POLYNOMIALS = np.array([_COSINE, _SINE])


def _tangent_is_vectorised() -> bool:
    """Tell whether this numpy, on this processor, takes many tangents at once."""
    introspect = getattr(np.lib, 'introspect', None)  # since numpy 2.1
    if introspect is None:
        return False
    result = introspect.opt_func_info(func_name='^tan$', signature='float64')
    kernel = result.get('tan', {}).get('dd', {}).get('current', '')
    return bool(kernel.startswith(('AVX512', 'X86_V4')))


_BY_TANGENT = _tangent_is_vectorised()


class HalfAngle:
    """
    Takes the features (u, v) of many angles, in memory that is free between calls.

    powers: shape (DEGREE + 1, size). own: shape (3, size); the result is part of it.
    """

    def __init__(
        self,
        *shape: int,
        powers: Array | None = None,
        own: Array | None = None,
        by_tangent: bool = _BY_TANGENT,
    ) -> None:
        self.shape = shape
        size = int(np.prod(shape))
        self._powers = aligned(DEGREE + 1, size) if powers is None else powers
        self._own = aligned(3, size) if own is None else own
        self._fill = self._from_tangents if by_tangent else self._from_polynomials

    def __call__(self, angles: Array) -> Array:
        """Return u and v of angles [rad], shape (2, *shape); the next call overwrites them."""
        self._fill(angles)
        return self._own[1:].reshape(2, *self.shape)

    def _from_tangents(self, angles: Array) -> None:
        t, u, v = self._own
        np.multiply(angles, 0.5, out=t.reshape(self.shape))
        np.tan(t, out=t)
        np.multiply(t, t, out=v)
        v += 1.0
        np.divide(t, v, out=u)
        np.multiply(t, u, out=v)

    def _from_polynomials(self, angles: Array) -> None:
        power, (r, cosine, sine) = self._powers, self._own
        np.multiply(angles, 0.5 / np.pi, out=r.reshape(self.shape))
        power[0] = 1.0
        np.rint(r, out=power[1])
        np.subtract(r, power[1], out=r)
        np.multiply(r, r, out=power[1])
        np.multiply(power[1], power[1], out=power[2])
        np.multiply(power[1:3], power[2], out=power[3:5])
        np.multiply(power[1:5], power[4], out=power[5:9])
        np.matmul(_POLYNOMIALS, power, out=self._own[1:])
        np.multiply(sine, r, out=sine)
        np.multiply(cosine, sine, out=cosine)
        np.multiply(sine, sine, out=sine)
