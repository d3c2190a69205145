# SPDX-FileCopyrightText: weld_twin contributors
# SPDX-License-Identifier: Apache-2.0
"""Working memory of the kernels."""

from math import prod

import numpy as np

from ..arrays import Array

CACHE_LINE = 64


def aligned(*shape: int) -> Array:
    """
    Return memory, not yet filled, that begins on a cache line.

    numpy begins large arrays 16 bytes after one; every vector store then straddles two lines and
    costs twice as much. Rows stay aligned when their length is a multiple of 8.
    """
    size = prod(shape) * 8
    raw = np.empty(size + CACHE_LINE, dtype=np.uint8)
    start = -raw.ctypes.data % CACHE_LINE
    return raw[start : start + size].view(np.float64).reshape(shape)
