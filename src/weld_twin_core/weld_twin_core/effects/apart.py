# Copyright 2026 weld_twin contributors
# SPDX-License-Identifier: Apache-2.0
"""What parts effects that move the tool alike on every motion of the joints."""

from __future__ import annotations

from collections.abc import Sequence

WAYS: dict[frozenset[str], str] = {
    frozenset({'joint_offset', 'base_pose'}): 'measure where the base stands (points on its '
    'foot), or master the joint with its own gauge',
    frozenset({'joint_offset', 'root_pose'}): 'measure where the positioner stands beside the '
    'robot (points on both feet), or master the joint with its own gauge',
    frozenset({'joint_offset', 'tool_pose'}): 'measure the tool by itself, or master the joint '
    'with its own gauge',
    frozenset({'base_pose', 'tool_pose'}): 'measure the tool by itself',
    frozenset({'time_delay', 'servo_lag'}): 'record commanded and measured joints side by '
    'side, or trigger both recordings with one signal',
    frozenset({'backlash', 'friction'}): 'push the link to and fro while the motor holds: only '
    'play gives way',
    frozenset({'joint_compliance', 'pedestal_tilt'}): 'put a level or a dial gauge on the base '
    'while the arm moves',
    frozenset(
        {'hose_pull', 'payload'}
    ): 'take the hose package off the flange, or weigh what hangs on it',
    frozenset({'refraction', 'base_pose'}): 'measure from a second place of the instrument',
    frozenset({'joint_compliance', 'payload'}): 'weigh what hangs on the flange',
    frozenset({'link_offset'}): 'only their sum moves the tool, so mending either mends both',
    frozenset({'joint_offset'}): 'master one of the joints with its own gauge',
    frozenset({'drift', 'thermal_growth'}): 'measure a fixed point beside the arm while it works',
    frozenset({'measurement_scale', 'link_length'}): 'measure a bar of known length',
}
"""What parts effects of these families."""
ELSE = 'mend whichever is easier, for anywhere in the workspace they differ by less than the noise'
"""What is said of all others."""


def way(families: Sequence[str]) -> str:
    """Return what tells causes of these families apart when no motion does."""
    return WAYS.get(frozenset(families), ELSE)
