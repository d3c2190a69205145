# Copyright 2026 weld_twin contributors
# SPDX-License-Identifier: Apache-2.0
"""
Pedestal tilt: the base leans under the moment of the arm on it.

Two springs hold it, about the base's x and its y: lean = compliance * moment, the moment that of
the weights of links and payload and of the tool wrench about the base's origin. It follows the
posture, where an error of the base pose stays as it is. A spring of the second joint bends the arm
by nearly the same moment, but at the shoulder, and about its own axis only; the pedestal leans
below it and both ways. Makers ask for a stiff foundation because of it: manual of an ABB IRB 4400,
3HAC022032-001, p. 39 (easymanua.ls).
"""

from __future__ import annotations

import numpy as np

from ..arm.dynamics import carried_moment, wrench_rotation
from ..arm.vectors import components, dot, pad
from .effect import LinearEffect, Traits, register
from .view import Array, Channel, Parameter, Robot, Shift, Stage, Value, View
from .wording import number

_CHANGED = 1e-6
"""Share of the largest moment by which it must change, above rounding: without any, a lean is a base
pose. Whether the data show a small change, the fits of both say."""


@register
class PedestalTilt(LinearEffect):
    """The base leans about its x and its y by ``compliance`` times the moment about each."""

    compliance: Value = (0.0, 0.0)

    name = 'pedestal_tilt'
    traits = Traits(
        title='leaning pedestal',
        meaning="the pedestal under the robot bends under the arm's weight",
        formula='the base leans about its x and y by compliance · moment about each, the moment'
        ' of links, declared payload and wrench about its origin',
        apart={
            'joint_compliance': 'put a level or a dial gauge on the base while the arm moves',
        },
        entered='program',
        depends_on='load',
        place='base',
        common=False,
    )
    of = 'robot'
    stage = Stage.LINK
    parameters = (
        Parameter('compliance', 'rad/(N m)', size=2, typical=2e-6).plausible(
            (1e-5, -1e-5, 1e-4),
            'a foundation shall swing above 30 Hz with the arm on it (ABB IRB 4400, 3HAC022032-001, '
            'p. 39, easymanua.ls): 1e-5 under a small arm of 3 kg m^2 about its foot; range '
            'derived: at 10 Hz it swings to the eye; see joint_compliance for the lower end',
        ),
    )
    needs = frozenset({'load'})

    def per_unit(self, view: View) -> list[Shift]:
        """Return the moment about each axis, as a turn of the base in the world; it sags."""
        axes = view.robot.T_base_foot[:3, :2].T
        return [
            {channel: share * moment for channel, share in lean.items()}
            for lean, moment in zip(base_leans(view.robot, axes), base_moments(view), strict=True)
        ]

    @classmethod
    def applicable(cls, view: View, joint: str | None) -> str | None:
        """Return why the data cannot show it: the moment has to change."""
        reason = super().applicable(view, joint)
        if reason is not None:
            return reason
        moment = np.stack(base_moments(view))
        change = np.linalg.norm(np.ptp(moment, axis=-1))
        if change <= _CHANGED * np.linalg.norm(moment, axis=0).max(initial=0.0):
            return 'the moment on the pedestal does not change'
        return None

    def remedy(self, robot: Robot) -> str:
        x, y = np.asarray(self.compliance) * 1e2
        return (
            'Stiffen the pedestal or its anchors: under 100 N m it leans by '
            f'{number(float(np.degrees(x)))} deg about x of the base and by '
            f'{number(float(np.degrees(y)))} deg about y; until then compensate the motion.'
        )


def base_moments(view: View) -> tuple[Array, Array]:
    """Return the moments about the base's x and y that the arm and its load make, (..., N) [N m]."""
    robot, chain = view.robot, view.frames
    foot = pad(components(chain.root_point), chain.position.ndim - 1)
    moment = carried_moment(robot, chain, robot.behind, foot, view.wrench, view.wrench_frame)
    axes = wrench_rotation(robot, chain, 'base')
    x, y = (dot(pad(components(axes[..., k]), moment.ndim - 1), moment) for k in range(2))
    return x, y


def base_leans(robot: Robot, axes: Array) -> list[dict[Channel, float]]:
    """
    Return the channels that turn an arm's base about axes (K, 3) of its frame through its origin.

    Beside a positioner a lean of the arm is that of the positioner the other way round: the frames
    between the two are all that the chain has.
    """
    if not robot.behind:
        turned = axes @ robot.T_world_base[:3, :3].T
        return [{('base', 3 + k): float(axis[k]) for k in range(3)} for axis in turned]
    foot = np.linalg.inv(robot.T_root_base)[:3, 3]
    return [
        {('root', k): float(value) for k, value in enumerate([*-np.cross(axis, foot), *-axis])}
        for axis in axes
    ]
