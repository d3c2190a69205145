# Copyright 2026 weld_twin contributors
# SPDX-License-Identifier: Apache-2.0
"""The one layout of rows: recordings, then samples, then components."""

from __future__ import annotations

from typing import TypeVar

import numpy as np

Row = TypeVar('Row', bound=np.generic)


def by_sample(
    values: np.ndarray[tuple[int, ...], np.dtype[Row]],
    rows: tuple[int, ...],
    samples: tuple[int, ...],
) -> list[np.ndarray[tuple[int, ...], np.dtype[Row]]]:
    """
    Return what is laid out in rows as one array per recording, shape (M, c, ...).

    Parameters
    ----------
    values : array, shape (rows, ...)
        As `Problem.whitened` lays it out.
    rows, samples : tuple of int
        Components c and samples M of every recording.

    """
    ends = np.cumsum([c * m for c, m in zip(rows, samples, strict=True)])
    parts = np.split(values, ends[:-1])
    return [
        part.reshape(m, c, *values.shape[1:])
        for part, c, m in zip(parts, rows, samples, strict=True)
    ]
