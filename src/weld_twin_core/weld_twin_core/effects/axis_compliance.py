# Copyright 2026 weld_twin contributors
# SPDX-License-Identifier: Apache-2.0
"""
Axis compliance: a joint gives way across its axis, as its bearing tips under the load.

The spring of a gear turns a joint about its axis, by the moment about it. The bearing carries the rest
of the moment, and is a spring, too, alike in all directions across the axis: makers of strain-wave
gears state its moment stiffness beside that of the gear. Of the first joint it is the pedestal that
leans, see `pedestal_tilt`.
"""

from __future__ import annotations

import numpy as np

from ..arm.dynamics import carried_moment
from ..arm.vectors import dot
from .effect import Hooked, LinearEffect, SearchHooks, Traits, register
from .view import Parameter, Robot, Shift, Stage, Value, View
from .wording import turn


class _Search(SearchHooks):
    def fits(self, robot: Robot, joint: str | None) -> bool:
        at = -1 if joint is None else robot.index(joint)
        return at > robot.behind and not bool(robot.prismatic[at])


@register
class AxisCompliance(LinearEffect):
    """The axis of a joint turns by ``compliance`` times the moment across it."""

    joint: str
    compliance: Value = 0.0

    name = 'axis_compliance'
    traits = Traits(
        title='compliance across the axis',
        meaning='the bearing of a joint gives way when the load tips its axis',
        formula='the frame in which the joint turns leans about its x and y by compliance · moment '
        'about each, the moment of links, payload and wrench about its origin',
        apart={
            'joint_compliance': 'put a dial gauge on either side of the joint while the arm moves',
        },
        entered='program',
        depends_on='load',
        common=False,
        lacking='is of a joint that turns and hangs on another, and {site!r} does not; what leans '
        'under the first one is pedestal_tilt',
    )
    of = 'joint'
    stage = Stage.LINK
    parameters = (
        Parameter('compliance', 'rad/(N m)', typical=2e-6).plausible(
            (5e-6, -1e-5, 1e-4),
            'derived: as soft as the pedestal of a small arm; see joint_compliance for the lower end',
        ),
    )
    needs = frozenset({'load'})
    search = Hooked(_Search)

    def per_unit(self, view: View) -> list[Shift]:
        """Return the moment about the x and the y of the frame in which the joint turns."""
        robot, chain = view.robot, view.frames
        i = robot.index(self.joint)
        about, frame = chain.rows[i].z_point, view.wrench_frame
        moment = carried_moment(robot, chain, i, about, view.wrench, frame)
        inner = i if robot.convention == 'modified' else i - 1
        row = chain.rows[inner]
        return [{('alpha', inner): dot(row.x, moment), ('beta', inner): dot(row.y, moment)}]

    def remedy(self, robot: Robot) -> str:
        lean = float(np.asarray(self.compliance)) * 1e2
        return (
            f'Look at the bearing of {self.site}: 100 N m across its axis tip it by {turn(lean)}; until '
            'it is replaced compensate the motion.'
        )
