# Copyright 2026 weld_twin contributors
# SPDX-License-Identifier: Apache-2.0
"""
Tool sag: the tool gives way under its own weight, and by another way in every orientation.

A torch stands on a bracket, and both are springs: the tip goes by a linear map of the weight as the
flange sees it. Nine numbers hold any such map: the weight acts at the centre of the torch and moves
its tip, so the map need not be symmetric. That the tool turns along shows only where poses were
measured, and there it has to earn nine more. Masses of the arm play no part.
"""

from __future__ import annotations

from collections.abc import Iterable
from dataclasses import replace
from typing import Any

import numpy as np

from ..arm.channels import Shift
from ..arm.robot import Robot
from ..arrays import Array
from ..errors import ModelError
from .effect import LinearEffect
from .hooks import Hooked, SearchHooks, Traits
from .registry import register
from .view import Parameter, Stage, Value, View
from .wording import number

_TURNED = 1e-2
"""Change of gravity's direction in the flange [-] up to which a sag is one with the tool's pose: some
tenths of a millimetre change by less than a tracker sees."""


class _Search(SearchHooks):
    effect: ToolSag
    kind: type[ToolSag]

    def joined(self, other: ToolSag) -> ToolSag:
        turns = [one.turn for one in (self.effect, other) if np.size(one.turn)]
        sag = np.asarray(self.effect.sag) + np.asarray(other.sag)
        return replace(self.effect, sag=sag, turn=sum(map(np.asarray, turns)) if turns else ())


@register
class ToolSag(LinearEffect):
    """
    The tip goes along the flange's axes by ``sag``, row by row, times the direction of gravity there.

    ``turn`` is the same of how the tool turns about its own axes; empty where it is left out.
    """

    sag: Value = (0.0,) * 9
    turn: Value = ()

    name = 'tool_sag'
    traits = Traits(
        title='sagging tool',
        meaning='the tool or its bracket bends under its own weight',
        formula='tool centre point → tool centre point + S down, S the nine numbers of `sag`, row by '
        'row, down the direction of gravity in the flange; `turn`, nine numbers or none, is the same '
        'of how the tool turns about its axes',
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
        Parameter('turn', 'rad', size=0, typical=3e-4).plausible(
            (3e-4, 1e-2), 'derived: the same bend over a torch of 0.3 m'
        ),
    )
    search = Hooked(_Search)

    def check(self, robot: Robot) -> None:
        super().check(robot)
        if np.shape(self.turn)[-1:] not in ((0,), (9,)):
            raise ModelError(
                f'{self.name}: turn needs 9 numbers, or none, got shape {np.shape(self.turn)}'
            )

    def per_unit(self, view: View) -> list[Shift]:
        """Return the way along and about each axis, by how far down each of the flange's points."""
        down = _down(view)
        ways = 6 if np.size(self.turn) else 3
        return [{('tool', way): down[..., k]} for way in range(ways) for k in range(3)]

    @classmethod
    def applicable(cls, view: View, joint: str | None) -> str | None:
        """Return why the data cannot show it: the tool has to turn against gravity."""
        reason = super().applicable(view, joint)
        if reason is not None:
            return reason
        if float(np.ptp(_down(view).reshape(-1, 3), axis=0).max()) <= _TURNED:
            return 'the tool does not turn against gravity'
        return None

    @classmethod
    def seeds(cls, view: View, joint: str | None, pull: Array | None = None) -> Iterable[Any]:
        yield cls()
        yield cls(turn=np.zeros(9))

    def to_mapping(self) -> dict[str, Any]:
        """Return the entry of an effects file; without a turn, it lists none."""
        out = super().to_mapping()
        return out if np.size(self.turn) else {k: v for k, v in out.items() if k != 'turn'}

    def remedy(self, robot: Robot) -> str:
        most = float(
            np.linalg.norm(np.asarray(self.sag).reshape(-1, 3, 3), 2, axis=(-2, -1)).max()
        )
        return (
            f'Stiffen the bracket of the tool, and see what its cable hangs on: the tip sags by up to '
            f'{number(most * 1e3)} mm as the wrist turns it.'
        )


def _down(view: View) -> Array:
    """Return the direction of gravity in the axes of the flange, (..., N, 3) [-]; zero without any."""
    frames, gravity = view.frames, view.robot.gravity
    down = frames.root_rotation @ (gravity / max(float(np.linalg.norm(gravity)), 1e-12))
    return np.asarray((np.swapaxes(frames.flange_rotation, -1, -2) @ down[..., None])[..., 0])
