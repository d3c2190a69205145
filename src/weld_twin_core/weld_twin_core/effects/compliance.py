# Copyright 2026 weld_twin contributors
# SPDX-License-Identifier: Apache-2.0
"""
What gives way under load: joints, the pedestal, bearings, the tool and its bracket.

A joint is a linear spring in the drive, q = theta + compliance * tau(q). It settles where it balances
the load of the posture that it has sagged to, as elastic joints do at rest (Siciliano & Khatib 2016,
chapter 11). Diagnoses written before this was so took the torque of the rigid arm, theta + compliance
* tau(theta); ``statics: first_order`` replays them. Where the controller measures the effort of its
joints, tau is given: ``statics: effort`` takes the load that the effort holds, tau = -effort, and
``statics: effort_reversed`` that of a controller that tells the load itself, tau = effort. No mass of
a link counts then, nor does any load that nobody declared: both are in what was measured.

Two springs hold the pedestal, about the base's x and its y: lean = compliance * moment, the moment
that of the weights of links and payload and of the tool wrench about the base's origin. It follows the
posture, where an error of the base pose stays as it is. A spring of the second joint bends the arm by
nearly the same moment, but at the shoulder, and about its own axis only; the pedestal leans below it
and both ways. Makers ask for a stiff foundation because of it: manual of an ABB IRB 4400,
3HAC022032-001, p. 39 (easymanua.ls).

The spring of a gear turns a joint about its axis, by the moment about it. The bearing carries the rest
of the moment, and is a spring, too, alike in all directions across the axis: makers of strain-wave
gears state its moment stiffness beside that of the gear. Of the first joint it is the pedestal that
leans.

The tool yields to the force on it, dx = K^-1 F (paper, eq. II.v). Under its own weight it gives way by
another way in every orientation. A torch stands on a bracket at the flange, and both are springs: the
tip goes by a linear map of the weight as the flange sees it. Nine numbers hold any such map: the
weight acts at the centre of the torch and moves its tip, so the map need not be symmetric. The tool
turns about the flange as far as takes its tip there; numbers of its own for the turn would follow much
that is no sag. Masses of the arm play no part.
"""

from __future__ import annotations

from collections.abc import Iterable, Sequence
from typing import Any

import numpy as np

from ..arm.dynamics import carried_moment, wrench_rotation
from ..arm.robot import STANDARD_GRAVITY
from ..arm.vectors import components, dot, pad
from ..errors import DataError, ModelError
from .effect import Effect, Hooked, LinearEffect, SearchHooks, Traits, TwinHooks, register
from .view import Array, Channel, Parameter, Plausible, Robot, Shift, Stage, Value, View
from .wording import metres, number, numbers, radians, size, turn

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


@register
class JointCompliance(LinearEffect):
    """The joint yields to the load torque of links, payload and tool wrench; above zero it sags."""

    joint: str
    compliance: Value = 0.0
    statics: str = 'equilibrium'

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


_CHANGED = 1e-6
"""Share of the largest moment by which it must change, above rounding: without any, a lean is a base
pose. Whether the data show a small change, the fits of both say."""


@register
class PedestalTilt(LinearEffect):
    """The base leans about its x and its y by ``compliance`` times the moment about each."""

    compliance: Value = (0.0, 0.0)

    traits = Traits(
        title='leaning pedestal',
        meaning="the pedestal under the robot bends under the arm's weight",
        formula='the base leans about its x and y by compliance · moment about each, the moment'
        ' of links, declared payload and wrench about where the arm stands',
        apart={'joint_compliance': 'put a level or a dial gauge on the base while the arm moves'},
        entered='program',
        depends_on='load',
        place='base',
        common=False,
    )
    of = 'robot'
    stage = Stage.LINK
    parameters = (
        Parameter('compliance', 'rad/(N m)', size=2, typical=2e-6).plausible(
            (1e-5, -1e-5, 1e-4),
            'a foundation shall swing above 30 Hz with the arm on it (ABB IRB 4400, 3HAC022032-001, '
            'p. 39, easymanua.ls): 1e-5 under a small arm of 3 kg m^2 about its foot; range '
            'derived: at 10 Hz it swings to the eye; see joint_compliance for the lower end',
        ),
    )
    needs = frozenset({'load'})

    def per_unit(self, view: View) -> list[Shift]:
        """Return the moment about each axis, as a turn of the base in the world; it sags."""
        axes = view.robot.T_base_foot[:3, :2].T
        return [
            {channel: share * moment for channel, share in lean.items()}
            for lean, moment in zip(base_leans(view.robot, axes), base_moments(view), strict=True)
        ]

    @classmethod
    def applicable(cls, view: View, joint: str | None) -> str | None:
        """Return why the data cannot show it: the moment has to change."""
        reason = super().applicable(view, joint)
        if reason is not None:
            return reason
        moment = np.stack(base_moments(view))
        change = np.linalg.norm(np.ptp(moment, axis=-1))
        if change <= _CHANGED * np.linalg.norm(moment, axis=0).max(initial=0.0):
            return 'the moment on the pedestal does not change'
        return None

    def remedy(self, robot: Robot) -> str:
        x, y = np.asarray(self.compliance) * 1e2
        return (
            'Stiffen the pedestal or its anchors: under 100 N m it leans by '
            f'{number(float(np.degrees(x)))} deg about x of the base and by '
            f'{number(float(np.degrees(y)))} deg about y; until then compensate the motion.'
        )


