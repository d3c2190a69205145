# Copyright 2026 weld_twin contributors
# SPDX-License-Identifier: Apache-2.0
"""
The contract of an effect: parameters that displace channels of the kinematic chain.

A new effect is one file: a frozen dataclass with `displace`, and `gradient` where a closed form
is at hand; `register` makes it known to the injector, the twin, the sensitivity study and the
diagnosis alike. What else it may tell of itself are the optional hooks of `hooks`.
"""

from __future__ import annotations

from abc import ABC, abstractmethod
from dataclasses import dataclass
from typing import Any

import numpy as np

from ..arm.channels import Shift
from ..arm.robot import Robot
from ..arrays import Array
from ..errors import ModelError
from .hooks import Hooks
from .view import Parameter, Stage, Value, View
from .wording import travel

__all__ = ['Effect', 'MemoryEffect', 'Parameter', 'Stage', 'Value', 'View']

RELATIVE_STEP = 1e-5
"""Step of numerical derivatives, in typical magnitudes of the parameter."""

JOINT_STEP = 1e-5
"""Step of numerical derivatives by a joint's position [rad or m]: rounding and bend weigh alike."""

SLIDING_UNITS = {'rad': 'm', 'rad/(N m)': 'm/N'}
"""Units of a joint that turns, and those in their place where it slides."""


@dataclass(frozen=True, eq=False)
class Effect(Hooks, ABC):
    """
    A named physical cause; see `weld_twin_core.effects` for the vocabulary.

    Parameters may carry a leading axis of draws, shape (D,) or (D, size); displacements then
    have shape (D, N).

    Examples
    --------
    A column that leans with the square of the reach:

    >>> from dataclasses import dataclass
    >>> import numpy as np
    >>> import weld_twin_core as wt
    >>> @dataclass(frozen=True, eq=False)
    ... class ColumnBend(wt.Effect):
    ...     bend: object = 0.0
    ...     name, of, stage = 'column_bend', 'robot', wt.Stage.LINK
    ...     parameters = (wt.Parameter('bend', 'rad/m^2', typical=1e-3),)
    ...
    ...     def displace(self, view):
    ...         reach = view.frames.position[..., :2]
    ...         return {('base', 4): self.number('bend') * (reach**2).sum(axis=-1)}
    >>> still = wt.Recording('still', wt.JointMotion([0.0], np.zeros((1, 6))))
    >>> nominal, bent = (
    ...     wt.Twin(wt.load('ur5'), effects).poses(still) for effects in ([], [ColumnBend(1e-3)])
    ... )
    >>> print(((bent.position - nominal.position)[0] * 1e3).round(3), 'mm')
    [-0.004  0.     0.576] mm

    """

    @abstractmethod
    def displace(self, view: View) -> Shift:
        """Return the displaced channels, each shape (..., N)."""

    def gradient(self, view: View) -> list[Shift | None]:
        """
        Return d displacement / d component for every component; None where there is none.

        Unless an effect gives the closed form, by differences of `displace`: central, or to the
        inside at a bound.
        """
        vector, out = self.vector(), list[Shift | None]()
        for k, (parameter, _) in enumerate(self.components()):
            if not parameter.differentiable:
                out.append(None)
                continue
            ends = np.stack([vector, vector])
            step = RELATIVE_STEP * parameter.typical
            ends[:, k] = np.clip(
                [vector[k] - step, vector[k] + step], parameter.lower, parameter.upper
            )
            low, high = (self.with_vector(end).displace(view) for end in ends)
            width = ends[1, k] - ends[0, k]
            out.append({key: (high[key] - low[key]) / width for key in high})
        return out

    def load_slope(self, view: View) -> Array:
        """
        Return how the load torques that this adds change with the joints, shape (n, n, ..., N).

        Torque first, then joint. Unless an effect gives the closed form, by central differences.
        """
        n = view.robot.n
        slope = np.zeros((n, n, *view.frames.position.shape[:-1]))
        for j in range(n):
            high, low = (
                self.displace(view.displaced({('q', j): np.full(view.t.shape, step)}))
                for step in (JOINT_STEP, -JOINT_STEP)
            )
            for channel, value in high.items():
                slope[channel[1], j] = (value - low[channel]) / (2.0 * JOINT_STEP)
        return slope

    def on_slide(self, robot: Robot) -> bool:
        """Return whether it displaces a joint that slides: m where its parameters say rad."""
        at = self.site if self.of == 'joint' else None
        return at in robot.joint_names and bool(robot.prismatic[robot.index(str(at))])

    def travelled(self, robot: Robot, value: float) -> str:
        """Return how far its joint moves, in mm where that slides, in degrees where it turns."""
        return travel(value, sliding=self.on_slide(robot))

    def remedy(self, robot: Robot) -> str:
        """Return the parameters to put into the model, as they are; see `Hooks.remedy`."""
        sizes = ', '.join(
            f'{p.name} {np.array2string(np.asarray(getattr(self, p.name)), precision=4)} '
            f'{self.unit(p, robot)}'
            for p in self.parameters
        )
        where = f' of {self.site}' if self.site else ''
        return f'Put {self.name}{where} into the model: {sizes}.'

    def unit(self, parameter: Parameter, robot: Robot | None = None) -> str:
        """
        Return the SI unit of one of its parameters on a robot.

        Parameters
        ----------
        parameter : Parameter
        robot : Robot, optional
            Left out, its joint turns.

        """
        slides = robot is not None and self.on_slide(robot)
        return SLIDING_UNITS.get(parameter.unit, parameter.unit) if slides else parameter.unit

    def check(self, robot: Robot) -> None:
        """
        Refuse an effect this robot cannot have.

        Raises
        ------
        ModelError
            Unknown joint, wrong length, not a number, outside the bounds, or the robot has no such
            part.

        """
        if self.of in ('joint', 'link'):
            if self.site is None:
                raise ModelError(f'{self.name} needs a joint')
            robot.index(self.site)
        self.check_values()
        if self.lacking and not self.fits(robot, self.site):
            raise ModelError(
                f'{self.name} {self.lacking.format(site=self.site, robot=robot.name)}'
            )


class MemoryEffect(Effect):
    """
    An effect whose displacement depends on the motion before.

    `run` is the whole definition: the batch form runs it over all samples, the live form over
    one sample at a time with the state it returned. `displace` is `run` from rest.

    Examples
    --------
    >>> import weld_twin_core as wt
    >>> issubclass(wt.effects.Backlash, wt.MemoryEffect)
    True
    >>> issubclass(wt.effects.JointOffset, wt.MemoryEffect)
    False

    """

    @abstractmethod
    def run(self, view: View, state: Any = None) -> tuple[Shift, Any]:
        """Return the displaced channels and the state after the last sample."""

    def displace(self, view: View) -> Shift:
        """Return the displaced channels when the motion before the first sample is unknown."""
        return self.run(view)[0]

    def push(self, view: View, tangent: Array) -> Array:
        """Return how a small change of the input joint position, shape (..., N), comes out."""
        return tangent
