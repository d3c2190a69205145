# Copyright 2026 weld_twin contributors
# SPDX-License-Identifier: Apache-2.0
"""When a coordinate that drifts away reaches a limit."""

from __future__ import annotations

from collections.abc import Sequence
from typing import NamedTuple

import numpy as np

from ..arrays import Array
from ..errors import DataError
from .changes import Change, value_and_rise
from .observation import Observation

_DRAWS = 20_000
"""Draws of the trend; an interval's ends are good to 1 % of its width."""
_SEED = 7
"""The same trend gives the same interval."""
_NEVER = float('inf')


class Outlook(NamedTuple):
    """Where a coordinate is at the last diagnosis, and how fast it moves."""

    value: Array
    """Value [SI], and rise in a day, shape (2,)."""
    covariance: Array
    """Shape (2, 2)."""


def outlook(
    observations: Sequence[Observation], result: Sequence[Change], name: str
) -> Outlook | None:
    """Return where a coordinate is and how fast it moves, all fitted together; None without a trend."""
    if not any(each.name == name and each.kind == 'trend' for each in result):
        return None
    return Outlook(*value_and_rise(observations, result, name))


def reaches(limit: float, now: Outlook) -> tuple[float, float, float]:
    """
    Return in how many days a size reaches a limit: 5 %, 50 % and 95 % of the chances.

    0 where it is beyond already, infinity where it never is. Raises DataError: a limit that is not
    positive.
    """
    if not limit > 0.0:
        raise DataError(f'a limit must be positive, got {limit}')
    rng = np.random.default_rng(_SEED)
    spread, axes = np.linalg.eigh(now.covariance)
    root = axes * np.sqrt(np.maximum(spread, 0.0))
    value, slope = now.value[:, None] + root @ rng.standard_normal((2, _DRAWS))
    side = np.where(slope >= 0.0, limit, -limit)
    with np.errstate(divide='ignore', invalid='ignore'):
        days = np.where(np.abs(value) >= limit, 0.0, (side - value) / slope)
    days = np.where(np.isnan(days), _NEVER, np.maximum(days, 0.0))
    low, middle, high = np.quantile(days, [0.05, 0.5, 0.95], method='inverted_cdf')
    return float(low), float(middle), float(high)
