# Copyright 2026 weld_twin contributors
# SPDX-License-Identifier: Apache-2.0
"""
Tool sag: the tool gives way under its own weight, and by another way in every orientation.

A torch stands on a bracket at the flange, and both are springs: the tip goes by a linear map of the
weight as the flange sees it. Nine numbers hold any such map: the weight acts at the centre of the
torch and moves its tip, so the map need not be symmetric. The tool turns about the flange as far as
takes its tip there; numbers of its own for the turn would follow much that is no sag. Masses of the
arm play no part.
"""

from __future__ import annotations

import numpy as np

from .effect import LinearEffect, Traits, register
from .view import Array, Parameter, Robot, Shift, Stage, Value, View
from .wording import number

_TURNED = 1e-2
"""Change of gravity's direction in the flange [-] up to which a sag is one with the tool's pose: some
tenths of a millimetre change by less than a tracker sees."""
_SHORT = 1e-2
"""Length of a tool [m] up to which its tip goes without a turn: a probe at the flange has no bracket."""


@register
class ToolSag(LinearEffect):
    """The tip goes along the flange's axes by ``sag``, row by row, times how far down each points."""

    sag: Value = (0.0,) * 9

    name = 'tool_sag'
    traits = Traits(
        title='sagging tool',
        meaning='the tool or its bracket bends under its own weight',
        formula='tool centre point → tool centre point + S down, S the nine numbers of `sag`, row by '
        'row, down the direction of gravity in the flange; the tool turns about the flange by the '
        'least that takes it there',
        apart={
            'joint_compliance': 'put a dial gauge between flange and tool tip while the wrist turns',
        },
        entered='program',
        depends_on='load',
        place='tool',
        common=False,
    )
    of = 'robot'
    stage = Stage.LINK
    parameters = (
        Parameter('sag', 'm', size=9, typical=1e-4).plausible(
            (1e-4, 3e-3), 'derived: a bracket that a torch of 3 kg bends by 3 mm is broken'
        ),
    )

    def per_unit(self, view: View) -> list[Shift]:
        """Return the way along each axis and the turn with it, by how far down each of them points."""
        down, tool = _down(view), view.robot.T_flange_tool
        lever = tool[:3, 3]
        length = float(np.linalg.norm(lever))
        turns = np.zeros((3, 3))
        if length > _SHORT:
            # Rows: the turn about the tool's own axes for a way along each axis of the flange.
            turns = np.cross(lever, np.eye(3)) @ tool[:3, :3] / length**2
        return [
            {('tool', way): down[..., k]}
            | {('tool', 3 + about): by * down[..., k] for about, by in enumerate(turns[way])}
            for way in range(3)
            for k in range(3)
        ]

    @classmethod
    def applicable(cls, view: View, joint: str | None) -> str | None:
        """Return why the data cannot show it: the tool has to turn against gravity."""
        reason = super().applicable(view, joint)
        if reason is not None:
            return reason
        if float(np.ptp(_down(view).reshape(-1, 3), axis=0).max()) <= _TURNED:
            return 'the tool does not turn against gravity'
        return None

    def remedy(self, robot: Robot) -> str:
        most = float(
            np.linalg.norm(np.asarray(self.sag).reshape(-1, 3, 3), 2, axis=(-2, -1)).max()
        )
        return (
            'Stiffen the bracket of the tool, and see what its cable hangs on: the tip sags by up to '
            f'{number(most * 1e3)} mm as the wrist turns it.'
        )


def _down(view: View) -> Array:
    """Return the direction of gravity in the axes of the flange, (..., N, 3) [-]; zero without any."""
    frames, gravity = view.frames, view.robot.gravity
    down = frames.root_rotation @ (gravity / max(float(np.linalg.norm(gravity)), 1e-12))
    return np.asarray((np.swapaxes(frames.flange_rotation, -1, -2) @ down[..., None])[..., 0])
