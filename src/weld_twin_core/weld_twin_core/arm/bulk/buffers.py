# Copyright 2026 weld_twin contributors
# SPDX-License-Identifier: Apache-2.0
"""Working memory of the kernels."""

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
