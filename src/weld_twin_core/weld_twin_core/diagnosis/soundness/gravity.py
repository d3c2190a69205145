# Copyright 2026 weld_twin contributors
# SPDX-License-Identifier: Apache-2.0
"""Does gravity pull down where the base was said to stand?"""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np

from ...arrays import Array
from .evidence import Case, Finding
from .limits import TILTED

DOWN = np.array([0.0, 0.0, -1.0])
"""Where gravity pulls in a measuring frame that stands upright."""


def gravity(case: Case) -> Sequence[Finding]:
    """Return that gravity and the way the arm was said to stand contradict each other."""
    robot = case.model.robot
    turn, pull = robot.T_world_base[:3, :3], robot.gravity
    if _angle(turn @ -DOWN, -DOWN) < TILTED or not np.linalg.norm(pull) > 0.0:
        return ()  # It stands upright, or nothing was said of how it stands.
    off = _angle(turn @ pull, DOWN)
    if off < TILTED:
        return ()
    own, right = (
        ', '.join(f'{value:.4g}' for value in vector + 0.0)
        for vector in (pull, np.round(np.linalg.norm(pull) * turn.T @ DOWN, 5))
    )
    return (
        Finding(
            'warning',
            f'Gravity ({own}) m/s^2 is in the base frame, and with the base that was given it pulls '
            f'{np.degrees(off):.0f} degrees away from down. If the measuring frame stands upright, '
            f'gravity is ({right}); springs and payload come out wrong with another.',
        ),
    )


def _angle(one: Array, other: Array) -> float:
    cosine = float(one @ other) / float(np.linalg.norm(one) * np.linalg.norm(other))
    return float(np.arccos(np.clip(cosine, -1.0, 1.0)))
