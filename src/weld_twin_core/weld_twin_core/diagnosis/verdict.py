# SPDX-FileCopyrightText: weld_twin contributors
# SPDX-License-Identifier: Apache-2.0
"""From fits to a verdict: status, sets that cannot be told apart, and how sure it is."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from .flexible import Structure
from .result import Site
from .rivals import LISTED, Rival

SURE = 0.85
"""A leader less probable than this is not named alone."""
STRUCTURE = 0.12
"""Share of the gap that generic columns may still find before the answer is 'unknown'."""
CERTAIN = 3.0
"""Standard errors between stretches that a structure must exceed."""


@dataclass(frozen=True, eq=False)
class Evidence:
    """
    What the verdict is drawn from.

    Attributes
    ----------
    slots : tuple of tuple of Rival
        For every found effect, itself and its rivals, most probable first.
    structure : Structure
        What generic columns still find.
    gap, after, floor : float
        RMS on unseen data before and after, and of the noise, [m].

    """

    slots: tuple[tuple[Rival, ...], ...]
    structure: Structure
    gap: float
    after: float
    floor: float

    @property
    def unexplained(self) -> float:
        """Return the share of the squared gap above noise that generic columns still find."""
        excess = max(self.gap**2 - self.floor**2, 0.05 * self.floor**2, 1e-18)
        return float(np.clip(self.structure.gain * self.after**2 / excess, 0.0, 1.0))

    @property
    def structured(self) -> bool:
        """Return whether generic columns find something beyond doubt."""
        return self.structure.gain > 0.03 and self.structure.sure > CERTAIN


@dataclass(frozen=True)
class Verdict:
    """Status, confidence, and one set of sites per named effect."""

    status: str
    confidence: float
    sets: tuple[tuple[Site, ...], ...]
    reasons: tuple[str, ...]


def decide(evidence: Evidence) -> Verdict:
    """Return the verdict."""
    left = evidence.unexplained if evidence.structured else 0.0
    if not evidence.slots:
        if left > STRUCTURE:
            return Verdict('unknown', _unknown_confidence(left), (), (_depends(evidence),))
        return Verdict('none', 0.97, (), ('the gap does not rise above the noise',))
    sets = tuple(_leaders(slot) for slot in evidence.slots)
    mass = [
        sum(r.probability for r in slot if r.site in chosen)
        for slot, chosen in zip(evidence.slots, sets, strict=True)
    ]
    complete = 1.0 / (1.0 + (left / STRUCTURE) ** 3)
    confidence = float(np.prod(mass)) * complete * CALIBRATION
    if left > STRUCTURE:
        return Verdict('unknown', _unknown_confidence(left), sets, (_depends(evidence),))
    reasons = tuple(_alike(slot, chosen) for slot, chosen in zip(evidence.slots, sets, strict=True)
                    if len(chosen) > 1)  # fmt: skip
    status = 'ambiguous' if reasons else 'identified'
    return Verdict(status, confidence, sets, reasons)


CALIBRATION = 0.985
"""Even with evidence beyond doubt a verdict has been wrong this seldom on blind cases."""


def _unknown_confidence(left: float) -> float:
    return float(np.clip(0.5 + left, 0.5, 0.95))


def _leaders(slot: tuple[Rival, ...]) -> tuple[Site, ...]:
    """Return the leader alone when it is sure, else all that are worth naming."""
    if slot[0].probability >= SURE:
        return (slot[0].site,)
    return tuple(dict.fromkeys(r.site for r in slot if r.probability >= LISTED))


def _alike(slot: tuple[Rival, ...], chosen: tuple[Site, ...]) -> str:
    names = ', '.join(str(site) for site in chosen)
    return f'{names} move the tool alike on these data: their fits differ by less than the noise'


def _depends(evidence: Evidence) -> str:
    names = evidence.structure.depends_on
    on = ' and '.join(names) if names else 'the motion'
    return f'what remains depends on {on}, and no effect in the library explains it'
