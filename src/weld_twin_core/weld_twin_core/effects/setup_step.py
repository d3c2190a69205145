# Copyright 2026 weld_twin contributors
# SPDX-License-Identifier: Apache-2.0
"""
Set-up step: the base or the instrument was moved at an instant.

Belongs to a set-up, not to the robot, like `setup_settling`.
"""

from __future__ import annotations

from collections.abc import Iterable
from dataclasses import dataclass

import numpy as np

from ..arm.channels import Channel, Shift
from ..arm.robot import Robot
from ..arrays import Array
from .effect import Effect
from .hooks import Traits
from .registry import register
from .view import Parameter, Plausible, Stage, Value, View, single
from .wording import base_frame

TIMES = 40
"""Times that a search tries, evenly over the recording."""


@register
@dataclass(frozen=True, eq=False)
class SetupStep(Effect):
    """Displacement and turn of the base before the instant ``time`` [s]."""

    xyz: Value = (0.0, 0.0, 0.0)
    rotvec: Value = (0.0, 0.0, 0.0)
    time: float = 0.0

    name = 'setup_step'
    traits = Traits(
        title='moved set-up',
        entered='base',
        depends_on='time',
        place='base',
        cause=False,
        of_setup=True,
    )
    of = 'robot'
    stage = Stage.LINK
    parameters = (
        Parameter(
            'xyz',
            'm',
            size=3,
            typical=1e-4,
            range=Plausible.even(5e-3, 0.1, 'derived: a knock'),
        ),
        Parameter(
            'rotvec',
            'rad',
            size=3,
            typical=1e-4,
            range=Plausible.even(5e-3, 0.1, 'derived: a knock'),
        ),
    )
    options = ('time',)
    needs = frozenset({'time'})

    def displace(self, view: View) -> Shift:
        """Return the displacement on the base before the step; after it the base is as aligned."""
        before = (view.t < self.time).astype(np.float64)
        out: dict[Channel, Array] = {}
        for k in range(3):
            out |= single(('base', k), self.number('xyz', k) * before, view)
            out |= single(('base', k + 3), self.number('rotvec', k) * before, view)
        return out

    def gradient(self, view: View) -> list[Shift | None]:
        """Return one before the step, for each component."""
        before = (view.t < self.time).astype(np.float64)
        return [{('base', k): before} for k in range(6)]

    @classmethod
    def seeds(cls, view: View, joint: str | None, pull: Array | None = None) -> Iterable[Effect]:
        """Yield steps at evenly spread samples, none at the very ends."""
        index = np.linspace(0, view.t.size - 1, TIMES + 2).round().astype(int)[1:-1]
        for k in np.unique(index):
            if k > 0:
                yield cls(time=float(0.5 * (view.t[k - 1] + view.t[k])))

    def remedy(self, robot: Robot) -> str:
        """Return what to mend, in words; see `Effect.remedy`."""
        return (
            f'Fasten the set-up: it moved by {base_frame(-self.vector()[:6])} at '
            f'{self._plain("time"):.4g} s; measure what came before and after apart.'
        )
