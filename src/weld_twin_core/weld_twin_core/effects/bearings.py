# Copyright 2026 weld_twin contributors
# SPDX-License-Identifier: Apache-2.0
"""
Bearings and guides: an axis that wobbles, and a guide that is bent or on which its carriage tilts.

Bearing tilt is run-out: the axis leans once per turn of its joint, or twice.

The lean is a small turn of the frame that the joint turns in, about that frame's x and y axes,
each a cosine and a sine of the joint's angle. A lean that goes round with the joint is the same
at every angle seen from the link, and is `link_twist`; a bearing with a high spot rocks instead.

Run-out is read as its first harmonics [1]_: an oval race adds a wave of twice the angle. It is in
the model only where it earns its numbers beside the first. Left out where it is large, a constant
of the arm is found in its place.

A constant and a slope of the guide of a joint that slides are errors of links; what is left of a
bent one is first of all a parabola. A lever makes a tilt large: a carriage that pitches by 0.1 mrad
moves a tool two metres above it by 0.2 mm, and its mean over the travel is an error of links.

References
----------
.. [1] R. R. Donaldson, "A simple method for separating spindle error from test ball roundness
   error", Annals of the CIRP 21, 1972: the error motion of an axis as a series in its angle.

"""

from __future__ import annotations

from collections.abc import Iterable
from dataclasses import replace
from typing import Any

import numpy as np

from ..arm.vectors import components, cross, pad
from ..errors import ModelError
from .compliance import base_leans
from .effect import Hooked, LinearEffect, SearchHooks, Traits, register
from .view import Array, Channel, Parameter, Robot, Shift, Stage, Value, View
from .wording import numbers, size, turn


class _Search(SearchHooks):
    effect: BearingTilt
    kind: type[BearingTilt]

    def small(self, view: View, joint: str | None, most: int) -> list[BearingTilt]:
        """Return the wave of once per turn: among many small errors the second is far below them."""
        return [self.kind(str(joint))]

    def joined(self, other: BearingTilt) -> BearingTilt:
        both = [one.second for one in (self.effect, other) if np.size(one.second)]
        lean = np.asarray(self.effect.lean) + np.asarray(other.lean)
        return replace(self.effect, lean=lean, second=sum(map(np.asarray, both)) if both else ())

    def fits(self, robot: Robot, joint: str | None) -> bool:
        return joint is not None and not robot.prismatic[robot.index(joint)]


@register
class BearingTilt(LinearEffect):
    """
    The axis turns about x by lean[0] cos q + lean[1] sin q, and about y by the other two.

    ``second`` is the same with the cosine and sine of 2 q; empty where it is left out.
    """

    joint: str
    lean: Value = (0.0, 0.0, 0.0, 0.0)
    second: Value = ()

    traits = Traits(
        title='axis wobble',
        meaning='an axis leans as it turns, once or twice per turn',
        formula='the frame in which the joint turns leans about its x by lean₀ cos θ + lean₁ '
        'sin θ, about its y by lean₂ cos θ + lean₃ sin θ; `second`, four numbers or '
        'none, adds the same with 2 θ',
        entered='program',
        depends_on='angle',
        common=False,
        by_motion=True,
    )
    of = 'joint'
    stage = Stage.LINK
    parameters = (
        Parameter('lean', 'rad', size=4, typical=2e-4).plausible(
            (2e-4, 3e-3),
            'derived: two hundredths of a millimetre of run-out on a bearing of 0.1 m',
        ),
        Parameter('second', 'rad', size=0, typical=2e-4).plausible(
            (1e-4, 1.5e-3),
            'derived: an oval race leans less than one that is off centre; half of lean',
        ),
    )
    search = Hooked(_Search)

    def check(self, robot: Robot) -> None:
        super().check(robot)
        if np.shape(self.second)[-1:] not in ((0,), (4,)):
            raise ModelError(
                f'{self.name}: second needs 4 numbers, or none, got shape {np.shape(self.second)}'
            )

    def _waves(self) -> Iterable[tuple[str, int]]:
        """Return which waves there are: a parameter, and how often per turn."""
        return (('lean', 1), ('second', 2))[: 1 + (np.shape(self.second)[-1] > 0)]

    def _parts(self, view: View, times: int) -> list[Shift]:
        """Return what a lean of one does, for each of the four of a wave."""
        i = view.robot.index(self.joint)
        angle = times * view.joint(i)
        waves = (np.cos(angle), np.sin(angle))
        return [
            {channel: share * wave for channel, share in axis.items()}
            for axis in _axes(view, i)
            for wave in waves
        ]

    def per_unit(self, view: View) -> list[Shift]:
        """Return the leans of the frame before the joint, each a wave."""
        return [part for _, times in self._waves() for part in self._parts(view, times)]

    @classmethod
    def seeds(cls, view: View, joint: str | None, pull: Array | None = None) -> Iterable[Any]:
        yield cls(str(joint))
        yield cls(str(joint), second=np.zeros(4))

    def to_mapping(self) -> dict[str, Any]:
        """Return the entry of an effects file; without a second wave, it lists none."""
        out = super().to_mapping()
        return out if np.size(self.second) else {k: v for k, v in out.items() if k != 'second'}

    def remedy(self, robot: Robot) -> str:
        lean = float(np.linalg.norm(np.asarray(self.lean)))
        return (
            f'Look at the bearing of {self.site}: its axis leans by {turn(lean)} once per turn; '
            'compensate the poses until it is replaced.'
        )


def _axes(view: View, i: int) -> list[dict[Channel, float]]:
    """Return the channels that turn the frame before joint i about its x and its y."""
    robot = view.robot
    if robot.convention == 'modified':
        return [{('alpha', i): 1.0}, {('beta', i): 1.0}]
    behind = robot.behind
    if i + 1 == behind:
        axes = np.linalg.inv(robot.T_root_base)[:3, :2].T
        return [{('root', 3 + k): float(axis[k]) for k in range(3)} for axis in axes]
    if i == behind:
        return base_leans(robot, np.eye(3)[:2])
    inner = i + 1 if i < behind else i - 1
    return [{('alpha', inner): 1.0}, {('beta', inner): 1.0}]


class _GuideSearch(SearchHooks):
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
    search = Hooked(_GuideSearch)


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
