# Copyright 2026 weld_twin contributors
# SPDX-License-Identifier: Apache-2.0
"""What one run of a study comes to: a few numbers per draw."""

from __future__ import annotations

from typing import NamedTuple

import numpy as np

from ..arrays import Array
from ..errors import DataError


class Outcomes(NamedTuple):
    """
    Numbers of D runs, shape (D,) each.

    ``d_norm`` is the largest deviation over the path length, ``max_m`` and ``rms_m`` are of its
    length, ``across_m`` and ``stickout_m`` the largest component across the seam and along its
    normal.
    """

    d_norm: Array
    max_m: Array
    rms_m: Array
    across_m: Array
    stickout_m: Array


def outcomes(off: Array, length: float) -> Outcomes:
    """
    Return what runs come to.

    Parameters
    ----------
    off : array, shape (3, D, N) [m]
        Deviations along, across and normal to the seam.
    length : float [m]
        Of the seam.

    """
    along, across, normal = off
    square = along * along
    square += across * across
    square += normal * normal
    largest = np.sqrt(square.max(axis=-1))
    return Outcomes(
        largest / length,
        largest,
        np.sqrt(square.mean(axis=-1)),
        np.maximum(across.max(axis=-1), -across.min(axis=-1)),
        np.maximum(normal.max(axis=-1), -normal.min(axis=-1)),
    )


def joined(parts: list[Outcomes]) -> Outcomes:
    """Return the outcomes of several chunks of draws as one."""
    return Outcomes(*(np.concatenate(column) for column in zip(*parts, strict=True)))


def refuse_unfinite(values: Array, what: str) -> None:
    """Raise DataError where model results are no numbers, with how many and the first run."""
    bad = ~np.isfinite(values)
    if bad.any():
        first = int(np.argmax(bad.reshape(len(values), -1).any(axis=1)))
        raise DataError(
            f'{what}: {int(bad.sum())} of {bad.size} model results are not finite, the first in '
            f'run {first}; indices of the others would be wrong, so none are given'
        )
