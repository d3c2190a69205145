# Copyright 2026 weld_twin contributors
# SPDX-License-Identifier: Apache-2.0
"""
Loads that the model does not know, visible through the joints' compliance: a payload, and hoses.

A hose is held at a column or by a spring balancer and pulls the flange with force - stiffness * p,
p the flange in the base frame: the pull is `force` where the base stands, and a spring draws to
force / stiffness. Without a stiffness it is a pull of one size and direction, as balancers with a
tapered drum give it (engineerfix.com, how an overhead tool balancer works). These four numbers are
linear, and follow a pull that changes little over the reach; near the place where the hose is
held its direction turns faster than they can.

Joints yield to the pull by their compliance, as they do to a payload. So it shows only where the
joints' springs are known, and it differs from a payload by what pulls sideways, and from the
springs themselves because weights do not pull so. A torque of its own on each wrist joint would
need numbers of its own for each, and over one joint's angle it would be a ripple of order one.
"""

from __future__ import annotations

import numpy as np

from ..arm.dynamics import payload_slope, payload_torque, point_force_torque, wrench_rotation
from ..arm.vectors import components, pad
from .effect import Effect, Hooked, LinearEffect, Traits, TwinHooks, register
from .view import Array, Parameter, Plausible, Robot, Shift, Stage, Value, View
from .wording import number, numbers

_OWN_WEIGHT = 0.5
"""Share of its own weight that no arm carries; those of welding carry a tenth to a third."""
_BELOW = 0.05
"""Share of an arm's own weight by which published masses of its links are off."""
_UNSTATED_MASS = 20.0
"""Load [kg] taken as most where an arm's own masses are not known."""


def mass_range(robot: Robot) -> tuple[float, float]:
    """Return how much less and more than declared a payload can weigh [kg]."""
    own = _UNSTATED_MASS / _OWN_WEIGHT if robot.mass is None else float(robot.mass.sum())
    return -robot.payload_mass - _BELOW * own, _OWN_WEIGHT * own - robot.payload_mass


class _Twin(TwinHooks):
    effect: Payload

    def load_slope(self, view: View) -> Array:
        return payload_slope(
            view.robot, view.frames, self.effect.number('mass'), self.effect._centre()
        )


@register
class Payload(Effect):
    """``mass`` is added to the declared payload, its centre at ``com`` of the tool frame."""

    mass: Value = 0.0
    com: Value = (0.0, 0.0, 0.0)

    traits = Traits(
        title='wrong payload',
        meaning='the load at the flange is not what was declared',
        formula='τ → τ + torque of mass at com of the tool, on top of the declared payload',
        apart={'joint_compliance': 'weigh what hangs on the flange'},
        entered='load',
        depends_on='load',
        place='load',
        changes_in_use=True,
        common=False,
    )
    of = 'robot'
    stage = Stage.LOAD
    parameters = (
        Parameter(
            'mass',
            'kg',
            typical=1.0,
            range=Plausible(
                2.0,
                -np.inf,
                np.inf,
                'derived: see `mass_range`; no arm carries half of what it weighs itself',
                by_robot=mass_range,
            ),
        ),
        Parameter('com', 'm', size=3, typical=0.05, linear=False).plausible(
            (0.1, 0.5), 'derived: centres of torches and grippers lie within half a metre'
        ),
    )
    twin = Hooked(_Twin)

    def displace(self, view: View) -> Shift:
        torque = payload_torque(view.robot, view.frames, self.number('mass'), self._centre())
        return _on_joints(torque)

    def _centre(self) -> Array:
        com = np.asarray(self.com, dtype=np.float64)
        return com[..., None, :] if com.ndim > 1 else com

    def gradient(self, view: View) -> list[Shift | None]:
        robot, chain = view.robot, view.frames
        out: list[Shift | None] = [_on_joints(payload_torque(robot, chain, 1.0, self._centre()))]
        origin = payload_torque(robot, chain, 1.0, np.zeros(3))
        for k in range(3):
            lever = payload_torque(robot, chain, 1.0, np.eye(3)[k]) - origin
            out.append(_on_joints(self.number('mass') * lever))
        return out

    def remedy(self, robot: Robot) -> str:
        extra = self._plain('mass')
        where = numbers(np.asarray(self.com) * 1e3)
        return (
            f'Enter a payload of {robot.payload_mass + extra:.2f} kg in place of '
            f'{robot.payload_mass:.2f} kg; the {number(extra)} kg lie at ({where}) mm in the tool '
            'frame.'
        )


def _on_joints(torque: Array) -> Shift:
    return {('tau', i): torque[i] for i in range(torque.shape[0])}


@register
class HosePull(LinearEffect):
    """The flange is pulled by ``force`` less ``stiffness`` times its place, in the base frame."""

    force: Value = (0.0, 0.0, 0.0)
    stiffness: Value = 0.0

    traits = Traits(
        title='pull of the hose package',
        meaning='the hoses pull at the flange',
        formula='τ → τ + torque of a pull at the flange, force − stiffness · p, p the flange in'
        ' the base frame',
        apart={'payload': 'take the hose package off the flange, or weigh what hangs on it'},
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
