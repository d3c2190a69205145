# Copyright 2026 weld_twin contributors
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
REASON = 'the joint hardly moves'


def hardly_moves(features: list[Features], effect: Effect) -> bool:
    """Return whether an effect sits on a joint, or has a source, that hardly moves."""
    if effect.moved_by is None:
        return False
    robot = features[0].twin.robot
    i = robot.index(effect.moved_by)
    positions = [maker.view.joint(i) for maker in features]
    travel = max(float(np.max(q)) for q in positions) - min(float(np.min(q)) for q in positions)
    return travel < (STILL_SLIDE if robot.prismatic[i] else STILL)
