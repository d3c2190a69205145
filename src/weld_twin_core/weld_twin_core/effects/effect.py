# SPDX-FileCopyrightText: weld_twin contributors
# SPDX-License-Identifier: Apache-2.0
"""
The contract of an effect: parameters that displace channels of the kinematic chain.

A new effect is one file: a frozen dataclass with `displace`, and `gradient` where a closed form
is at hand; `register` makes it known to the injector, the twin, the sensitivity study and the
diagnosis alike.
"""

from __future__ import annotations

from abc import ABC, abstractmethod
from collections.abc import Iterable
from dataclasses import dataclass
from typing import Any, ClassVar

import numpy as np

from ..arm.channels import Shift
from ..arm.robot import Robot
from ..arrays import Array
from ..errors import ModelError
from .parametric import Parametric
from .view import Parameter, Stage, Value, View

__all__ = ['Effect', 'MemoryEffect', 'Parameter', 'Stage', 'Value', 'View']

RELATIVE_STEP = 1e-5
"""Step of numerical derivatives, in typical magnitudes of the parameter."""


@dataclass(frozen=True, eq=False)
class Effect(Parametric, ABC):
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

    of: ClassVar[str]
    """What it sits on: 'joint', 'link', 'links' or 'robot'."""
    stage: ClassVar[Stage]
    needs: ClassVar[frozenset[str]] = frozenset()
    """Inputs beyond joint position: velocity, order, time, wrench, load, temperature."""
    cause: ClassVar[bool] = True
    """Whether a diagnosis may name it; noise and the set-up's own motion are nuisance."""

    depends_on: ClassVar[str] = 'constant'
    """What it depends on: 'constant', 'angle', 'direction', 'speed', 'acceleration', 'load',
    'temperature', 'time' or 'place' (in the workspace)."""
    place: ClassVar[str] = 'joint'
    """Where it sits: at its 'joint', or at 'base', 'tool', 'instrument', 'clock' or 'load'."""

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

    def slope(self, view: View) -> Shift:
        """Return d displacement / d own joint position, per ('q', i) channel; empty when none."""
        return {}

    @classmethod
    def seeds(cls, view: View, joint: str | None, pull: Array | None = None) -> Iterable[Effect]:
        """
        Yield the instances a search starts from; each spans one linear subspace.

        ``pull``, shape (N,), is how strongly the residual would move the joint at every sample;
        an effect too fine to search on a grid may look for itself in it.
        """
        yield cls._at(joint)

    def starts(self, view: View, zoom: int) -> tuple[list[Effect], Array] | None:
        """
        Return instances to choose a fit's start from, and what each displaces, shape (D, N).

        For an effect on one joint whose response bends so much with a parameter that a local fit
        would stop beside the best. ``zoom`` counts up from 0, each time about the best so far,
        until there are none. Where a parameter is linear, the instances have it at one.
        """
        return None

    @classmethod
    def trials(cls, view: View, joint: str | None) -> float:
        """Return how many instances `seeds` chose among; 0 means as many as it yields."""
        return 0.0

    def atoms(self, view: View) -> list[Shift]:
        """Return the linear features of this instance; their combinations start a fit."""
        return [shift for shift in self.gradient(view) if shift is not None]

    def from_atoms(self, coefficients: Array) -> Effect:
        """Return the instance that a combination of `atoms` stands for."""
        return self.with_vector(np.asarray(coefficients, dtype=np.float64))

    def coordinate_shifts(self, view: View) -> list[Shift]:
        """Return d displacement / d fit coordinates."""
        return [shift for shift in self.gradient(view) if shift is not None]

    @classmethod
    def applicable(cls, view: View, joint: str | None) -> str | None:
        """Return why the data cannot show this effect at all, or None when they can."""
        if 'velocity' in cls.needs and view.static:
            return 'static stations carry no velocity'
        if 'wrench' in cls.needs and view.wrench is None:
            return 'no tool wrench was recorded'
        if 'load' in cls.needs and view.wrench is None and view.robot.mass is None:
            return 'the robot model has no link masses and no wrench was recorded'
        if 'temperature' in cls.needs and view.temperature is None:
            return 'no temperature was recorded'
        return None

    @property
    def site(self) -> str | None:
        """Return the joint the effect sits on, or None for the robot as a whole."""
        return getattr(self, 'joint', None)

    @property
    def at(self) -> str:
        """Return where it sits: the name of its joint, or its `place`."""
        return str(self.site) if self.place == 'joint' else self.place

    @property
    def on(self) -> str:
        """Return what it depends on."""
        return self.depends_on

    @property
    def key(self) -> tuple[str, ...]:
        """Return what tells this effect from others of the file: name, joint and options."""
        extra = tuple(str(getattr(self, k)) for k in self.options if k != 'joint')
        return (self.name, self.site or '', *extra)

    @classmethod
    def _at(cls, joint: str | None, **values: Any) -> Effect:
        if cls.of in ('joint', 'link'):
            values['joint'] = joint
        return cls(**values)

    def check(self, robot: Robot) -> None:
        """
        Refuse an effect this robot cannot have.

        Raises
        ------
        ModelError
            Unknown joint, wrong length, not a number, or outside the bounds.

        """
        if self.of in ('joint', 'link'):
            if self.site is None:
                raise ModelError(f'{self.name} needs a joint')
            robot.index(self.site)
        self.check_values()


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
