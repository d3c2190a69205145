# Copyright 2026 weld_twin contributors
# SPDX-License-Identifier: Apache-2.0
"""
What cases with known truths taught: for each kind of statement one logistic of a few features.

`weights.json` holds them, and can be read: for every feature what one unit of it adds to the log
odds, and the range that was learned from. `weld-twin lab belief` fits and writes it.
"""

from __future__ import annotations

import json
from collections.abc import Mapping
from dataclasses import dataclass
from functools import lru_cache
from importlib.resources import files
from typing import Any

import numpy as np

SCHEMA = 'weld_twin/calibration/1'
FILE = 'weights.json'
Features = Mapping[str, float]


@dataclass(frozen=True)
class Term:
    """What one feature adds to the log odds."""

    weight: float
    """Log odds for each unit of the feature."""
    low: float
    high: float
    """Range that was learned from; beyond it nothing is known, and the feature counts as its
    end."""

    def log_odds(self, value: float) -> float:
        """Return what it adds to the log odds."""
        return self.weight * min(max(value, self.low), self.high)


@dataclass(frozen=True)
class Logistic:
    """How often one kind of statement is right, as a function of its features."""

    constant: float
    """Log odds where every feature is zero."""
    terms: Mapping[str, Term]
    """By the name of the feature."""

    def probability(self, features: Features) -> float:
        """
        Return the probability of being right.

        features: one that is missing counts as zero, such as a family that is not named.
        """
        total = self.constant
        total += sum(term.log_odds(features.get(name, 0.0)) for name, term in self.terms.items())
        return float(1.0 / (1.0 + np.exp(-total)))


@dataclass(frozen=True)
class Calibration:
    """All that was learned."""

    statements: Mapping[str, Logistic]
    """By the kind of statement; `features.KINDS` lists them."""
    sure_from: Mapping[str, float]
    """Probability from which on an 'answer' as a whole, or a 'cause', keeps the promise of being
    wrong hardly ever."""
    card: Mapping[str, Any]
    """Cases, seeds, engines, mix and bounds, to read."""

    def probability(self, kind: str, features: Features) -> float:
        """Return how often such statements were right."""
        return self.statements[kind].probability(features)

    def sure(self, what: str, probability: float) -> bool:
        """
        Return whether a statement of this probability keeps the promise.

        what: 'answer' or 'cause'.
        """
        return probability >= self.sure_from[what]


def calibration_from(content: Mapping[str, Any]) -> Calibration:
    """
    Return what was learned, from the content of a file.

    content: as ``weld-twin lab belief`` writes it.
    """
    statements = {
        kind: Logistic(
            own['constant'], {name: Term(**term) for name, term in own['weights'].items()}
        )
        for kind, own in content['statements'].items()
    }
    return Calibration(statements, content['sure_from'], content['card'])


@lru_cache(maxsize=1)
def usual_calibration() -> Calibration:
    """Return what this package has learned."""
    text = files(__package__).joinpath(FILE).read_text(encoding='utf-8')
    return calibration_from(json.loads(text))
