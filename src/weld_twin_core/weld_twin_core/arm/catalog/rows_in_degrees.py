# Copyright 2026 weld_twin contributors
# SPDX-License-Identifier: Apache-2.0
"""Joints of arms whose makers tell range and speed in degrees."""

from __future__ import annotations

from collections.abc import Iterable
from math import pi
from typing import Any

DEGREE = pi / 180.0
"""Radians."""
TO_FULL_SPEED = 0.25
"""Seconds: an estimate, as these makers do not publish acceleration."""


def joints(
    name: str, rows: Iterable[tuple[float, ...]], letters: str = ''
) -> list[dict[str, Any]]:
    """
    Return the joints of a robot file.

    Parameters
    ----------
    name : str
        What comes before the number of a joint, counted from 1.
    rows : iterable of tuple
        a [m], alpha [rad], d [m], theta at zero [rad], lower [deg], upper [deg] and speed [deg/s]
        of each joint.
    letters : str, optional
        One for each joint, after its number (Yaskawa's S, L, U, R, B, T).

    """
    ends = [f'_{letter}' for letter in letters] or None
    return [
        {
            'name': f'{name}{k}{ends[k - 1] if ends else ""}',
            'a': a,
            'alpha': alpha,
            'd': d,
            'theta_offset': theta,
            'lower': lower * DEGREE,
            'upper': upper * DEGREE,
            'max_velocity': speed * DEGREE,
            'max_acceleration': speed * DEGREE / TO_FULL_SPEED,
        }
        for k, (a, alpha, d, theta, lower, upper, speed) in enumerate(rows, 1)
    ]