def base_moments(view: View) -> tuple[Array, Array]:
    """Return the moments about the foot's x and y that the arm and its load make, (..., N) [N m]."""
    robot, chain = view.robot, view.frames
    standing = chain.root_point + chain.root_rotation @ _standing(robot)
    foot = pad(components(standing), chain.position.ndim - 1)
    moment = carried_moment(robot, chain, robot.behind, foot, view.wrench, view.wrench_frame)
    axes = wrench_rotation(robot, chain, 'base')
    x, y = (dot(pad(components(axes[..., k]), moment.ndim - 1), moment) for k in range(2))
    return x, y


def _standing(robot: Robot) -> Array:
    """Return where the arm stands in the frame where its rows begin, (3,) [m]: it leans about that."""
    return np.zeros(3) if robot.behind else np.asarray(robot.T_base_foot[:3, 3])


def base_leans(robot: Robot, axes: Array) -> list[dict[Channel, float]]:
    """
    Return the channels that turn an arm's base about axes (K, 3) of its frame through its foot.

    Beside a positioner a lean of the arm is that of the positioner the other way round: the frames
    between the two are all that the chain has.
    """
    if not robot.behind:
        rotation = robot.T_world_base[:3, :3]
        turned, standing = axes @ rotation.T, rotation @ _standing(robot)
        return [
            {('base', k): float(v) for k, v in enumerate([*np.cross(standing, axis), *axis]) if v}
            for axis in turned
        ]
    foot = np.linalg.inv(robot.T_root_base)[:3, 3]
    return [
        {('root', k): float(value) for k, value in enumerate([*-np.cross(axis, foot), *-axis])}
        for axis in axes
    ]


class _AcrossSearch(SearchHooks):
    def fits(self, robot: Robot, joint: str | None) -> bool:
        at = -1 if joint is None else robot.index(joint)
        return at > robot.behind and not bool(robot.prismatic[at])


