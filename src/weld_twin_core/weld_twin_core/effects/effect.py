# Copyright 2026 weld_twin contributors
# SPDX-License-Identifier: Apache-2.0
"""
The contract of an effect: parameters that displace channels of the kinematic chain.

A new effect is one file: a class with `displace`, and `gradient` where a closed form is at hand;
`register` makes it a frozen dataclass, and known to the injector, the twin, the sensitivity study
and the diagnosis alike. What else it may tell of itself are the traits and groups of `hooks`.
"""

from __future__ import annotations

import re
from abc import ABC, abstractmethod
from collections.abc import Iterable
from dataclasses import dataclass, fields, replace
from functools import cached_property
from math import isfinite
from typing import TYPE_CHECKING, Any, ClassVar, TypeVar

import numpy as np

from ..arm.channels import Channel, Shift
from ..arm.robot import Robot
from ..arrays import Array
from ..errors import ModelError
from .hooks import OF_GROUP, TRAITS, FitHooks, Hooked, SearchHooks, Traits, TwinHooks, gathered
from .view import Parameter, Stage, Value, View
from .wording import metres, radians, travel

__all__ = ['REGISTRY', 'Effect', 'FitHooks', 'Hooked', 'LinearEffect', 'MemoryEffect', 'Parameter']
__all__ += ['SearchHooks', 'Stage', 'Traits', 'TwinHooks', 'Value', 'View', 'register']

_RELATIVE_STEP = 1e-5
"""Step of numerical derivatives, in typical magnitudes of the parameter."""

SLIDING_UNITS = {'rad': 'm', 'rad/(N m)': 'm/N'}
"""Units of a joint that turns, and those in their place where it slides."""

if TYPE_CHECKING:
    from typing_extensions import dataclass_transform
else:  # what tools see; at run time `register` makes the dataclass

    def dataclass_transform(**_: bool) -> Any:
        return lambda function: function


_E = TypeVar('_E', bound='Effect')


