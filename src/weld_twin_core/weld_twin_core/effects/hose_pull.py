# Copyright 2026 weld_twin contributors
# SPDX-License-Identifier: Apache-2.0
"""
Hose pull: the hose package draws the flange towards where it is held, through the joints' springs.

A hose is held at a column or by a spring balancer and pulls the flange with force - stiffness * p,
p the flange in the base frame: the pull is `force` where the base stands, and a spring draws to
force / stiffness. Without a stiffness it is a pull of one size and direction, as balancers with a
tapered drum give it (engineerfix.com, how an overhead tool balancer works). These four numbers are
linear, and follow a pull that changes little over the reach; near the place where the hose is
held its direction turns faster than they can.

The pull is a load: joints yield to it by their compliance, as they do to a payload. So it shows
only where the joints' springs are known, and it differs from a payload by what pulls sideways, and
from the springs themselves because weights do not pull so. A torque of its own on each wrist joint
would need numbers of its own for each, and over one joint's angle it would be a ripple of order
one.
"""

from __future__ import annotations

import numpy as np

from ..arm.dynamics import point_force_torque, wrench_rotation
from ..arm.vectors import components, pad
from .effect import LinearEffect, Traits, register
from .view import Array, Parameter, Robot, Shift, Stage, Value, View
from .wording import number, numbers


@register
class HosePull(LinearEffect):
    """The flange is pulled by ``force`` less ``stiffness`` times its place, in the base frame."""

    force: Value = (0.0, 0.0, 0.0)
    stiffness: Value = 0.0

    name = 'hose_pull'
    traits = Traits(
        title='pull of the hose package',
        meaning='the hoses pull at the flange',
        formula='τ → τ + torque of a pull at the flange, force − stiffness · p, p the flange in'
        ' the base frame',
        apart={
            'payload': 'take the hose package off the flange, or weigh what hangs on it',
        },
        entered='program',
        depends_on='load',
        place='load',
        common=False,
    )
    of = 'robot'
    stage = Stage.LOAD
    parameters = (
        Parameter('force', 'N', size=3, typical=10.0).plausible(
            (20.0, 200.0),
            'derived: as much as the load that a payload may be off by, 2 kg; range derived: ten '
            'times that lifts a small arm',
        ),
        Parameter('stiffness', 'N/m', typical=10.0).plausible(
            (20.0, 200.0),
            'derived: the same pull over a metre of way; a hose that pushes sags instead',
        ),
    )

    def per_unit(self, view: View) -> list[Shift]:
        robot, chain = view.robot, view.frames
        flange, pulls = _pulls(view)
        parts = [point_force_torque(robot, chain, flange, pull) for pull in pulls]
        return [{('tau', i): part[i] for i in range(robot.n)} for part in parts]

    def remedy(self, robot: Robot) -> str:
        return (
            'Lead the hose package so that it hangs free: it pulls the flange by '
            f'({numbers(self.force)}) N along x, y, z of the base, less '
            f'{number(self._plain("stiffness"))} N for every metre away from it.'
        )


def _pulls(view: View) -> tuple[Array, list[Array]]:
    """Return the flange, and a force of one along each base axis and that of a stiffness of one."""
    chain = view.frames
    flange = components(chain.flange_point)
    width = flange.ndim - 1
    away = flange - pad(components(chain.root_point), width)
    base = wrench_rotation(view.robot, chain, 'base')
    axes = [pad(components(base[..., k]), width) for k in range(3)]
    return flange, [*(np.broadcast_to(axis, flange.shape) for axis in axes), -away]
