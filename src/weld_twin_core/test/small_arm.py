# Copyright 2026 weld_twin contributors
# SPDX-License-Identifier: Apache-2.0
"""An arm of three joints, whose diagnosis takes half as long as that of six."""

from functools import cache

from weld_twin_core import Robot, load


@cache
def small_arm():
    """Return the first three joints of a UR5, with a tool off their axes."""
    whole = load('ur5').to_mapping()
    short = {key: whole[key][:3] for key in ('joints', 'links')}
    tool = {'xyz': [0.1, 0.05, 0.2], 'quat_xyzw': [0.0, 0.0, 0.0, 1.0]}
    return Robot.from_mapping({**whole, **short, 'tool': tool})