@dataclass(frozen=True, eq=False)
class Effect(ABC):
    """
    A named physical cause; see `weld_twin_core.effects` for the vocabulary.

    Parameters may carry a leading axis of draws, shape (D,) or (D, size); displacements then
    have shape (D, N). A parameter of any length (``size`` 0) is one number, a list (K,), or draws
    of a list (D, K).

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

    name: ClassVar[str]
    """How files call it; left out, the name of the class as in `gear_ratio` of `GearRatio`."""
    parameters: ClassVar[tuple[Parameter, ...]]
    options: ClassVar[tuple[str, ...]] = ()
    """Fields that choose a variant and are never fitted."""
    of: ClassVar[str]
    """What it sits on: 'joint', 'link', 'links' or 'robot'."""
    stage: ClassVar[Stage]
    needs: ClassVar[frozenset[str]] = frozenset()
    """Inputs beyond joint position: velocity, order, time, wrench, load, temperature."""
    traits: ClassVar[Traits] = Traits()
    """What it is: its words, where it is entered, what brings it out, who looks for it."""
    twin: ClassVar[Hooked[TwinHooks]] = Hooked(TwinHooks)
    search: ClassVar[Hooked[SearchHooks]] = Hooked(SearchHooks)
    fit: ClassVar[Hooked[FitHooks]] = Hooked(FitHooks)
    """What the twin, the search and the fit ask of it; a kind that has more to say derives them."""

    def __init_subclass__(cls, **more: Any) -> None:
        super().__init_subclass__(**more)
        gathered(cls)

    if not TYPE_CHECKING:

        def __getattr__(self, name: str) -> Any:
            """Return a hook where version 0.1 had it; for one release more."""
            if name in TRAITS:
                return getattr(self.traits, name)
            if name in OF_GROUP:
                return getattr(getattr(self, OF_GROUP[name]), name)
            if name in ('plain', 'travelled', 'check_values'):
                return getattr(self, f'_{name}')
            raise AttributeError(f'{type(self).__name__} has no attribute {name!r}')

    @abstractmethod
    def displace(self, view: View) -> Shift:
        """Return the displaced channels, each shape (..., N)."""

    @property
    def site(self) -> str | None:
        """Return the joint the effect sits on, or None for the robot as a whole."""
        return getattr(self, 'joint', None)

    @property
    def at(self) -> str:
        """Return where it sits: the name of its joint, or its place."""
        if self.traits.place != 'joint':
            return self.traits.place
        return 'base' if self.site is None else str(self.site)

    @property
    def on(self) -> str:
        """Return what it depends on."""
        return self.traits.depends_on

    @property
    def key(self) -> tuple[str, ...]:
        """Return what tells this effect from others of the file: name, joint and options."""
        extra = tuple(str(getattr(self, k)) for k in self.options if k != 'joint')
        return (self.name, self.site or '', *extra)

    def __post_init__(self) -> None:
        for parameter in self.parameters:
            value = getattr(self, parameter.name)
            if np.ndim(value):
                array: Array = np.array(self._numeric(parameter, value))
                array.setflags(write=False)
                object.__setattr__(self, parameter.name, array)

    def _numeric(self, parameter: Parameter, value: Any) -> Array:
        try:
            return np.asarray(value, dtype=np.float64)
        except (TypeError, ValueError):
            raise ModelError(
                f'{self.name}: {parameter.name} must be a number, got {value!r}'
            ) from None

    def _check_values(self) -> None:
        """Raise ModelError for a wrong length, no number, or one outside the bounds; look once."""
        if '_sound' in self.__dict__:
            return
        for parameter in self.parameters:
            given = getattr(self, parameter.name)
            plain = isinstance(given, float) and parameter.size < 2 and isfinite(given)
            if plain and parameter.lower <= given <= parameter.upper:
                continue  # most are; arrays of one number take thirty times as long to look at
            value = self._numeric(parameter, given)
            if parameter.size > 1 and (value.ndim == 0 or value.shape[-1] != parameter.size):
                raise ModelError(
                    f'{self.name}: {parameter.name} needs {parameter.size} numbers, '
                    f'got shape {value.shape}'
                )
            if not np.isfinite(value).all():
                raise ModelError(f'{self.name}: {parameter.name} is not finite')
            if value.size and not parameter.lower <= value.min() <= value.max() <= parameter.upper:
                raise ModelError(
                    f'{self.name}: {parameter.name} = {value} {parameter.unit} is outside '
                    f'[{parameter.lower:g}, {parameter.upper:g}]'
                )
        self.__dict__['_sound'] = True

    def _is_number(self, parameter: Parameter) -> bool:
        if parameter.size:
            return parameter.size == 1
        return np.ndim(getattr(self, parameter.name)) == 0

    def components(self) -> list[tuple[Parameter, int | None]]:
        """Return every scalar component: its parameter and its index, None for a plain number."""
        return self._components

    # A search asks the same instance hundreds of times, and its fields never change.
    @cached_property
    def _components(self) -> list[tuple[Parameter, int | None]]:
        out: list[tuple[Parameter, int | None]] = []
        for parameter in self.parameters:
            if self._is_number(parameter):
                out.append((parameter, None))
            else:
                count = np.shape(getattr(self, parameter.name))[-1]
                out += [(parameter, k) for k in range(count)]
        return out

    @cached_property
    def draws(self) -> tuple[int, ...]:
        """Return the draw axis of the parameters: (D,), or () for plain numbers."""
        if all(isinstance(getattr(self, p.name), float) for p in self.parameters):
            return ()
        return self.vector().shape[:-1]

    def vector(self) -> Array:
        """Return all components as one vector, shape (P,), or (D, P) with draws; not to be written."""
        return self._vector

    @cached_property
    def _vector(self) -> Array:
        values = [getattr(self, p.name) for p in self.parameters]
        if all(isinstance(value, float) for value in values):
            out = np.array(values, dtype=np.float64)  # most effects
        else:
            parts = [
                np.asarray(getattr(self, p.name), dtype=np.float64)[... if k is None else (..., k)]
                for p, k in self.components()
            ]
            out = np.stack(np.broadcast_arrays(*parts), axis=-1)
        out.setflags(write=False)
        return out

    def with_vector(self: _E, vector: Array) -> _E:
        """Return the same with other components, shape (P,) or draws (D, P)."""
        wanted = np.asarray(vector, dtype=np.float64)
        values: dict[str, Any] = {}
        at = 0
        for parameter in self.parameters:
            number = self._is_number(parameter)
            count = 1 if number else np.shape(getattr(self, parameter.name))[-1]
            part: Any = wanted[..., at : at + count]
            # Draws of one number where a list is allowed stay draws of a list of one.
            plain = number and (parameter.size == 1 or wanted.ndim == 1)
            if plain:  # a number of Python is looked at in a tenth of the time of an array of one
                part = float(part[0]) if wanted.ndim == 1 else part[..., 0]
            values[parameter.name] = part
            at += count
        return replace(self, **values)

    def _plain(self, name: str) -> float:
        return float(np.asarray(getattr(self, name)))

    def number(self, name: str, k: int | None = None) -> Array:
        """Return one component ready to broadcast with samples: scalar, or shape (D, 1)."""
        value = np.asarray(getattr(self, name), dtype=np.float64)
        if k is not None:
            value = value[..., k]
        return value[..., None] if value.ndim else value

    def to_mapping(self) -> dict[str, Any]:
        """Return the entry of an effects file that makes this effect."""
        out: dict[str, Any] = {'effect': self.name}
        for item in fields(self):
            value = getattr(self, item.name)
            if value is None or (item.name in self.options and value == item.default):
                continue
            out[item.name] = np.asarray(value).tolist() if not isinstance(value, str) else value
        return out

    @classmethod
    def applicable(cls, view: View, joint: str | None) -> str | None:
        """Return why the data cannot show this effect at all, or None when they can."""
        if not cls.search.fits(view.robot, joint):
            return 'the robot has no part there that it could be an error of'
        if 'velocity' in cls.needs and view.static:
            return 'static stations carry no velocity'
        if 'wrench' in cls.needs and view.wrench is None:
            return 'no tool wrench was recorded'
        if 'load' in cls.needs and view.wrench is None and view.robot.mass is None:
            return 'the robot model has no link masses and no wrench was recorded'
        if 'temperature' in cls.needs and view.temperature is None:
            return 'no temperature was recorded'
        return None

    @classmethod
    def seeds(cls, view: View, joint: str | None, pull: Array | None = None) -> Iterable[Any]:
        """
        Yield the instances a search starts from; each spans one linear subspace.

        Parameters
        ----------
        pull : array, shape (N,), optional
            How strongly the residual would move the joint at every sample; an effect too fine to
            search on a grid may look for itself in it.

        """
        values: Any = {'joint': joint} if cls.of in ('joint', 'link') else {}
        yield cls(**values)

    def atoms(self, view: View) -> list[Shift]:
        """Return the linear features of this instance; their combinations start a fit."""
        return [shift for shift in self.gradient(view) if shift is not None]

    def from_atoms(self: _E, coefficients: Array) -> _E:
        """
        Return the instance that a combination of `atoms` stands for, inside its bounds.

        Unless an effect says otherwise, the atoms are those of its first components; the others
        stay as they are.
        """
        vector = np.array(self.vector())
        first = min(len(coefficients), vector.size)
        bounds = [(p.lower, p.upper) for p, _ in self.components()[:first]]
        vector[:first] = np.clip(np.asarray(coefficients, float)[:first], *np.array(bounds).T)
        return self.with_vector(vector)

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
            step = _RELATIVE_STEP * parameter.typical
            ends[:, k] = np.clip(
                [vector[k] - step, vector[k] + step], parameter.lower, parameter.upper
            )
            low, high = (self.with_vector(end).displace(view) for end in ends)
            width = ends[1, k] - ends[0, k]
            out.append({key: (high[key] - low[key]) / width for key in high})
        return out

    def on_slide(self, robot: Robot) -> bool:
        """Return whether it displaces a joint that slides: m where its parameters say rad."""
        at = self.site if self.of == 'joint' else None
        return at in robot.joint_names and bool(robot.prismatic[robot.index(str(at))])

    def _travelled(self, robot: Robot, value: float) -> str:
        """Return how far its joint moves, in mm where that slides, in degrees where it turns."""
        return travel(value, sliding=self.on_slide(robot))

    def _shifted(self, robot: Robot, value: float) -> str:
        """Return the same with its sign, of a joint that stands further on than it reads."""
        return metres(value) if self.on_slide(robot) else radians(value)

    def _theta(self, view: View) -> Array:
        """Return the position of its joint, shape (..., N)."""
        return view.joint(view.robot.index(str(self.site)))

    def _moves(self, view: View, by: Array) -> dict[Channel, Array]:
        """Return its joint displaced, shape (..., N)."""
        return {('q', view.robot.index(str(self.site))): by}

    def remedy(self, robot: Robot) -> str:
        """Return what to mend of a nominal robot where it was found: one sentence with its size."""
        digits: Any = {'float_kind': '{:.4g}'.format}
        sizes = ', '.join(
            f'{p.name} {np.array2string(np.asarray(getattr(self, p.name)), formatter=digits)} '
            f'{self.unit(p, robot)}'
            for p in self.parameters
        )
        where = f' of {self.site}' if self.site else ''
        return f'Put {self.name}{where} into the model: {sizes}.'

    def unit(self, parameter: Parameter, robot: Robot | None = None) -> str:
        """Return the SI unit of one of its parameters on a robot; left out, its joint turns."""
        slides = robot is not None and self.on_slide(robot)
        return SLIDING_UNITS.get(parameter.unit, parameter.unit) if slides else parameter.unit

    def check(self, robot: Robot) -> None:
        """Raise ModelError for a joint, a part or values that this robot cannot have."""
        if self.of in ('joint', 'link'):
            if self.site is None:
                raise ModelError(f'{self.name} needs a joint')
            robot.index(self.site)
        self._check_values()
        lacking = self.traits.lacking
        if lacking and not self.search.fits(robot, self.site):
            raise ModelError(f'{self.name} {lacking.format(site=self.site, robot=robot.name)}')


class LinearEffect(Effect):
    """An effect that is proportional to each of its components."""

    @abstractmethod
    def per_unit(self, view: View) -> list[Shift]:
        """Return for each component what it displaces where it is one."""

    def displace(self, view: View) -> Shift:
        """Return the sum of all components' displacements."""
        out: dict[Channel, Array] = {}
        for (parameter, k), part in zip(self.components(), self.per_unit(view), strict=True):
            value = self.number(parameter.name, k)
            for channel, each in part.items():
                own = value * each
                out[channel] = out[channel] + own if channel in out else own
        return out

    def gradient(self, view: View) -> list[Shift | None]:
        """Return what each component displaces where it is one."""
        return list(self.per_unit(view))


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


