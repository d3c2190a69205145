# Copyright 2026 weld_twin contributors
# SPDX-License-Identifier: Apache-2.0
"""Whether a deviation is within a tolerance, by the decision rule of ISO 14253-1."""

from __future__ import annotations

from dataclasses import dataclass
from statistics import NormalDist

PASS, FAIL, OPEN = 'pass', 'fail', 'open'
_SURE = 0.95
"""Probability with which a statement has to hold: the default of ISO 14253-1:2017."""


@dataclass(frozen=True)
class Rule:
    """A tolerance and how well deviations are known."""

    tolerance_m: float | None
    """Largest deviation allowed; None where nobody has said."""
    uncertainty_m: float
    """Standard uncertainty of one measured deviation."""
    readings: int = 1
    """Readings of which the largest is judged."""

    @property
    def to_pass(self) -> float:
        """Return the standard uncertainties that a deviation must stay below the tolerance."""
        return NormalDist().inv_cdf(_SURE)

    @property
    def to_fail(self) -> float:
        """
        Return by how many standard uncertainties the largest reading must exceed it.

        Noise alone makes the largest of many larger, so that it says less than a single one.
        """
        return NormalDist().inv_cdf(_SURE ** (1.0 / max(self.readings, 1)))

    def judged(self, largest_m: float) -> str | None:
        """
        Return whether the largest deviation [m] passes, fails, or leaves it open; None untold.

        It passes where conformity is proven in spite of the uncertainty, it fails where the
        opposite is, and in between neither can be said.

        References
        ----------
        .. [1] ISO 14253-1:2017, Inspection by measurement of workpieces and measuring equipment,
           part 1: decision rules for verifying conformity or nonconformity with specifications.

        """
        if self.tolerance_m is None:
            return None
        if largest_m + self.to_pass * self.uncertainty_m <= self.tolerance_m:
            return PASS
        if largest_m - self.to_fail * self.uncertainty_m > self.tolerance_m:
            return FAIL
        return OPEN
