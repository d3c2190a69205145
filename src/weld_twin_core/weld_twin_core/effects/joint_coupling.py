# Copyright 2026 weld_twin contributors
# SPDX-License-Identifier: Apache-2.0
"""Joint coupling: theta_i -> theta_i + ratio * theta_source, as in geared wrists."""

from __future__ import annotations

from collections.abc import Iterable
from itertools import combinations

import numpy as np

from ..arm.chain import frames
from ..arm.vectors import cross, dot
from ..errors import ModelError
from .effect import Effect, Hooked, LinearEffect, SearchHooks, Traits, register
from .view import Array, Parameter, Robot, Shift, Stage, Value, View
from .wording import number

_POSTURES = np.array([0.4, 1.0])
"""Positions [rad or m] of all joints at which axes are looked at; at zero many arms are straight."""
_MEETING = 0.01
"""Distance [m] below which axes meet: those of bundled wrists do, or pass by 85 mm or more."""


class _Search(SearchHooks):
    effect: JointCoupling

    @property
    def moved_by(self) -> str:
        """Return the source: its angle is what comes through."""
        return self.effect.source or self.effect.joint


@register
class JointCoupling(LinearEffect):
    """Motion of one joint leaks into another."""

    joint: str
    source: str = ''
    ratio: Value = 0.0

    name = 'joint_coupling'
    traits = Traits(
        title='coupling',
        meaning='turning one joint turns another a little',
        formula='θ → θ + ratio θ_source',
        entered='ratio',
        depends_on='angle',
        demand=2,
        by_motion=True,
    )
    of = 'joint'
    stage = Stage.JOINT
    parameters = (
        Parameter('ratio', '-', typical=3e-4).plausible(
            (1e-3, 2e-2),
            'motion that leaks through a wrist is divided by its reduction of 50:1 to 120:1 '
            '(industrialmonitordirect.com, KR16 mastering deviation): at most 1/50',
        ),
    )
    options = ('source',)
    search = Hooked(_Search)

    def check(self, robot: Robot) -> None:
        super().check(robot)
        if not self.source:
            raise ModelError('joint_coupling needs a source joint')
        robot.index(self.source)
        if self.source == self.joint:
            raise ModelError('joint_coupling: source and joint are the same; use gear_ratio')

    def per_unit(self, view: View) -> list[Shift]:
        return [{('q', view.robot.index(self.joint)): view.joint(view.robot.index(self.source))}]

    @classmethod
    def seeds(cls, view: View, joint: str | None, pull: Array | None = None) -> Iterable[Effect]:
        """
        Yield an instance for every joint whose gear shares a housing with that of this one.

        These are its neighbours along the chain. Of a wrist whose last three axes meet in a point
        the drives run through one another: there the first turns the third, too.
        """
        robot = view.robot
        i, last = robot.index(str(joint)), robot.n - 1
        sources = [i - 1, i + 1]
        if i == last and _spherical_wrist(robot):
            sources.append(last - 2)
        for k in sources:
            if 0 <= k <= last:
                yield cls(str(joint), robot.joint_names[k], 0.0)

    def remedy(self, robot: Robot) -> str:
        source = self.source
        ratio = self._plain('ratio')
        return (
            f'Enter a coupling of {source} into {self.site}: {number(90.0 * ratio)} deg for every 90 '
            'deg.'
        )


def _spherical_wrist(robot: Robot) -> bool:
    """Return whether the last three axes meet in a point, whatever the posture."""
    wrist = range(robot.n - 3, robot.n)
    if wrist[0] < robot.behind or robot.prismatic[wrist].any():
        return False
    rows = frames(robot, _POSTURES[:, None] * np.ones(robot.n)).rows
    for one, other in combinations((rows[i] for i in wrist), 2):
        normal = cross(one.z, other.z)
        apart = np.abs(dot(other.z_point - one.z_point, normal))
        if (apart >= _MEETING * np.sqrt(dot(normal, normal))).any():
            return False
    return True
