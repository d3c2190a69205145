# Copyright 2026 weld_twin contributors
# SPDX-License-Identifier: Apache-2.0
"""Cartesian compliance: the tool yields to the force on it, dx = K^-1 F (paper, eq. II.v)."""

from __future__ import annotations

import numpy as np

from ..arm.dynamics import wrench_rotation
from .effect import LinearEffect, Traits, register
from .view import Parameter, Robot, Shift, Stage, Value, View
from .wording import numbers


@register
class CartesianCompliance(LinearEffect):
    """One compliance along each axis of the tool frame, whatever frame the wrench comes in."""

    compliance: Value = (0.0, 0.0, 0.0)

    name = 'cartesian_compliance'
    traits = Traits(
        title='compliance at the tool',
        meaning='the tool gives way under a force',
        formula='p → p + R_tool diag(compliance) R_toolᵀ F',
        entered='stiffness and of the force at the tool',
        depends_on='load',
        place='tool',
    )
    of = 'robot'
    stage = Stage.POSE
    parameters = (
        Parameter('compliance', 'm/N', size=3, typical=1e-6).plausible(
            (5e-6, -1e-6, 1e-4), 'derived: 10 mm under 100 N is the softest arm that still welds'
        ),
    )
    needs = frozenset({'wrench'})

    def per_unit(self, view: View) -> list[Shift]:
        if view.wrench is None:
            still: Shift = {('pose', j): np.zeros(view.q.shape[:-1]) for j in range(3)}
            return [still] * 3
        chain = view.frames
        force = view.wrench[..., :3]
        if view.wrench_frame == 'base':
            world = (wrench_rotation(view.robot, chain, 'base') @ force[..., None])[..., 0]
            force = (np.swapaxes(chain.rotation, -1, -2) @ world[..., None])[..., 0]
        return [
            {('pose', j): chain.rotation[..., j, k] * force[..., k] for j in range(3)}
            for k in range(3)
        ]

    def remedy(self, robot: Robot) -> str:
        each = numbers(np.asarray(self.compliance) * 1e5)
        return f'Compensate the yielding of the tool: ({each}) mm per 100 N along its x, y, z.'
