# Copyright 2026 weld_twin contributors
# SPDX-License-Identifier: Apache-2.0
"""How many samples a motion may have; apart from all else, so that files are checked quickly."""

from __future__ import annotations

from ..errors import PathError

MOST_SAMPLES = 2_000_000
"""
Samples a motion may have: four and a half hours at 125 Hz, half an hour at 1 kHz. Planning takes
2.6 to 3.2 kB for each with six and seven joints, so these take 6 GB at most.
"""


def refuse_endless(duration: float, dt: float, most: int = MOST_SAMPLES) -> None:
    """Raise PathError where a motion has more samples than make sense; times are in s."""
    if not duration <= most * dt:
        raise PathError(
            f'the motion would take {duration / dt:.3g} samples, and {most:,} are the most; lower '
            'the rate, raise the speed, or keep the seam away from a singular posture, where the '
            'joints slow it down'
        )
