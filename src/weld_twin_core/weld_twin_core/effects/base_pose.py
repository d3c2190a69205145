# Copyright 2026 weld_twin contributors
# SPDX-License-Identifier: Apache-2.0
"""Base pose: the robot stands elsewhere (paper IV.ii, initialization offset)."""

from dataclasses import dataclass

from .constant import FrameError
from .registry import register
from .view import Value


@register
@dataclass(frozen=True, eq=False)
class BasePose(FrameError):
    """The base is displaced by xyz in the world and turned by rotvec about its own origin."""

    xyz: Value = (0.0, 0.0, 0.0)
    rotvec: Value = (0.0, 0.0, 0.0)

    name = 'base_pose'
    title = 'base pose error'
    entered = 'base'
    depends_on = 'constant'
    place = 'base'
    channel = 'base'
    fitted_with = 'base'
