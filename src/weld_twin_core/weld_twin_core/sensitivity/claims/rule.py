# Copyright 2026 weld_twin contributors
# SPDX-License-Identifier: Apache-2.0
"""A claim, and how the measurements on one robot and seam decide it."""

from __future__ import annotations

from collections.abc import Callable, Mapping, Sequence
from dataclasses import dataclass

import numpy as np

Measured = Mapping[str, float]


class Range:
    """What a measurement was over all cases; formats as its least and largest value."""

    def __init__(self, values: Sequence[float]) -> None:
        self.low, self.high = float(np.min(values)), float(np.max(values))

    def __format__(self, form: str) -> str:
        """Return 'low to high' by a format, or one number where both read the same."""
        kind = form or '.3g'
        low, high = format(self.low, kind), format(self.high, kind)
        return low if low == high else f'{low} to {high}'

    def __mul__(self, factor: float) -> Range:
        return Range([self.low * factor, self.high * factor])


@dataclass(frozen=True)
class Rule:
    """A claim and how it is decided."""

    key: str
    statement: str
    where: str
    """Name, what the paper says, and in which section."""
    holds: Callable[[Measured], bool]
    """Whether the claim as written holds on one case."""
    reason: Callable[[Mapping[str, Range]], str]
    """One line made of the ranges of the measurements."""
    shows: tuple[str, ...]
    """Measurements the table gives."""
    condition: str = ''
    """Under which condition the claim holds where it does not hold as written."""
    holds_then: Callable[[Measured], bool] | None = None
    """Whether it holds on one case under that condition."""