@register
class AxisCompliance(LinearEffect):
    """The axis of a joint turns by ``compliance`` times the moment across it."""

    joint: str
    compliance: Value = 0.0

    traits = Traits(
        title='compliance across the axis',
        meaning='the bearing of a joint gives way when the load tips its axis',
        formula='the frame in which the joint turns leans about its x and y by compliance · moment '
        'about each, the moment of links, payload and wrench about its origin',
        apart={
            'joint_compliance': 'put a dial gauge on either side of the joint while the arm moves'
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
    search = Hooked(_AcrossSearch)

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


@register
class CartesianCompliance(LinearEffect):
    """One compliance along each axis of the tool frame, whatever frame the wrench comes in."""

    compliance: Value = (0.0, 0.0, 0.0)

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


_TURNED = 1e-2
"""Change of gravity's direction in the flange [-] up to which a sag is one with the tool's pose: some
tenths of a millimetre change by less than a tracker sees."""
_SHORT = 1e-2
"""Length of a tool [m] up to which its tip goes without a turn: a probe at the flange has no bracket."""


@register
class ToolSag(Effect):
    """
    The tip goes along the flange's axes by ``sag``, row by row, times how far down each points.

    With it the tool turns, as if about the flange; ``turning`` says by how much more for each metre
    about the flange's axes, as a bracket gives way where it is weakest.
    """

    sag: Value = (0.0,) * 9
    turning: Value = (0.0,) * 3

    traits = Traits(
        title='sagging tool',
        meaning='the tool or its bracket bends under its own weight',
        formula='tool centre point → tool centre point + S down, S the nine numbers of `sag`, row by '
        'row, down the direction of gravity in the flange; the tool turns about the axes of the flange '
        'by the cross product of r / r² + turning and S down, r from the flange to the tool point',
        apart={
            'joint_compliance': 'put a dial gauge between flange and tool tip while the wrist turns'
        },
        entered='program',
        depends_on='load',
        place='tool',
    )
    of = 'robot'
    stage = Stage.LINK
    parameters = (
        Parameter('sag', 'm', size=9, typical=1e-4).plausible(
            (1e-4, 3e-3), 'derived: a bracket that a torch of 3 kg bends by 3 mm is broken'
        ),
        Parameter('turning', '1/m', size=3, typical=3.0, linear=False).plausible(
            (5.0, 50.0), 'derived: no bracket gives way closer to the tip than two centimetres'
        ),
    )

    def displace(self, view: View) -> Shift:
        """Return the way of the tip along each axis of the flange, and the turn with it."""
        ways = self._ways(view)
        along: dict[Channel, Array] = {('tool', way): own for way, own in enumerate(ways)}
        return {**along, **_turn_of(view, ways, self._turning(view))}

    def gradient(self, view: View) -> list[Shift | None]:
        down, about = _down(view), self._turning(view)
        still = np.zeros(down.shape[:-1])
        out: list[Shift | None] = []
        for way in range(3):
            for k in range(3):
                ways = [down[..., k] if axis == way else still for axis in range(3)]
                own: dict[Channel, Array] = {('tool', way): ways[way]}
                out.append({**own, **_turn_of(view, ways, about)})
        ways = self._ways(view)
        return [*out, *(_turn_of(view, ways, axis) for axis in np.eye(3).tolist())]

    def atoms(self, view: View) -> list[Shift]:
        return [shift for shift in self.gradient(view)[:9] if shift is not None]

    def _ways(self, view: View) -> list[Array]:
        down = _down(view)
        each = [[self.number('sag', 3 * way + k) for k in range(3)] for way in range(3)]
        return [x * down[..., 0] + y * down[..., 1] + z * down[..., 2] for x, y, z in each]

    def _turning(self, view: View) -> list[Any]:
        lever = view.robot.T_flange_tool[:3, 3]
        square = float(lever @ lever)
        own = lever / square if square > _SHORT**2 else np.zeros(3)
        return [own[k] + self.number('turning', k) for k in range(3)]

    @classmethod
    def applicable(cls, view: View, joint: str | None) -> str | None:
        """Return why the data cannot show it: the tool has to turn against gravity."""
        reason = super().applicable(view, joint)
        if reason is not None:
            return reason
        if float(np.ptp(_down(view).reshape(-1, 3), axis=0).max()) <= _TURNED:
            return 'the tool does not turn against gravity'
        return None

    def remedy(self, robot: Robot) -> str:
        most = float(
            np.linalg.norm(np.asarray(self.sag).reshape(-1, 3, 3), 2, axis=(-2, -1)).max()
        )
        return (
            'Stiffen the bracket of the tool, and see what its cable hangs on: the tip sags by up to '
            f'{number(most * 1e3)} mm as the wrist turns it.'
        )


def _turn_of(view: View, ways: Sequence[Array], about: Sequence[Any]) -> Shift:
    """Return the turn about the tool's axes that goes with ways of its tip along the flange's."""
    (x, y, z), (a, b, c) = ways, about
    turn = (b * z - c * y, c * x - a * z, a * y - b * x)
    axes = view.robot.T_flange_tool[:3, :3]
    return {
        ('tool', 3 + k): axes[0, k] * turn[0] + axes[1, k] * turn[1] + axes[2, k] * turn[2]
        for k in range(3)
    }


def _down(view: View) -> Array:
    """Return the direction of gravity in the axes of the flange, (..., N, 3) [-]; zero without any."""
    frames, gravity = view.frames, view.robot.gravity
    down = frames.root_rotation @ (gravity / max(float(np.linalg.norm(gravity)), 1e-12))
    return np.asarray((np.swapaxes(frames.flange_rotation, -1, -2) @ down[..., None])[..., 0])
