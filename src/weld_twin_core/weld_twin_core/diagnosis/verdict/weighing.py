# Copyright 2026 weld_twin contributors
# SPDX-License-Identifier: Apache-2.0
"""Evidence weighed by beliefs: what stands above the noise, what is left, whether it carries."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from ..beliefs import Beliefs
from .evidence import Evidence

TINY = 1e-18
"""Least squared gap [m^2] divided by: a nanometre, far below any instrument."""


@dataclass(frozen=True, eq=False)
class Weighed:
    """Evidence, and the beliefs that it is weighed by."""

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
    def rise(self) -> float:
        """Return by what share of an independent floor what remains stands above it."""
        told = self.evidence
        floor = max(told.floor, np.sqrt(TINY))
        return float(max(told.after / floor - 1.0, 0.0)) if told.independent else 0.0

    @property
    def share(self) -> float:
        """Return what remains above the floor as a share of the gap."""
        told = self.evidence
        gap = max(told.gap**2 - told.floor**2, TINY)
        return float(np.sqrt(max(told.after**2 - told.floor**2, 0.0) / gap))

    @property
    def carries(self) -> bool:
        """Return whether the model does on a held-out motion what it does on those fitted."""
        # A ratio that chance reaches on so few readings says nothing.
        told = self.evidence
        return (
            told.after < self.beliefs.above * told.floor
            or told.after < max(self.beliefs.carried, told.chance) * told.fitted
            or self.share < self.beliefs.carried_share
        )

    @property
    def left(self) -> float:
        """Return the share of the squared gap above noise that is not explained."""
        told = self.evidence
        least = self.beliefs.least_excess * told.floor**2
        excess = max(told.gap**2 - told.floor**2, least, TINY)
        found = told.structure.gain * told.after**2 if self.structured else 0.0
        over = told.after**2 - told.floor**2 if self.high else 0.0
        if self.wide:
            # Such a floor may be too low by that factor; what is beyond is left all the same.
            over = told.after**2 - (self.beliefs.far_above * told.floor) ** 2
        return float(np.clip(max(found, over) / excess, 0.0, 1.0))

    @property
    def complete(self) -> float:
        """Return how far to believe that nothing is missing, 1 to 0 as more is left."""
        much = self.left / self.beliefs.unexplained
        return float(1.0 / (1.0 + much**self.beliefs.unexplained_power))
