# Copyright 2026 weld_twin contributors
# SPDX-License-Identifier: Apache-2.0
"""Cartesian compliance: the tool yields to the force on it, dx = K^-1 F (paper, eq. II.v)."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from ..arm.channels import Shift
from ..arm.dynamics import wrench_rotation
from ..arm.robot import Robot
from ..arrays import Array
from .effect import Effect
from .hooks import Traits
from .registry import register
from .view import Parameter, Plausible, Stage, Value, View
from .wording import number


@register
@dataclass(frozen=True, eq=False)
class CartesianCompliance(Effect):
    """One compliance along each axis of the tool frame, whatever frame the wrench comes in."""

    compliance: Value = (0.0, 0.0, 0.0)

    name = 'cartesian_compliance'
    traits = Traits(
        title='compliance at the tool',
        meaning='the tool gives way under a force',
        entered='stiffness and of the force at the tool',
        depends_on='load',
        place='tool',
    )
    of = 'robot'
    stage = Stage.POSE
    parameters = (
        Parameter(
            'compliance',
            'm/N',
            size=3,
            typical=1e-6,
            range=Plausible(
                5e-6, -1e-6, 1e-4, 'derived: 10 mm under 100 N is the softest arm that still welds'
            ),
        ),
    )
    needs = frozenset({'wrench'})

    def _axis_forces(self, view: View) -> list[Array]:
        """Return for each axis the force along it as a world vector, shape (..., N, 3)."""
        if view.wrench is None:
            return [np.zeros(view.q.shape[:-1] + (3,))] * 3
        chain = view.frames
        force = view.wrench[..., :3]
        if view.wrench_frame == 'base':
            world = (wrench_rotation(view.robot, chain, 'base') @ force[..., None])[..., 0]
            force = (np.swapaxes(chain.rotation, -1, -2) @ world[..., None])[..., 0]
        return [chain.rotation[..., :, k] * force[..., k, None] for k in range(3)]

    def displace(self, view: View) -> Shift:
        """Return the deflection on the pose."""
        x, y, z = (
            np.asarray(self.number('compliance', k))[..., None] * force
            for k, force in enumerate(self._axis_forces(view))
        )
        total = x + y + z
        return {('pose', j): total[..., j] for j in range(3)}

    def gradient(self, view: View) -> list[Shift | None]:
        """Return the force along each axis."""
        forces = self._axis_forces(view)
        return [{('pose', j): force[..., j] for j in range(3)} for force in forces]

    def remedy(self, robot: Robot) -> str:
        """Return what to mend, in words; see `Effect.remedy`."""
        values = np.asarray(self.compliance) * 1e5
        each = ', '.join(number(float(v)) for v in values)
        return f'Compensate the yielding of the tool: ({each}) mm per 100 N along its x, y, z.'
