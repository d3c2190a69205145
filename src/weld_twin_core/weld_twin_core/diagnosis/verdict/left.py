# Copyright 2026 weld_twin contributors
# SPDX-License-Identifier: Apache-2.0
"""What is left on data that were not fitted, and how much of the gap that is."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from ..beliefs import Beliefs
from .evidence import Evidence

TINY = 1e-18
"""Least squared gap [m^2] divided by: a nanometre, far below any instrument."""


@dataclass(frozen=True, eq=False)
class Left:
    """Evidence, and the numbers from which on what it leaves is more than noise."""

    evidence: Evidence
    beliefs: Beliefs

    @property
    def structured(self) -> bool:
        """Return whether generic columns find something beyond doubt."""
        gain, sure = self.evidence.structure.gain, self.evidence.structure.sure
        usual = gain > self.beliefs.structure_gain and sure > self.beliefs.structure_sure
        blatant = gain > self.beliefs.blatant_gain and sure > self.beliefs.blatant_sure
        return usual or blatant

    @property
    def high(self) -> bool:
        """Return whether what remains rises above a floor that was measured apart."""
        told = self.evidence
        return told.independent and told.after > self.beliefs.above * told.floor

    @property
    def wide(self) -> bool:
        """Return whether what remains is far wider than a floor that only the fit shows."""
        told = self.evidence
        return not told.independent and told.after > self.beliefs.far_above * told.floor

    @property
    def above_noise(self) -> bool:
        """Return whether what remains is more than noise."""
        return self.structured or self.high

    @property
    def share(self) -> float:
        """Return the share of the squared gap above noise that is not explained."""
        told = self.evidence
        found = told.structure.gain * told.after**2 if self.structured else 0.0
        over = told.after**2 - told.floor**2 if self.high else 0.0
        if self.wide:
            # Such a floor may be too low by that factor; what is beyond is left all the same.
            over = told.after**2 - (self.beliefs.far_above * told.floor) ** 2
        return float(np.clip(max(found, over) / self._excess, 0.0, 1.0))

    @property
    def explained(self) -> float:
        """Return the share of the squared gap above noise that the model takes off unseen data."""
        told = self.evidence
        return float(np.clip((told.gap**2 - told.after**2) / self._excess, 0.0, 1.0))

    @property
    def _excess(self) -> float:
        told = self.evidence
        least = self.beliefs.least_excess * told.floor**2
        return max(told.gap**2 - told.floor**2, least, TINY)
