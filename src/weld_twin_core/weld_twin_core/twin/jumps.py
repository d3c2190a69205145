# Copyright 2026 weld_twin contributors
# SPDX-License-Identifier: Apache-2.0
"""
Jumps of a law: an encoder's steps, and what slips.

Recordings show the place of a jump to a sample at best, and no derivative of a model says so. What is
corrected a sample early or late is off by all of it.
"""

from __future__ import annotations

import numpy as np

from ..arrays import Array
from .features import Features


def jumps(features: Features) -> Array:
    """Return how far effects jump from sample to sample, (M - 1, 3) [m]; no rows where nothing jumps."""
    jumping = [e for e in features.twin.effects if e.traits.jumps]
    if not jumping or features.recording.joints.static or features.at.size < 2:
        return np.zeros((0, 3))
    jumped = [
        {channel: np.append(by, 0.0) for channel, by in e.twin.jump(features.view).items()}
        for e in jumping
    ]
    moved: Array = np.sum([features.pose_change(by)[:3, :-1].T for by in jumped], axis=0)
    return moved


def shown(features: Features, noise: float) -> float:
    """Return how many jumps a recording shows, those below a coordinate's noise [m] for less."""
    power = (jumps(features) ** 2).sum(axis=1) / (3.0 * noise**2)
    return float(np.minimum(power, 1.0).sum())
