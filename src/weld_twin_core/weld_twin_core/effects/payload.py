# Copyright 2026 weld_twin contributors
# SPDX-License-Identifier: Apache-2.0
"""Payload: a mass the model does not know, visible through the joints' compliance."""

from __future__ import annotations

import numpy as np

from ..arm.dynamics import payload_slope, payload_torque
from .effect import Effect, Hooked, Traits, TwinHooks, register
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

    name = 'payload'
    traits = Traits(
        title='wrong payload',
        meaning='the load at the flange is not what was declared',
        formula='τ → τ + torque of mass at com of the tool, on top of the declared payload',
        apart={
            'joint_compliance': 'weigh what hangs on the flange',
        },
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
