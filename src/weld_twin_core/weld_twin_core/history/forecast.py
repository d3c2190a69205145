# SPDX-FileCopyrightText: weld_twin contributors
# SPDX-License-Identifier: Apache-2.0
"""When a coordinate that drifts away reaches a limit."""

from __future__ import annotations

import numpy as np

from ..errors import DataError

DRAWS = 20_000
"""Draws of the trend; an interval's ends are good to 1 % of its width."""
SEED = 7
"""The same trend gives the same interval."""
NEVER = float('inf')


def reaches(
    limit: float, value: float, value_std: float, rate: float, rate_std: float
) -> tuple[float, float, float]:
    """
    Return in how many days a value reaches a limit: the median and a 90 % interval, ends included.

    Parameters
    ----------
    limit : float
        Size of the value that must not be passed, on the side it moves to.
    value, value_std : float
        Now, and its standard error.
    rate, rate_std : float
        Rise in a day, and its standard error.

    Returns
    -------
    tuple of float
        5 %, 50 % and 95 % of the days; 0 where it is beyond already, infinity where it never is.

    Raises
    ------
    DataError
        The limit is not positive.

    """
    if not limit > 0.0:
        raise DataError(f'a limit must be positive, got {limit}')
    rng = np.random.default_rng(SEED)
    now = value + value_std * rng.standard_normal(DRAWS)
    slope = rate + rate_std * rng.standard_normal(DRAWS)
    side = np.where(slope >= 0.0, limit, -limit)
    with np.errstate(divide='ignore', invalid='ignore'):
        days = np.where(np.abs(now) >= limit, 0.0, (side - now) / slope)
    days = np.where(np.isnan(days), NEVER, np.maximum(days, 0.0))
    low, middle, high = np.quantile(days, [0.05, 0.5, 0.95], method='inverted_cdf')
    return float(low), float(middle), float(high)
