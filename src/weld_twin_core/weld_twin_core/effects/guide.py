# Copyright 2026 weld_twin contributors
# SPDX-License-Identifier: Apache-2.0
"""
The guide of a joint that slides: bent, or its carriage tilts on its way.

A constant and a slope of a guide are errors of links; what is left of a bent one is first of all a
parabola. A lever makes a tilt large: a carriage that pitches by 0.1 mrad moves a tool two metres above
it by 0.2 mm, and its mean over the travel is an error of links.
"""

from __future__ import annotations

from dataclasses import replace

import numpy as np

from ..arm.vectors import components, cross, pad
from .effect import Hooked, LinearEffect, SearchHooks, Traits, register
from .view import Array, Parameter, Robot, Shift, Stage, Value, View
from .wording import numbers, size


class _Search(SearchHooks):
    def fits(self, robot: Robot, joint: str | None) -> bool:
        return joint is not None and bool(robot.prismatic[robot.index(joint)])


class _GuideError(LinearEffect):
    """An error of a guide; its carriage leaves the straight line by the posture of one joint."""

    of = 'joint'
    traits = Traits(
        depends_on='angle',
        common=False,
        by_motion=True,
        lacking='is of a joint that slides, and {site!r} turns',
    )
    search = Hooked(_Search)


def _carriage_axes(view: View, i: int) -> tuple[Array, Array, Array]:
    """Return the x, y and z of a guide in the world at the samples, each (3, ...); z is along it."""
    row, width = view.frames.rows[i], view.frames.position.ndim - 1
    z = pad(row.z, width)
    x = pad(row.x if view.robot.convention == 'standard' else cross(row.y, row.z), width)
    return x, cross(z, x), z


def _displacement(view: View, i: int, slide: Array | None, turn: Array | None) -> Shift:
    """Return how the pose moves where a carriage is slid or turned by (3, ...) in the world [m, rad]."""
    way = -1.0 if i < view.robot.behind else 1.0
    if turn is None:
        assert slide is not None
        return {('pose', k): way * slide[k] for k in range(3)}
    row, tip = view.frames.rows[i], components(view.frames.position)
    travel = view.robot.d[i] + view.joint(i)
    origin = pad(row.z_point, tip.ndim - 1) + travel * pad(row.z, tip.ndim - 1)
    moved = cross(turn, tip - origin)
    parts = np.broadcast_arrays(*moved, *turn)
    return {('pose', k): way * part for k, part in enumerate(parts)}


@register
class GuideTilt(_GuideError):
    """The carriage turns by rate * q about the x, y and z of its row; z is along the travel."""

    joint: str
    rate: Value = (0.0, 0.0, 0.0)

    name = 'guide_tilt'
    traits = replace(
        _GuideError.traits,
        title='tilting carriage',
        meaning='the carriage of a joint that slides turns on its way',
        formula='that carriage turns by rate · q about x, y and z of its row, about its own '
        'origin',
        entered='program',
    )
    stage = Stage.POSE
    parameters = (
        Parameter('rate', 'rad/m', size=3, typical=2e-4).plausible(
            (2e-4, 5e-3), 'derived: rails laid to 0.1 mm on a metre, half a metre apart'
        ),
    )

    def per_unit(self, view: View) -> list[Shift]:
        i = view.robot.index(self.joint)
        axes = _carriage_axes(view, i)
        return [_displacement(view, i, None, view.joint(i) * axis) for axis in axes]

    def remedy(self, robot: Robot) -> str:
        each = numbers(np.degrees(self.rate))
        return (
            f'Level the guide of {self.site}: its carriage turns by ({each}) deg about x, y, z of '
            'its row on every metre; until then compensate the motion.'
        )


@register
class GuideBend(_GuideError):
    """The carriage is off by curvature * q^2 / 2 along the x and the y of its row."""

    joint: str
    curvature: Value = (0.0, 0.0)

    name = 'guide_bend'
    traits = replace(
        _GuideError.traits,
        title='bent guide',
        meaning='the guide of a joint that slides is no straight line',
        formula='the carriage of a joint that slides is off by curvature · q² / 2 along the x '
        'and y of its row',
        entered='program',
    )
    stage = Stage.POSE
    parameters = (
        Parameter('curvature', '1/m', size=2, typical=2e-4).plausible(
            (2e-4, 5e-3),
            'derived: a rail laid to 0.1 mm on a metre; range derived: 2.5 mm on a metre is '
            'seen by the eye',
        ),
    )

    def per_unit(self, view: View) -> list[Shift]:
        i = view.robot.index(self.joint)
        x, y, _ = _carriage_axes(view, i)
        bow = 0.5 * view.joint(i) ** 2
        return [_displacement(view, i, bow * axis, None) for axis in (x, y)]

    def remedy(self, robot: Robot) -> str:
        x, y = np.asarray(self.curvature) * 0.125e3
        return (
            f'Align the guide of {self.site}: over a metre it is bent by {size(float(x))} mm along x '
            f'and {size(float(y))} mm along y of its row; until then compensate the motion.'
        )
