# Copyright 2026 weld_twin contributors
# SPDX-License-Identifier: Apache-2.0
"""
Set-up settling: base or instrument creeps to its place while the cell warms up.

Belongs to a set-up, not to the robot: it is part of the frames that an alignment fits, and it is
not carried over to another recording beyond its settled state.
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


@register
@dataclass(frozen=True, eq=False)
class SetupSettling(Effect):
    """Displacement and turn of the base at ``start`` [s], gone with ``time_constant`` [s]."""

    xyz: Value = (0.0, 0.0, 0.0)
    rotvec: Value = (0.0, 0.0, 0.0)
    time_constant: float = 600.0
    start: float = 0.0

    name = 'setup_settling'
    traits = Traits(
        title='settling set-up',
        entered='how the set-up is held',
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
            range=Plausible.even(1e-3, 2e-2, 'derived: what a stand creeps while it warms'),
        ),
        Parameter(
            'rotvec',
            'rad',
            size=3,
            typical=1e-4,
            range=Plausible.even(1e-3, 2e-2, 'derived: a millimetre on a metre'),
        ),
    )
    options = ('time_constant', 'start')
    needs = frozenset({'time'})

    def _left(self, view: View) -> Array:
        """Return the share still to go, shape (N,)."""
        return np.exp(-np.maximum(view.t - self.start, 0.0) / self.time_constant)

    def displace(self, view: View) -> Shift:
        """Return what is left of the displacement on the base."""
        remaining = self._left(view)
        out: dict[Channel, Array] = {}
        for k in range(3):
            out |= single(('base', k), self.number('xyz', k) * remaining, view)
            out |= single(('base', k + 3), self.number('rotvec', k) * remaining, view)
        return out

    def gradient(self, view: View) -> list[Shift | None]:
        """Return the share still to go, for each component."""
        return [{('base', k): self._left(view)} for k in range(6)]

    @classmethod
    def seeds(cls, view: View, joint: str | None, pull: Array | None = None) -> Iterable[Effect]:
        """Yield time constants from a twentieth to half of the recording."""
        span = float(view.elapsed[-1])
        if span > 0.0:
            for share in (0.05, 0.12, 0.25, 0.5):
                yield cls(time_constant=share * span, start=float(view.t[0]))

    def remedy(self, robot: Robot) -> str:
        """Return what to mend, in words; see `Effect.remedy`."""
        return (
            f'Let the set-up settle before measuring: it started {base_frame(self.vector()[:6])} from '
            'where it ended.'
        )
