# Copyright 2026 weld_twin contributors
# SPDX-License-Identifier: Apache-2.0
"""
Effects that are nothing before an instant and constant from then on.

A belt or a coupling jumps; the tool slips in its holder, or the reflector in its nest; the
instrument or the base of the robot is knocked.
"""

from __future__ import annotations

from dataclasses import dataclass, replace
from typing import TypeVar

import numpy as np

from ..arm.channels import Shift
from ..arm.robot import Robot
from ..arrays import Array
from .constant import ChannelError, FrameError, frame_parameters
from .effect import Effect
from .geometry import JointOffset
from .hooks import Hooked, Traits, TwinHooks
from .registry import register
from .view import Parameter, Plausible, Stage, Value, View
from .wording import base_frame, frame, radians

S = TypeVar('S', bound='Sudden')


class Sudden(Effect):
    """
    What sets in at ``time`` [s], counted from the recording's epoch.

    A search takes it in only where the checks of the data found the instant: a step fits any
    slow change halfway.
    """

    traits = Traits(depends_on='time', dated=True, common=False)
    options = ('time',)
    needs = frozenset({'time'})

    @property
    def instant(self) -> float:
        """Return when it sets in [s]."""
        return float(self.time)  # type: ignore[attr-defined]

    def recounted(self: S, later: float) -> S:
        """Return the same with its instant counted from an epoch that is later by so much [s]."""
        return replace(self, time=self.instant - later)  # type: ignore[call-arg]

    def after(self, view: View) -> Array:
        """Return one from the instant on and zero before, shape as the view's stamps."""
        return (view.t >= self.instant).astype(np.float64)

    def displace(self, view: View) -> Shift:
        """Return the constant displacement from the instant on."""
        after = self.after(view)
        whole = super().displace(view)  # type: ignore[safe-super]
        return {channel: value * after for channel, value in whole.items()}

    def gradient(self, view: View) -> list[Shift | None]:
        """Return the constant derivatives from the instant on."""
        after = self.after(view)
        return [
            None if shift is None else {channel: value * after for channel, value in shift.items()}
            for shift in super().gradient(view)
        ]


class _Twin(TwinHooks):
    """What the twin asks of it."""

    effect: JointSlip

    def lasting(self) -> JointOffset:
        """Return the offset that the joint keeps."""
        return JointOffset(self.effect.joint, self.effect.offset)


@register
@dataclass(frozen=True, eq=False)
class JointSlip(Sudden, ChannelError):
    """The joint stands ``offset`` further than its reading from ``time`` [s] on."""

    joint: str
    offset: Value = 0.0
    time: float = 0.0

    name = 'joint_slip'
    traits = replace(
        Sudden.traits,
        title='slip',
        meaning='a joint slipped at one instant, as by a tooth of a belt',
        entered='zero',
    )
    of = 'joint'
    stage = Stage.JOINT
    channel = 'q'
    parameters = (
        Parameter(
            'offset',
            'rad',
            typical=5e-4,
            range=Plausible.even(
                5e-3,
                0.13,
                'derived: a tooth of a belt or the mark of a mastering; see joint_offset',
            ),
            sliding=Plausible.even(5e-3, 0.1, 'derived: a tooth of a belt or a rack'),
        ),
    )
    twin = Hooked(_Twin)

    def remedy(self, robot: Robot) -> str:
        """Return what to mend, in words; see `Effect.remedy`."""
        at = robot.index(str(self.site))
        size = self._plain('offset')
        far = f'{size * 1e3:+.3g} mm' if robot.prismatic[at] else radians(size)
        return (
            f'See to the belt, coupling and encoder of {self.site}: it slipped by {far} at '
            f't = {self._plain("time"):.4g}; then master it again.'
        )


class SuddenFrame(Sudden, FrameError):
    """A frame that stands elsewhere from an instant on."""

    traits = replace(Sudden.traits, of_setup=True)


@register
@dataclass(frozen=True, eq=False)
class ToolSlip(SuddenFrame):
    """The tool is displaced by xyz of the flange and turned by rotvec from ``time`` [s] on."""

    xyz: Value = (0.0, 0.0, 0.0)
    rotvec: Value = (0.0, 0.0, 0.0)
    time: float = 0.0

    name = 'tool_slip'
    traits = replace(
        SuddenFrame.traits,
        title='slipped tool or reflector',
        meaning='tool or reflector moved on the flange at one instant',
        entered='tool',
        place='tool',
    )
    channel = 'tool'
    parameters = frame_parameters(
        Plausible.even(5e-3, 0.05, 'derived: a holder or a nest that gave way'),
        Plausible.even(2e-2, 0.4, 'derived: a holder that gave way'),
    )

    def remedy(self, robot: Robot) -> str:
        """Return what to mend, in words; see `Effect.remedy`."""
        return (
            f'Fasten the tool or the reflector: it moved by '
            f'{frame(self.vector()[:6], "of the flange", "of the tool")} at '
            f't = {self._plain("time"):.4g}; measure its centre point again.'
        )


@register
@dataclass(frozen=True, eq=False)
class InstrumentKnock(SuddenFrame):
    """The base is displaced by xyz in the world and turned by rotvec from ``time`` [s] on."""

    xyz: Value = (0.0, 0.0, 0.0)
    rotvec: Value = (0.0, 0.0, 0.0)
    time: float = 0.0

    name = 'instrument_knock'
    traits = replace(
        SuddenFrame.traits,
        title='knocked instrument or base',
        meaning='instrument or base was moved at one instant',
        entered='the instrument or the base was knocked',
        place='instrument',
    )
    channel = 'base'
    parameters = frame_parameters(
        Plausible.even(5e-3, 0.1, 'derived: a knock'),
        Plausible.even(5e-3, 0.1, 'derived: a knock'),
    )

    def remedy(self, robot: Robot) -> str:
        """Return what to mend, in words; see `Effect.remedy`."""
        return (
            f'Fasten the instrument and the base: one moved by {base_frame(self.vector()[:6])} at '
            f't = {self._plain("time"):.4g}; measure what came before and after apart.'
        )
