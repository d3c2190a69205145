# Copyright 2026 weld_twin contributors
# SPDX-License-Identifier: Apache-2.0
"""Joint coupling: theta_i -> theta_i + ratio * theta_source, as in geared wrists."""

from __future__ import annotations

from collections.abc import Iterable

from ..arm.channels import Shift
from ..arm.robot import Robot
from ..arrays import Array
from ..errors import ModelError
from .effect import Effect, LinearEffect
from .hooks import Hooked, SearchHooks, Traits
from .registry import register
from .view import Parameter, Stage, Value, View
from .wording import number


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
        """Yield one instance per neighbour along the chain, where gears share a housing."""
        i = view.robot.index(str(joint))
        for k in (i - 1, i + 1):
            if 0 <= k < view.robot.n:
                yield cls(str(joint), view.robot.joint_names[k], 0.0)

    def remedy(self, robot: Robot) -> str:
        source = self.source
        ratio = self._plain('ratio')
        return (
            f'Enter a coupling of {source} into {self.site}: {number(90.0 * ratio)} deg for every 90 '
            'deg.'
        )
