# Copyright 2026 weld_twin contributors
# SPDX-License-Identifier: Apache-2.0
"""
Gear ratio: theta -> (1 + scale) theta, and by direction, (1 + difference / 2 * way) theta.

way goes from -1 (down) to 1 (up). Teeth touch on one flank while the joint turns up and on the other
while it turns down. Where the two are not cut alike, either way has a ratio of its own. Their mean is
`gear_ratio`, their distance at the joint's zero is `backlash`; the difference is what that distance
grows by with the angle. Once a joint turns back, the teeth change flanks evenly over ``travel``; at
rest they stay.

The motion of one joint may leak into another as well, as in geared wrists: theta_i -> theta_i +
ratio * theta_source.
"""

from __future__ import annotations

from collections.abc import Iterable
from itertools import combinations
from typing import Any

import numpy as np
from numpy.typing import NDArray

from ..arm.chain import frames
from ..arm.vectors import cross, dot
from ..errors import ModelError
from .associative_scan import last_true, play
from .effect import (
    Effect,
    Hooked,
    LinearEffect,
    MemoryEffect,
    SearchHooks,
    Traits,
    TwinHooks,
    register,
)
from .view import Array, Parameter, Robot, Shift, Stage, Value, View, single
from .wording import number, size


class _Twin(TwinHooks):
    effect: GearRatio

    def slope(self, view: View) -> Shift:
        return single(
            ('q', view.robot.index(self.effect.joint)), self.effect.number('scale'), view
        )


@register
class GearRatio(LinearEffect):
    """A wrong transmission or encoder scale: the error grows with the joint's angle."""

    joint: str
    scale: Value = 0.0

    traits = Traits(
        title='gear ratio error',
        meaning='a joint turns by a constant factor too far',
        formula='θ → (1 + scale) θ',
        entered='ratio',
        depends_on='angle',
        demand=1,
        by_motion=True,
        everywhere=True,
    )
    of = 'joint'
    stage = Stage.JOINT
    parameters = (
        Parameter('scale', '-', typical=3e-4).plausible(
            (1e-3, 2e-2),
            'derived: tooth numbers are exact, what is left is belts and scales of encoders; '
            'one tooth in fifty is the coarsest wrong ratio',
        ),
    )
    twin = Hooked(_Twin)

    def per_unit(self, view: View) -> list[Shift]:
        return [self._moves(view, self._theta(view))]

    def remedy(self, robot: Robot) -> str:
        scale = self._plain('scale')
        if self.on_slide(robot):
            return (
                f'Enter the feed of {self.site} (mm of travel per turn of the motor) times '
                f'{1.0 + scale:.6f}: it goes {number(scale * 1e3)} mm further on every metre than it '
                'reads.'
            )
        return (
            f'Enter the gear ratio of {self.site} times {1.0 + scale:.6f} where it is turns of the '
            'joint per turn of the motor, divided by it where it is turns of the motor per turn of '
            f'the joint: it turns {number(scale * 100.0)} % of its angle further than it reads.'
        )


_TRAVELS = (3e-5, 3e-4)
"""Travels [rad] that a search starts from: a longer one is a loop, `hysteresis`."""
_SHOWN = 0.04
"""
Angle [rad] that must be left, RMS, of what one unit of it does: less is play and a constant ratio.

As far as a joint has to move for its gear ratio to be looked for.
"""


