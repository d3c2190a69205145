# Copyright 2026 weld_twin contributors
# SPDX-License-Identifier: Apache-2.0
"""Read-only float64 copies, checked at the public boundary; samples of many; points of a box."""

from __future__ import annotations

from collections.abc import Iterable
from typing import Any

import numpy as np
from numpy.typing import ArrayLike, NDArray

from .errors import DataError, TwinError

Array = NDArray[np.float64]


def readonly(
    value: ArrayLike, shape: tuple[int | None, ...], name: str, *, finite: bool = True
) -> Array:
    """
    Copy a value into a read-only float64 array of a shape, where None matches any length.

    Raises DataError: not numeric, wrong shape, or not finite; the message has name and first bad
    index.
    """
    try:
        array = np.array(value, dtype=np.float64, order='C')  # messages are rows of bytes
    except (TypeError, ValueError, OverflowError):
        raise DataError(f'{name} must be numbers, got {_short(value)}') from None
    if array.ndim != len(shape) or any(
        want is not None and want != got for want, got in zip(shape, array.shape, strict=True)
    ):
        wanted = '(' + ', '.join('any' if s is None else str(s) for s in shape) + ')'
        raise DataError(f'{name} must have shape {wanted}, got {array.shape}')
    if finite and not np.isfinite(array).all():
        bad = tuple(int(i) for i in np.argwhere(~np.isfinite(array))[0])
        count = int((~np.isfinite(array)).sum())
        raise DataError(
            f'{name} has {count} value(s) that are not finite, the first at index {bad}; '
            'drop or repair those samples'
        )
    array.setflags(write=False)
    return array


def increasing(t: ArrayLike, name: str) -> Array:
    """Return stamps, shape (n,) [s]; DataError names the sample where one repeats or goes back."""
    stamps = readonly(t, (None,), name)
    steps = np.diff(stamps)
    if steps.size and steps.min() <= 0.0:
        k = int(np.argmax(steps <= 0.0))
        relation = f'{-steps[k]:.6g} s before' if steps[k] < 0.0 else 'at the same time as'
        raise DataError(
            f'{name} must increase, but sample {k + 1} is {relation} sample {k}; '
            'sort the samples or drop the repeated ones'
        )
    return stamps


def spread_over(count: int, most: int) -> NDArray[np.intp]:
    """Return indices below ``count``, evenly spread, first and last among them; ``most`` at most."""
    return np.asarray(np.linspace(0, count - 1, min(most, count)).round(), dtype=np.intp)


def refuse_unknown(
    given: Iterable[Any], known: Iterable[str], where: str, error: type[TwinError]
) -> None:
    """Raise an error where a mapping has a key that nobody reads, with the keys there are."""
    unknown = sorted(set(map(str, given)) - set(known))
    if unknown:
        raise error(
            f'{where} has the unknown key {unknown[0]!r}; known keys are ' + ', '.join(known)
        )


def _short(value: Any) -> str:
    text = repr(value)
    return text if len(text) <= 60 else text[:57] + '...'


_PRIMES = (2, 3, 5, 7, 11, 13, 17, 19, 23, 29, 31, 37, 41, 43, 47, 53, 59, 61, 67, 71)
"""One base for every dimension; more joints than these no arm has."""


def halton(dimensions: int, count: int) -> Array:
    """
    Return Halton's points [1]_ without the first, which is the origin, shape (count, dimensions).

    References
    ----------
    .. [1] J. H. Halton, "On the efficiency of certain quasi-random sequences of points in evaluating
       multi-dimensional integrals", Numerische Mathematik 2, 1960.

    """
    out = np.zeros((count, dimensions))
    for k, base in enumerate(_PRIMES[:dimensions]):
        rest, weight = np.arange(1, count + 1), 1.0 / base
        while rest.any():
            rest, digit = np.divmod(rest, base)
            out[:, k] += digit * weight
            weight /= base
    return out
