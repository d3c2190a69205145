# Copyright 2026 weld_twin contributors
# SPDX-License-Identifier: Apache-2.0
"""Joint compliance: theta -> theta + compliance * tau, a linear spring in the drive."""

from dataclasses import dataclass

from ..arm.channels import Shift
from .effect import Effect
from .registry import register
from .view import Parameter, Stage, Value, View


@register
@dataclass(frozen=True, eq=False)
class JointCompliance(Effect):
    """The joint yields to the load torque of links, payload and tool wrench."""

    joint: str
    compliance: Value = 0.0

    name = 'joint_compliance'
    everywhere = True
    by_motion = True
    depends_on = 'load'
    of = 'joint'
    stage = Stage.ELASTIC
    parameters = (Parameter('compliance', 'rad/(N m)', typical=1e-5),)
    needs = frozenset({'load'})

    def displace(self, view: View) -> Shift:
        """Return compliance times load torque; a positive compliance sags."""
        i = view.robot.index(self.joint)
        return {('q', i): self.number('compliance') * view.shift[('tau', i)]}

    def gradient(self, view: View) -> list[Shift | None]:
        """Return the load torque."""
        i = view.robot.index(self.joint)
        return [{('q', i): view.shift[('tau', i)]}]