@register
class GearRatioByDirection(MemoryEffect):
    """The gear ratio is ``difference`` larger on the way up than on the way down."""

    joint: str
    difference: Value = 0.0
    travel: Value = 1e-4

    traits = Traits(
        title='gear ratio that differs by direction',
        meaning='the same, with another factor each way',
        formula='θ → θ + difference/2 · z θ, z = 2 (θ − w) / travel with w the play of width '
        '`travel`: 1 on the way up, −1 on the way down',
        entered="the joint's gear",
        depends_on='direction',
        common=False,
        by_motion=True,
    )
    of = 'joint'
    stage = Stage.PLAY
    parameters = (
        Parameter('difference', '-', typical=3e-4, idealised=0.05).plausible(
            (1e-3, 2e-2),
            'derived: as gear_ratio; at a radian from zero the flanks are then as far apart '
            'as the play of a gear that is broken',
        ),
        Parameter('travel', 'rad', typical=1e-4, lower=1e-6, linear=False, idealised=0.3)
        .plausible(
            (1e-3, 1e-6, 2e-3),
            'derived: teeth change flanks as friction builds up; a longer travel is '
            'a loop of the gear, hysteresis',
        )
        .plausible_sliding((1e-4, 1e-7, 2e-4), 'derived: as the travel of friction'),
    )
    needs = frozenset({'order'})

    def _way(self, q: Array, state: Any = None) -> tuple[Array, NDArray[np.intp], Any]:
        """Return the way, the sample at which a flank was last touched, -1 for none, the state."""
        half = 0.5 * self.number('travel')
        output = play(q, 2.0 * half, q[..., 0] if state is None else state)
        behind = q - output
        rounding = 4.0 * np.spacing(np.abs(q).max(initial=1.0))
        return behind / half, last_true(np.abs(behind) >= half - rounding), output[..., -1]

    def run(self, view: View, state: Any = None) -> tuple[Shift, Any]:
        """Return half the difference of the angle, up or down, and where the gear is as state."""
        way, _, state = self._way(self._theta(view), state)
        return self._moves(view, 0.5 * self.number('difference') * way * self._theta(view)), state

    def gradient(self, view: View) -> list[Shift | None]:
        """Return half the angle, up or down, and how the change of flanks waits for the travel."""
        q = self._theta(view)
        way, touched, _ = self._way(q)
        remaining = np.where(
            touched >= 0, np.take_along_axis(way, np.maximum(touched, 0), -1), 0.0
        )
        slow = (np.sign(remaining) - way) / self.number('travel')
        slow = np.where(np.arange(q.shape[-1]) == touched, 0.0, slow)
        return [
            self._moves(view, 0.5 * way * q),
            self._moves(view, 0.5 * self.number('difference') * slow * q),
        ]

    def push(self, view: View, tangent: Array) -> Array:
        """Add the tangent's own part of the ratio, and what it hastens a change of flanks by."""
        q = self._theta(view)
        way, touched, _ = self._way(q)
        at = np.broadcast_to(np.maximum(touched, 0), tangent.shape)
        since = tangent - np.take_along_axis(tangent, at, -1)
        turned = q * since / (0.5 * self.number('travel'))
        return np.asarray(tangent + 0.5 * self.number('difference') * (way * tangent + turned))

    def atoms(self, view: View) -> list[Shift]:
        return [self._moves(view, 0.5 * self._way(self._theta(view))[0] * self._theta(view))]

    @classmethod
    def seeds(cls, view: View, joint: str | None, pull: Array | None = None) -> Iterable[Effect]:
        """Yield a quick and a slow change of flanks where the joint went both ways over its angle."""
        i = view.robot.index(str(joint))
        unit = view.radian(i)
        angle = view.joint(i)
        for travel in _TRAVELS:
            made = cls(str(joint), 0.0, travel * unit)
            way = made._way(angle)[0]
            alike = np.stack([np.ones_like(angle), angle, way], axis=1)
            one = 0.5 * way * angle
            remaining = one - alike @ np.linalg.lstsq(alike, one, rcond=None)[0]
            if float(np.sqrt((remaining**2).mean())) > _SHOWN * unit:
                yield made

    def remedy(self, robot: Robot) -> str:
        difference = self._plain('difference')
        more, less = ('up', 'down') if difference > 0.0 else ('down', 'up')
        return (
            f'Compensate the gear of {self.site} by direction, or approach seams from one side: on '
            f'the way {more} it turns {size(difference * 100.0)} % of its angle further than on the '
            f'way {less}.'
        )


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
