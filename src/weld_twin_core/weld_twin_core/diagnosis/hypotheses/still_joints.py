# SPDX-FileCopyrightText: weld_twin contributors
# SPDX-License-Identifier: Apache-2.0
"""Joints that hardly move: what depends on their motion cannot be told from a constant."""

from __future__ import annotations

import numpy as np

from ...effects.effect import Effect
from ...twin.features import Features

STILL = 0.04
"""Travel [rad] below which a joint stands still: a scale of 0.1 % moves by 0.04 mrad over it."""
STILL_SLIDE = 2e-3
"""The same for a joint that slides, [m]."""
BY_MOTION = frozenset(
    {
        'gear_ratio',
        'transmission_ripple',
        'joint_compliance',
        'joint_coupling',
        'quantization',
        'joint_curve',
    }
)
"""Families that a joint must move for: gear, spring and encoder of one that stands are unknown."""
REASON = 'the joint hardly moves'


def hardly_moves(features: list[Features], effect: Effect) -> bool:
    """Return whether an effect sits on a joint, or has a source, that hardly moves."""
    if effect.name not in BY_MOTION or effect.site is None:
        return False
    moving = str(getattr(effect, 'source', '') or effect.site)
    robot = features[0].twin.robot
    i = robot.index(moving)
    positions = [maker.view.joint(i) for maker in features]
    travel = max(float(np.max(q)) for q in positions) - min(float(np.min(q)) for q in positions)
    return travel < (STILL_SLIDE if robot.prismatic[i] else STILL)
