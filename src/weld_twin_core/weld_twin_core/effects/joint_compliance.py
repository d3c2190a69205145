# Copyright 2026 weld_twin contributors
# SPDX-License-Identifier: Apache-2.0
"""
Joint compliance: q = theta + compliance * tau(q), a linear spring in the drive.

A spring settles where it balances the load of the posture that it has sagged to, as elastic joints
do at rest (Siciliano & Khatib 2016, chapter 11). Diagnoses written before this was so took the
torque of the rigid arm, theta + compliance * tau(theta); ``statics: first_order`` replays them.

Where the controller measures the effort of its joints, tau is given: ``statics: effort`` takes the
load that the effort holds, tau = -effort, and ``statics: effort_reversed`` that of a controller that
tells the load itself, tau = effort. No mass of a link counts then, nor does any load that nobody
declared: both are in what was measured.
"""

from __future__ import annotations

from collections.abc import Iterable

import numpy as np

from ..arm.robot import STANDARD_GRAVITY
from ..errors import DataError, ModelError
from .effect import Effect, Hooked, LinearEffect, SearchHooks, Traits, TwinHooks, register
from .view import Array, Parameter, Plausible, Robot, Shift, Stage, Value, View
from .wording import metres, radians, size

_SOFTEST = 3e-4
"""Compliance of the softest joint [rad/(N m)] of an arm that is heavy enough for it."""
_SAG = np.pi / 180.0
"""Most that a joint sags under its arm's own weight [rad]: a degree is seen by the eye. A judgement."""
LOAD_OF_EFFORT = {'effort': -1.0, 'effort_reversed': 1.0}
"""Load torque for each N m of measured effort: against it where it holds the load."""
_STATICS = ('equilibrium', 'first_order', *LOAD_OF_EFFORT)


def lightness(robot: Robot) -> float:
    """
    Return how many times as soft as a cobot's the joints of a robot may be, at least 1.

    Gears are as stiff as what they carry is heavy: a servo on a desk holds a newton metre, and yields a
    hundred times as much to one as a cobot does. The moment is that of links and payload at half of
    the reach, wherever the arm hangs: no gear is softer for that. Where no masses are known, 1.
    """
    mass = 0.0 if robot.mass is None else float(robot.mass.sum())
    reach = float(np.hypot(robot.a, np.where(robot.prismatic, 0.0, robot.d)).sum())
    if not mass * reach:
        return 1.0
    moment = 0.5 * (mass + robot.payload_mass) * np.linalg.norm(STANDARD_GRAVITY) * reach
    return max(_SAG / float(moment) / _SOFTEST, 1.0)


class _Twin(TwinHooks):
    effect: JointCompliance

    @property
    def settles(self) -> bool:
        return self.effect.statics == 'equilibrium'

    @property
    def by_effort(self) -> float:
        return LOAD_OF_EFFORT.get(self.effect.statics, 0.0)


class _Search(SearchHooks):
    effect: JointCompliance

    @property
    def moved_by(self) -> str | None:
        """Return the joint that must move for it to be seen: none where its load is measured."""
        return None if self.effect.twin.by_effort else self.effect.joint


@register
class JointCompliance(LinearEffect):
    """The joint yields to the load torque of links, payload and tool wrench; above zero it sags."""

    joint: str
    compliance: Value = 0.0
    statics: str = 'equilibrium'

    name = 'joint_compliance'
    traits = Traits(
        title='compliance',
        meaning='a joint gives way under load, like a spring',
        formula='q = θ + compliance τ(q), τ the load torque of links, payload and wrench where '
        'the springs have settled; with `statics: effort`, what the controller measured',
        entered='program',
        depends_on='load',
        changes_in_use=True,
        by_motion=True,
        everywhere=True,
    )
    of = 'joint'
    stage = Stage.ELASTIC
    parameters = (
        Parameter(
            'compliance',
            'rad/(N m)',
            typical=1e-5,
            range=Plausible(
                3e-5,
                -1e-5,
                _SOFTEST,
                'derived: 3,000 N m/rad is the softest gear of a small cobot; see `lightness` for '
                'smaller arms; a little below zero is a controller that mends too much',
                times=lightness,
            ),
        ).plausible_sliding((1e-6, -1e-7, 1e-4), 'derived: 10 mm under 100 N is the softest axis'),
    )
    needs = frozenset({'load'})
    options = ('statics',)
    twin = Hooked(_Twin)
    search = Hooked(_Search)

    def check(self, robot: Robot) -> None:
        super().check(robot)
        if self.statics not in _STATICS:
            raise ModelError(
                f'joint_compliance: statics must be one of {_STATICS}, got {self.statics!r}'
            )

    def per_unit(self, view: View) -> list[Shift]:
        """Return the load torque, by the model's statics or as it was measured."""
        i = view.robot.index(self.joint)
        if not self.twin.by_effort:
            return [{('q', i): view.shift[('tau', i)]}]
        if view.effort is None:
            raise DataError(
                f'joint_compliance of {self.joint} takes the measured effort of the joints '
                f'(statics: {self.statics}), and none was recorded here; record it in '
                'JointState.effort, or diagnose without --use-effort for a model that needs none'
            )
        return [{('q', i): self.twin.by_effort * view.effort[..., i]}]

    @classmethod
    def applicable(cls, view: View, joint: str | None) -> str | None:
        return None if view.effort is not None else super().applicable(view, joint)

    @classmethod
    def seeds(cls, view: View, joint: str | None, pull: Array | None = None) -> Iterable[Effect]:
        """Yield the spring, by measured effort where it is there."""
        if view.effort is None:
            yield cls(str(joint))
        else:
            yield cls(str(joint), statics='effort' if view.effort_holds else 'effort_reversed')

    def remedy(self, robot: Robot) -> str:
        compliance = self._plain('compliance')
        slides = self.on_slide(robot)
        stiffness = (
            f'a stiffness of {size(1e-3 / compliance)} kN{"/m" if slides else " m/rad"}'
            if compliance > 0.0
            else 'which no spring does'
        )
        return (
            f'Compensate the yielding of {self.site} under load: '
            f'{metres(compliance * 1e2) if slides else radians(compliance * 1e2)} under '
            f'100 N{"" if slides else " m"}, {stiffness}.'
        )
