# Copyright 2026 weld_twin contributors
# SPDX-License-Identifier: Apache-2.0
"""Wear: the tool gets shorter along its own axis while it works."""

from dataclasses import dataclass

from ..arm.channels import Shift
from .effect import Effect
from .registry import register
from .view import Parameter, Stage, Value, View


@register
@dataclass(frozen=True, eq=False)
class Wear(Effect):
    """The tool centre point draws back along the tool's z axis, from each recording's start on."""

    rate: Value = 0.0

    name = 'wear'
    depends_on = 'time'
    place = 'tool'
    of = 'robot'
    stage = Stage.LINK
    common = False
    parameters = (Parameter('rate', 'm/s', typical=1e-6),)
    needs = frozenset({'time'})

    def displace(self, view: View) -> Shift:
        """Return minus rate times elapsed time along the tool's z, in the flange's axes."""
        return {key: self.number('rate') * value for key, value in _shorter(view).items()}

    def gradient(self, view: View) -> list[Shift | None]:
        """Return minus the elapsed time along the tool's z."""
        return [_shorter(view)]


def _shorter(view: View) -> Shift:
    along = view.robot.T_flange_tool[:3, 2]
    return {('tool', k): -float(along[k]) * view.elapsed for k in range(3)}