REGISTRY: dict[str, type[Effect]] = {}
"""By name, in the order of names."""


@dataclass_transform(frozen_default=True, eq_default=False)
def register(effect: type[_E]) -> type[_E]:
    """
    Make an effect known by its name, from this package or from user code.

    Parameters
    ----------
    effect : subclass of Effect
        Its fields become those of a frozen dataclass; its ``name`` is how effects files call it.

    Returns
    -------
    The same class, so that this may be used as a decorator.

    Raises
    ------
    ModelError
        Another effect has that name, or the class does not keep the contract of its stage.

    Examples
    --------
    >>> import weld_twin_core as wt
    >>> wt.register(wt.effects.Backlash) is wt.effects.Backlash
    True

    """
    if '__dataclass_fields__' not in vars(effect):
        effect = dataclass(frozen=True, eq=False)(effect)
    if not hasattr(effect, 'name'):
        effect.name = re.sub('(?<!^)(?=[A-Z])', '_', effect.__name__).lower()
    known = REGISTRY.get(effect.name)
    if known is not None and known.__qualname__ != effect.__qualname__:
        raise ModelError(f'an effect named {effect.name!r} is registered already')
    declared = {parameter.name for parameter in effect.parameters}
    missing = sorted(declared - {item.name for item in fields(effect)})
    if missing:
        raise ModelError(f'effect {effect.name!r} declares {missing[0]!r} but has no such field')
    if effect.stage in (Stage.SERVO, Stage.PLAY) and not issubclass(effect, MemoryEffect):
        raise ModelError(
            f'effect {effect.name!r} acts in stage {effect.stage.name}, which runs in order of '
            'time; derive it from MemoryEffect'
        )
    if effect.stage == Stage.ELASTIC and 'compliance' not in declared:
        raise ModelError(
            f'effect {effect.name!r} is a spring in a joint; name its parameter compliance'
        )
    REGISTRY[effect.name] = effect
    for name in sorted(REGISTRY):  # no answer may hang on which file was imported first
        REGISTRY[name] = REGISTRY.pop(name)
    return effect
