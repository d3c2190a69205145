# SPDX-FileCopyrightText: weld_twin contributors
# SPDX-License-Identifier: Apache-2.0
"""
The contract of an effect: parameters that displace channels of the kinematic chain.

A new effect is one file: a frozen dataclass with `displace`, and `gradient` where a parameter is
differentiable; `@register` makes it known to the injector, the twin, the sensitivity study and
the diagnosis alike.
"""

from __future__ import annotations

from abc import ABC, abstractmethod
from collections.abc import Iterable, Mapping, Sequence
from dataclasses import dataclass, fields, replace
from enum import IntEnum
from functools import cached_property
from typing import Any, ClassVar, TypeVar

import numpy as np

from ..arrays import Array
from ..chain import Channel, Frames, Shift, frames
from ..errors import DataError, ModelError
from ..robot import Robot

Value = Any
"""A parameter: a number, a list of numbers, or the same with a leading axis of draws."""


class Stage(IntEnum):
    """
    When an effect acts. Stages run in this order; effects of one stage see the same input.

    SERVO and PLAY have memory and run one after the other on the joint stream's own stamps.
    CLOCK picks the instant a measurement belongs to. The others are functions of that instant.
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
class Parameter:
    """
    One parameter of an effect.

    Attributes
    ----------
    name, unit : str
    size : int
        Number of components; 0 means a number or a list of any length.
    typical : float
        A magnitude worth worrying about; scales fits and default tolerances.
    lower, upper : float
        Physical bounds.
    differentiable : bool
        Whether `Effect.gradient` gives its derivative.
    linear : bool
        Whether the displacement is proportional to it.

    """

    name: str
    unit: str
    size: int = 1
    typical: float = 1.0
    lower: float = -np.inf
    upper: float = np.inf
    differentiable: bool = True
    linear: bool = True


@dataclass(frozen=True, eq=False)
class View:
    """
    What an effect may look at: the samples that reach its stage.

    Attributes
    ----------
    robot : Robot
    t : array, shape (N,) [s]
    elapsed : array, shape (N,) [s]
        Time since the recording's first stamp.
    q, qd : array, shape (..., N, n) [rad, rad/s]
    static : bool
        Samples are stations at rest; their order is known, their timing means nothing.
    wrench : array, shape (N, 6), optional [N, N m]
    wrench_frame : str
    temperature : array, shape (N,), optional [degC]
    shift : mapping
        Channels displaced by the stages before.

    """

    robot: Robot
    t: Array
    elapsed: Array
    q: Array
    qd: Array
    static: bool = False
    wrench: Array | None = None
    wrench_frame: str = 'tool'
    temperature: Array | None = None
    shift: Shift = None  # type: ignore[assignment]

    def __post_init__(self) -> None:
        if self.shift is None:
            object.__setattr__(self, 'shift', {})

    @cached_property
    def frames(self) -> Frames:
        """Return the chain at these samples, with the displacements so far."""
        return frames(self.robot, self.q, self.shift)

    def joint(self, index: int) -> Array:
        """Return the position of one joint, shape (..., N)."""
        return self.q[..., index]

    def displaced(self, more: Shift, *, keep_frames: bool = False) -> View:
        """Return the view with more displacement; ``keep_frames`` where it moves no frame."""
        total = dict(self.shift)
        for key, value in more.items():
            total[key] = total[key] + value if key in total else value
        out = replace(self, shift=total)
        if keep_frames and 'frames' in self.__dict__:
            out.__dict__['frames'] = self.frames
        return out


@dataclass(frozen=True, eq=False)
class Effect(ABC):
    """
    A named physical cause; see `weld_twin_core.effects` for the vocabulary.

    Parameters may carry a leading axis of draws, shape (D,) or (D, size); displacements then
    have shape (D, N).
    """

    name: ClassVar[str]
    of: ClassVar[str]
    """What it sits on: 'joint', 'link', 'links' or 'robot'."""
    stage: ClassVar[Stage]
    parameters: ClassVar[tuple[Parameter, ...]]
    options: ClassVar[tuple[str, ...]] = ()
    """Fields that choose a variant and are never fitted."""
    needs: ClassVar[frozenset[str]] = frozenset()
    """Inputs beyond joint position: 'velocity', 'order', 'time', 'wrench', 'load', 'temperature'."""

    @abstractmethod
    def displace(self, view: View) -> Shift:
        """Return the displaced channels, each shape (..., N)."""

    def gradient(self, view: View) -> list[Shift | None]:
        """Return d displacement / d component for every component; None where there is none."""
        raise NotImplementedError(f'{self.name} has no analytic derivative')

    def slope(self, view: View) -> Shift:
        """Return d displacement / d own joint position, per ('q', i) channel; empty when none."""
        return {}

    @classmethod
    def seeds(cls, view: View, joint: str | None) -> Iterable[Effect]:
        """Yield the instances a search starts from; each spans one linear subspace."""
        yield cls._at(joint)

    def atoms(self, view: View) -> list[Shift]:
        """Return the linear features of this instance; their combinations start a fit."""
        return [shift for shift in self.gradient(view) if shift is not None]

    def from_atoms(self, coefficients: Array) -> Effect:
        """Return the instance that a combination of `atoms` stands for."""
        return self.with_vector(np.asarray(coefficients, dtype=np.float64))

    # Fit coordinates: what a least-squares fit turns. Most effects fit their parameters; an effect
    # whose parameters bend (amplitude and phase) gives coordinates in which it is straight.

    def coordinates(self) -> Array:
        """Return the fit coordinates, shape (K,)."""
        return np.array([
            value for (p, _), value in zip(self.components(), self.vector(), strict=True)
            if p.differentiable
        ])

    def with_coordinates(self, values: Array) -> Effect:
        """Return the effect at other fit coordinates, kept inside the physical bounds."""
        vector = self.vector()
        specs = self.components()
        free = [k for k, (p, _) in enumerate(specs) if p.differentiable]
        for k, value in zip(free, values, strict=True):
            vector[k] = min(max(float(value), specs[k][0].lower), specs[k][0].upper)
        return self.with_vector(vector)

    def coordinate_shifts(self, view: View) -> list[Shift]:
        """Return d displacement / d fit coordinates."""
        return [shift for shift in self.gradient(view) if shift is not None]

    def coordinate_scales(self) -> Array:
        """Return the typical size of every fit coordinate, shape (K,)."""
        return np.array([p.typical for p, _ in self.components() if p.differentiable])

    @classmethod
    def applicable(cls, view: View, joint: str | None) -> str | None:
        """Return why the data cannot show this effect at all, or None when they can."""
        if {'velocity'} & cls.needs and view.static:
            return 'static stations carry no velocity'
        if 'wrench' in cls.needs and view.wrench is None:
            return 'no tool wrench was recorded'
        if 'load' in cls.needs and view.wrench is None and view.robot.mass is None:
            return 'the robot model has no link masses and no wrench was recorded'
        if 'temperature' in cls.needs and view.temperature is None:
            return 'no temperature was recorded'
        return None

    # Parameter vectors -----------------------------------------------------------------------

    @property
    def site(self) -> str | None:
        """Return the joint the effect sits on, or None for the robot as a whole."""
        return getattr(self, 'joint', None)

    @property
    def key(self) -> tuple[str, ...]:
        """Return what tells this effect from others of the file: name, joint and options."""
        extra = tuple(str(getattr(self, k)) for k in self.options if k != 'joint')
        return (self.name, self.site or '', *extra)

    def components(self) -> list[tuple[Parameter, int | None]]:
        """Return every scalar component: its parameter and its index, None for a plain number."""
        out: list[tuple[Parameter, int | None]] = []
        for parameter in self.parameters:
            value = np.asarray(getattr(self, parameter.name))
            if parameter.size == 1 or (parameter.size == 0 and value.ndim == 0):
                out.append((parameter, None))
            else:
                out += [(parameter, k) for k in range(value.shape[-1])]
        return out

    def vector(self) -> Array:
        """Return all components as one vector, shape (P,)."""
        return np.array([
            np.asarray(getattr(self, p.name), dtype=np.float64)[... if k is None else k]
            for p, k in self.components()
        ])

    def with_vector(self, vector: Array) -> Effect:
        """Return the effect with other components, shape (P,) or draws (D, P)."""
        values: dict[str, Any] = {}
        at = 0
        for parameter in self.parameters:
            now = np.asarray(getattr(self, parameter.name))
            scalar = parameter.size == 1 or (parameter.size == 0 and now.ndim == 0)
            count = 1 if scalar else now.shape[-1]
            part = np.asarray(vector)[..., at : at + count]
            values[parameter.name] = part[..., 0] if scalar else part
            at += count
        return replace(self, **values)

    def number(self, name: str, k: int | None = None) -> Array:
        """Return one component ready to broadcast with samples: scalar, or shape (D, 1)."""
        value = np.asarray(getattr(self, name), dtype=np.float64)
        if k is not None:
            value = value[..., k]
        return value[..., None] if value.ndim else value

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
        for parameter in self.parameters:
            value = np.asarray(getattr(self, parameter.name), dtype=np.float64)
            if parameter.size > 1 and (value.ndim == 0 or value.shape[-1] != parameter.size):
                raise ModelError(
                    f'{self.name}: {parameter.name} needs {parameter.size} numbers, '
                    f'got shape {value.shape}'
                )
            if not np.isfinite(value).all():
                raise ModelError(f'{self.name}: {parameter.name} is not finite')
            if (value < parameter.lower).any() or (value > parameter.upper).any():
                raise ModelError(
                    f'{self.name}: {parameter.name} = {value} {parameter.unit} is outside '
                    f'[{parameter.lower:g}, {parameter.upper:g}]'
                )

    def to_mapping(self) -> dict[str, Any]:
        """Return the entry of an effects file that makes this effect."""
        out: dict[str, Any] = {'effect': self.name}
        for item in fields(self):
            value = getattr(self, item.name)
            if value is None or (item.name in self.options and value == item.default):
                continue
            out[item.name] = np.asarray(value).tolist() if not isinstance(value, str) else value
        return out


class ChannelError(Effect):
    """A constant error of one channel of one joint or row: its one parameter is the displacement."""

    channel: ClassVar[str]

    def displace(self, view: View) -> Shift:
        """Return the parameter on the channel."""
        site = (self.channel, view.robot.index(str(self.site)))
        return single(site, self.number(self.parameters[0].name), view)

    def gradient(self, view: View) -> list[Shift | None]:
        """Return one: the displacement is the parameter."""
        return [single((self.channel, view.robot.index(str(self.site))), np.ones(()), view)]


class FrameError(Effect):
    """A constant error of the base or tool frame: a displacement and a turn."""

    channel: ClassVar[str]
    of = 'robot'
    stage = Stage.LINK
    parameters = (
        Parameter('xyz', 'm', size=3, typical=5e-4),
        Parameter('rotvec', 'rad', size=3, typical=1e-3),
    )

    def displace(self, view: View) -> Shift:
        """Return xyz and rotvec on the six components of the frame."""
        out: dict[Channel, Array] = {}
        for k in range(3):
            out |= single((self.channel, k), self.number('xyz', k), view)
            out |= single((self.channel, k + 3), self.number('rotvec', k), view)
        return out

    def gradient(self, view: View) -> list[Shift | None]:
        """Return one for each component."""
        return [single((self.channel, k), np.ones(()), view) for k in range(6)]


class MemoryEffect(Effect):
    """
    An effect whose displacement depends on the motion before.

    `run` is the whole definition: the batch form runs it over all samples, the live form over
    one sample at a time with the state it returned. `displace` is `run` from rest.
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


