# Copyright 2026 weld_twin contributors
# SPDX-License-Identifier: Apache-2.0
"""
Joint compliance: q = theta + compliance * tau(q), a linear spring in the drive.

A spring settles where it balances the load of the posture that it has sagged to, as elastic joints
do at rest (Siciliano & Khatib 2016, chapter 11). Diagnoses written before this was so took the
torque of the rigid arm, theta + compliance * tau(theta); ``statics: first_order`` replays them.
"""

from dataclasses import dataclass

from ..arm.channels import Shift
from ..arm.robot import Robot
from ..errors import ModelError
from .effect import Effect
from .registry import register
from .view import Parameter, Stage, Value, View

STATICS = ('equilibrium', 'first_order')


@register
@dataclass(frozen=True, eq=False)
class JointCompliance(Effect):
    """The joint yields to the load torque of links, payload and tool wrench."""

    joint: str
    compliance: Value = 0.0
    statics: str = 'equilibrium'

    name = 'joint_compliance'
    everywhere = True
    by_motion = True
    depends_on = 'load'
    of = 'joint'
    stage = Stage.ELASTIC
    parameters = (Parameter('compliance', 'rad/(N m)', typical=1e-5),)
    needs = frozenset({'load'})
    options = ('statics',)

    def check(self, robot: Robot) -> None:
        """Refuse unknown statics."""
        super().check(robot)
        if self.statics not in STATICS:
            raise ModelError(
                f'joint_compliance: statics must be one of {STATICS}, got {self.statics!r}'
            )

    @property
    def settles(self) -> bool:
        """Return whether the load is the one of the posture that the springs have sagged to."""
        return self.statics == 'equilibrium'

    def displace(self, view: View) -> Shift:
        """Return compliance times load torque; a positive compliance sags."""
        i = view.robot.index(self.joint)
        return {('q', i): self.number('compliance') * view.shift[('tau', i)]}

    def gradient(self, view: View) -> list[Shift | None]:
        """Return the load torque."""
        i = view.robot.index(self.joint)
        return [{('q', i): view.shift[('tau', i)]}]
