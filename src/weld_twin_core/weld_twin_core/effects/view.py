# Copyright 2026 weld_twin contributors
# SPDX-License-Identifier: Apache-2.0
"""What an effect is made of and what it may look at: stages, parameters, the samples."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass, field, replace
from enum import IntEnum
from functools import cached_property
from typing import Any

import numpy as np

from ..arm.chain import Frames, frames
from ..arm.channels import Channel, Shift
from ..arm.robot import Robot
from ..arrays import Array

__all__ = ['Array', 'Channel', 'Parameter', 'Plausible', 'Robot', 'Shift', 'Stage', 'Value']
__all__ += ['View', 'single']

Value = Any
"""A parameter: a number, a list of numbers, or the same with a leading axis of draws."""


_SLIDING = 0.1
"""Metres of a joint that slides which are looked at as a radian of one that turns."""


class Stage(IntEnum):
    """
    When an effect acts. Stages run in this order; effects of one stage see the same input.

    SERVO and PLAY have memory and run one after the other on the joint stream's own stamps.
    CLOCK picks the instant a measurement belongs to. The others are functions of that instant.

    Examples
    --------
    >>> import weld_twin_core as wt
    >>> wt.Stage.PLAY < wt.Stage.JOINT
    True

    """

    SERVO = 0
    PLAY = 1
    CLOCK = 2
    JOINT = 3
    LOAD = 4
    ELASTIC = 5
    LINK = 6
    POSE = 7
    NOISE = 8


@dataclass(frozen=True)
class Plausible:
    """
    Spread and range of one parameter, in its own unit.

    Examples
    --------
    >>> import weld_twin_core as wt
    >>> wt.effects.Plausible.even(2e-3, 2e-2, 'derived: ten times its spread').low
    -0.02

    """

    sd: float
    """Standard deviation among machines, and of what people do to them."""
    low: float
    high: float
    """What lies outside is no property of a machine."""
    source: str
    """A publication that was read, or an argument that starts with 'derived'."""
    by_robot: Callable[[Robot], tuple[float, float]] | None = None
    """Returns low and high on a robot, where they hang on it."""
    times: Callable[[Robot], float] | None = None
    """Returns how many times as wide spread and range are on a robot, where that hangs on it."""

    @property
    def derived(self) -> bool:
        """Return whether no publication stands behind it."""
        return self.source.startswith('derived')

    @classmethod
    def even(cls, sd: float, most: float, source: str) -> Plausible:
        """Return a range that reaches as far to either side."""
        return cls(sd, -most, most, source)

    @classmethod
    def of(cls, numbers: tuple[float, ...], source: str) -> Plausible:
        """Return spread, least and most as a range; of two, spread and the most to either side."""
        sd, *_, high = numbers
        low = -high if len(numbers) == 2 else numbers[1]
        return cls(sd, low, high, source)


@dataclass(frozen=True)
class Parameter:
    """
    One parameter of an effect.

    Examples
    --------
    >>> import weld_twin_core as wt
    >>> wt.effects.Backlash.parameters[0].unit
    'rad'
    >>> wt.Parameter('bend', 'rad/m^2', typical=1e-3).size
    1

    """

    name: str
    unit: str
    """The unit in SI, as people read it."""
    size: int = 1
    """Number of components; 0 means a number or a list of any length."""
    typical: float = 1.0
    """A magnitude worth worrying about; scales fits and default tolerances."""
    lower: float = -np.inf
    upper: float = np.inf
    """Physical bounds."""
    differentiable: bool = True
    """Whether `Effect.gradient` gives its derivative."""
    linear: bool = True
    """Whether the displacement is proportional to it."""
    idealised: float = 0.0
    """Share by which an arm's own value differs from the one that fits best, because springs
    harden and modes couple where the formula is ideal."""
    range: Plausible | None = None
    """What a machine can have of it; left out, nothing is known."""
    sliding: Plausible | None = None
    """The same where its joint slides, in m instead of rad."""

    def plausible(self, numbers: tuple[float, ...], source: str) -> Parameter:
        """
        Return the same with its `range`.

        Parameters
        ----------
        numbers : tuple of 3 or 2 float
            Spread, least and most; or spread, and the most to either side.
        source : str
            A publication that was read, or an argument that starts with 'derived'.

        """
        return replace(self, range=Plausible.of(numbers, source))

    def plausible_sliding(self, numbers: tuple[float, ...], source: str) -> Parameter:
        """Return the same with what holds in m instead of rad, where its joint slides."""
        return replace(self, sliding=Plausible.of(numbers, source))


@dataclass(frozen=True, eq=False)
class View:
    """
    What an effect may look at: the samples that reach its stage.

    Examples
    --------
    >>> import numpy as np
    >>> import weld_twin_core as wt
    >>> t, q = np.zeros(1), np.zeros((1, 6))
    >>> view = wt.View(wt.load('ur5'), t, t, q, q)
    >>> wt.effects.JointOffset('elbow_joint', offset=1e-3).displace(view)
    {('q', 2): array([0.001])}

    """

    robot: Robot
    t: Array
    """Shape (N,), or (D, N) where the delay is drawn [s]."""
    elapsed: Array
    """Time since the recording's first stamp, shape as t [s]."""
    q: Array
    qd: Array
    """Shape (..., N, n) [rad, rad/s]."""
    static: bool = False
    """Samples are stations at rest; their order is known, their timing means nothing."""
    wrench: Array | None = None
    """Shape t.shape + (6,) [N, N m]."""
    wrench_frame: str = 'tool'
    temperature: Array | None = None
    """Shape as t [degC]."""
    effort: Array | None = None
    """As the controller measured it, shape t.shape + (n,) [N m, or N of a slide]; what springs
    take in the place of the statics."""
    effort_holds: bool = True
    """The effort holds the load; else it is the load itself."""
    shift: Shift = field(default_factory=dict)
    """Channels displaced by the stages before."""
    later: float = 0.0
    """How much later the stamps are on the clock by which effects are dated [s]."""

    @property
    def dates(self) -> Array:
        """Return when the samples were taken, on the clock by which effects are dated [s]."""
        return self.t + self.later

    @cached_property
    def frames(self) -> Frames:
        """Return the chain at these samples, with the displacements so far."""
        return frames(self.robot, self.q, self.shift)

    def joint(self, index: int) -> Array:
        """Return the position of one joint, shape (..., N)."""
        return self.q[..., index]

    def radian(self, index: int) -> float:
        """Return what is looked at as a radian of one joint: one, or some metres where it slides."""
        return _SLIDING if self.robot.prismatic[index] else 1.0

    def displaced(self, *more: Shift, keep_frames: bool = False) -> View:
        """Return the view with more displacement, and its frames where that moves none of them."""
        total = dict(self.shift)
        for shift in more:
            for key, value in shift.items():
                total[key] = total[key] + value if key in total else value
        out = replace(self, shift=total)
        if keep_frames and 'frames' in self.__dict__:
            out.__dict__['frames'] = self.frames
        return out


def single(channel: Channel, value: Array | float, view: View) -> Shift:
    """Return a shift of one channel, such as ``('q', 2)``, the same at every sample [rad or m]."""
    if np.ndim(value) == 0:
        return {channel: np.full(view.t.shape, value)}
    wanted = np.broadcast_shapes(np.shape(value), view.t.shape)
    return {channel: np.broadcast_to(value, wanted)}