E = TypeVar('E', bound=Effect)
REGISTRY: dict[str, type[Effect]] = {}


def register(effect: type[E]) -> type[E]:
    """
    Make an effect known by its name, from this package or from user code.

    Raises
    ------
    ModelError
        Another effect has that name.

    """
    known = REGISTRY.get(effect.name)
    if known is not None and known.__qualname__ != effect.__qualname__:
        raise ModelError(f'an effect named {effect.name!r} is registered already')
    REGISTRY[effect.name] = effect
    return effect


def effect_from_mapping(entry: Mapping[str, Any]) -> Effect:
    """
    Build an effect from an entry of an effects file.

    Raises
    ------
    ModelError
        Unknown effect or parameter, or a value that is not a number.

    """
    if not isinstance(entry, Mapping) or 'effect' not in entry:
        raise ModelError(f"an effect must be a mapping with the key 'effect', got {entry!r}")
    kind = REGISTRY.get(str(entry['effect']))
    if kind is None:
        raise ModelError(
            f'unknown effect {entry["effect"]!r}; known effects are ' + ', '.join(sorted(REGISTRY))
        )
    allowed = {item.name for item in fields(kind)}
    values: dict[str, Any] = {}
    for key, value in entry.items():
        if key == 'effect':
            continue
        if key not in allowed:
            raise ModelError(
                f'effect {kind.name!r} has no parameter {key!r}; it takes '
                + ', '.join(sorted(allowed))
            )
        values[key] = value if key in kind.options or key == 'joint' else _numbers(kind, key, value)
    try:
        return kind(**values)
    except TypeError as error:
        raise ModelError(f'effect {kind.name!r}: {error}') from None


def effects_from_list(entries: Any, robot: Robot) -> tuple[Effect, ...]:
    """
    Build and check the effects of a file against a robot.

    Raises
    ------
    ModelError
        Not a list, or an entry that cannot be used; the message names the entry.

    """
    if entries is None:
        return ()
    if not isinstance(entries, Sequence) or isinstance(entries, str):
        raise ModelError('an effects file must be a list of effects')
    out = []
    for k, entry in enumerate(entries):
        try:
            effect = effect_from_mapping(entry)
            effect.check(robot)
        except (ModelError, DataError) as error:
            raise ModelError(f'effect {k}: {error}') from None
        out.append(effect)
    return tuple(out)


def _numbers(kind: type[Effect], key: str, value: Any) -> Any:
    try:
        array = np.asarray(value, dtype=np.float64)
    except (TypeError, ValueError):
        raise ModelError(f'effect {kind.name!r}: {key} must be a number, got {value!r}') from None
    return float(array) if array.ndim == 0 else array


def single(channel: Channel, value: Array | float, view: View) -> Shift:
    """Return a shift of one channel, broadcast over the samples of a view."""
    wanted = np.broadcast_shapes(np.shape(value), view.t.shape)
    return {channel: np.broadcast_to(value, wanted)}
