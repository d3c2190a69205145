# Copyright 2026 weld_twin contributors
# SPDX-License-Identifier: Apache-2.0
"""The channels of a chain whose derivatives are held against differences."""

from weld_twin_core.arm.channels import ROW_CHANNELS


def geometric_channels(robot):
    """Return every geometric channel: base, theta d a alpha beta of every row, root, tool."""
    rows = [(key, i) for i in range(robot.n) for key in ROW_CHANNELS]
    frames = ('base', 'root', 'tool') if robot.behind else ('base', 'tool')
    return rows + [(name, k) for name in frames for k in range(6)]
