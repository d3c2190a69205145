# Copyright 2026 weld_twin contributors
# SPDX-License-Identifier: Apache-2.0
"""
The arms of Universal Robots, which differ in lengths, masses and speeds alone.

Their base is the frame `base` of UR's Denavit-Hartenberg table and of its controller, not the
`base_link` of its URDFs, which is turned by 180 degrees about z against it.
"""

from __future__ import annotations

from collections.abc import Sequence
from math import pi
from typing import Any

ARTICLE = (
    'Universal Robots, "DH parameters for calculations of kinematics and dynamics" (article 45257)'
)
"""Where UR publishes geometry, masses and centres of mass."""
JOINTS = (
    'shoulder_pan_joint',
    'shoulder_lift_joint',
    'elbow_joint',
    'wrist_1_joint',
    'wrist_2_joint',
    'wrist_3_joint',
)
"""As UR's drivers name them."""
TO_FULL_SPEED = 5.0
"""1/s: full speed in about 0.2 s, an estimate, as UR does not publish acceleration."""


def ur_arm(
    name: str,
    source: str,
    lengths: tuple[float, float, float, float, float, float],
    speeds: Sequence[float],
    links: Sequence[tuple[float, list[float]]],
    accelerations: Sequence[float] | None = None,
) -> dict[str, Any]:
    """
    Return the robot file of an arm of Universal Robots.

    Parameters
    ----------
    name, source : str
    lengths : tuple of float [m]
        d1, a2, a3, d4, d5 and d6 of UR's table; a2 and a3 are negative.
    speeds : sequence of float [rad/s]
    links : sequence of (mass [kg], centre of mass [m])
        Each centre in the link's Denavit-Hartenberg frame, as UR gives it.
    accelerations : sequence of float [rad/s2], optional
        `TO_FULL_SPEED` times the speed if not given.

    """
    d1, a2, a3, d4, d5, d6 = lengths
    rows = (
        (0.0, pi / 2, d1),
        (a2, 0.0, 0.0),
        (a3, 0.0, 0.0),
        (0.0, pi / 2, d4),
        (0.0, -pi / 2, d5),
        (0.0, 0.0, d6),
    )
    if accelerations is None:
        accelerations = [TO_FULL_SPEED * speed for speed in speeds]
    return {
        'name': name,
        'source': source,
        'joints': [_joint(*row) for row in zip(JOINTS, rows, speeds, accelerations, strict=True)],
        'links': [{'mass': mass, 'com': com} for mass, com in links],
    }


def _joint(
    name: str, row: tuple[float, float, float], speed: float, acceleration: float
) -> dict[str, Any]:
    """Return a joint of the robot file; every one turns by two revolutions."""
    a, alpha, d = row
    return {
        'name': name,
        'a': a,
        'alpha': alpha,
        'd': d,
        'lower': -2 * pi,
        'upper': 2 * pi,
        'max_velocity': speed,
        'max_acceleration': acceleration,
    }
