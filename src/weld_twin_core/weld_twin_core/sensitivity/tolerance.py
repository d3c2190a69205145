# Copyright 2026 weld_twin contributors
# SPDX-License-Identifier: Apache-2.0
"""Which parameters of which effects are uncertain, by how much, and how each error scatters."""

from __future__ import annotations

from collections.abc import Callable, Iterable, Mapping, Sequence
from dataclasses import dataclass, replace
from functools import lru_cache
from typing import Any, NamedTuple

import numpy as np
from numpy.typing import ArrayLike
from scipy.special import ndtr, ndtri

from ..arm.robot import Robot
from ..arrays import Array
from ..effects import REGISTRY, Effect, Parameter, effect_from_mapping
from ..errors import ModelError


def _below_triangle(value: float, low: float, mode: float, high: float) -> float:
    if value <= low or value >= high:
        return float(value >= high)
    if value < mode:
        return (value - low) ** 2 / ((high - low) * (mode - low))
    return 1.0 - (high - value) ** 2 / ((high - low) * (high - mode))


def _in_triangle(p: Array, low: float, mode: float, high: float) -> Array:
    rise, fall = (mode - low) * (high - low), (high - mode) * (high - low)
    rising, falling = low + np.sqrt(p * rise), high - np.sqrt((1.0 - p) * fall)
    return np.where(p * (high - low) < mode - low, rising, falling)


class _Law(NamedTuple):
    """A kind of distribution, by the names of its numbers."""

    names: tuple[str, ...]
    below: Callable[..., Any]
    """From a value and the numbers to the probability below it."""
    at: Callable[..., Array]
    """From probabilities (...) and the numbers to values."""


_LAWS = {
    'normal': _Law(
        ('mean', 'std'), lambda x, m, s: ndtr((x - m) / s), lambda p, m, s: m + s * ndtri(p)
    ),
    'uniform': _Law(
        ('low', 'high'),
        lambda x, a, b: np.clip((x - a) / (b - a), 0.0, 1.0),
        lambda p, a, b: a + (b - a) * p,
    ),
    'triangular': _Law(('low', 'mode', 'high'), _below_triangle, _in_triangle),
    'lognormal': _Law(
        ('median', 'spread'),
        lambda x, m, s: ndtr(np.log(x / m) / s) if x > 0.0 else 0.0,
        lambda p, m, s: m * np.exp(s * ndtri(p)),
    ),
}
"""Distributions; the spread of a lognormal is the std of the logarithm."""
_DEFAULTS = {'mean': 0.0}
"""Parameters that may be left out."""


@dataclass(frozen=True)
class Distribution:
    """A distribution, cut off at the bounds of the parameter."""

    kind: str
    """One of `_LAWS`."""
    numbers: tuple[float, ...]
    """In the order of its law, in the unit of the parameter."""
    lower: float = -np.inf
    upper: float = np.inf
    """Values outside have no probability."""

    def __post_init__(self) -> None:
        names = _law(self.kind).names
        if len(self.numbers) != len(names) or not np.isfinite(self.numbers).all():
            raise ModelError(
                f'a {self.kind} distribution needs {", ".join(names)}, got {self.numbers}'
            )
        if not self._spread() > 0.0:
            raise ModelError(f'a {self.kind} distribution of {self._text()} does not scatter')
        if not self._mass()[0] < self._mass()[1]:
            raise ModelError(
                f'a {self.kind} distribution of {self._text()} lies outside the bounds '
                f'[{self.lower:g}, {self.upper:g}] of its parameter'
            )

    def _spread(self) -> float:
        first, last = self.numbers[0], self.numbers[-1]
        if self.kind == 'lognormal':
            return last if first > 0.0 else 0.0
        if self.kind == 'triangular' and not first <= self.numbers[1] <= last:
            return 0.0
        return last if self.kind == 'normal' else last - first

    def _text(self) -> str:
        return ', '.join(
            f'{k} {v:g}' for k, v in zip(_law(self.kind).names, self.numbers, strict=True)
        )

    def _mass(self) -> tuple[float, float]:
        """Return the probability below the lower and below the upper bound."""
        low, high = (
            float(_law(self.kind).below(end, *self.numbers)) for end in (self.lower, self.upper)
        )
        return low, high

    def values(self, unit: ArrayLike) -> Array:
        """Return the values at probabilities (...) from 0 to 1, in the parameter's unit."""
        low, high = self._mass()
        p = low + (high - low) * np.asarray(unit, dtype=np.float64)
        # The ends of an unbounded distribution are at infinity; no sample may land there.
        p = np.clip(p, 1e-12, 1.0 - 1e-12)
        return np.asarray(_law(self.kind).at(p, *self.numbers))

    @property
    def mean(self) -> float:
        """Return the mean within the bounds."""
        return _moments(self)[0]

    @property
    def std(self) -> float:
        """Return the standard deviation within the bounds."""
        return _moments(self)[1]

    def to_mapping(self) -> dict[str, Any]:
        """Return the keys of a tolerance file."""
        numbers = dict(zip(_law(self.kind).names, map(float, self.numbers), strict=True))
        return {'distribution': self.kind, **numbers}

    @classmethod
    def from_mapping(cls, data: Mapping[str, Any], lower: float, upper: float) -> Distribution:
        """Build one from a tolerance file's keys, within bounds; ModelError where a key is wrong."""
        kind = str(data.get('distribution', 'normal'))
        names = _law(kind).names
        unknown = sorted(set(map(str, data)) - {'distribution', *names})
        if unknown:
            raise ModelError(f'a {kind} distribution takes {", ".join(names)}, not {unknown[0]!r}')
        try:
            numbers = tuple(float({**_DEFAULTS, **data}[key]) for key in names)
        except KeyError as error:
            raise ModelError(f'a {kind} distribution needs the key {error}') from None
        except (TypeError, ValueError):
            raise ModelError(f'the numbers of a {kind} distribution must be numbers') from None
        return cls(kind, numbers, lower, upper)


def _law(kind: str) -> _Law:
    if kind not in _LAWS:
        raise ModelError(f'a distribution must be one of {", ".join(_LAWS)}, got {kind!r}')
    return _LAWS[kind]


_MIDPOINTS = (np.arange(2000) + 0.5) / 2000.0
"""Probabilities at which mean and deviation are summed."""


@lru_cache(maxsize=1024)
def _moments(one: Distribution) -> tuple[float, float]:
    """Return mean and standard deviation; a study asks for those of its tolerances at every step."""
    values = one.values(_MIDPOINTS)
    return float(values.mean()), float(values.std())


_FAMILIES = ('joint_offset', 'link_length', 'link_twist', 'backlash', 'base_pose')
"""The error sources of the paper's study (V.i); `base_pose` is its initialization offset."""
_OWN_KEYS = ('effect', 'joint', 'parameter', 'index')


@dataclass(frozen=True)
class Tolerance:
    """One uncertain number: a component of a parameter of an effect."""

    effect: str
    joint: str | None
    """None for effects of the robot as a whole."""
    parameter: str
    index: int | None
    """Component of a parameter that is a vector."""
    distribution: Distribution
    unit: str

    @property
    def name(self) -> str:
        """Return a name that is unique among the tolerances of a robot."""
        part = self.parameter if self.index is None else f'{self.parameter}[{self.index}]'
        return '.'.join(filter(None, (self.effect, self.joint, part)))

    @property
    def site(self) -> str:
        """Return the joint, or 'robot'."""
        return self.joint or 'robot'

    @property
    def key(self) -> tuple[str, str | None]:
        """Return what the tolerances of one effect share."""
        return self.effect, self.joint

    def to_mapping(self) -> dict[str, Any]:
        """Return the entry of a tolerance file."""
        out: dict[str, Any] = {'effect': self.effect}
        if self.joint is not None:
            out['joint'] = self.joint
        out['parameter'] = self.parameter
        if self.index is not None:
            out['index'] = self.index
        return out | self.distribution.to_mapping()


def default_tolerances(
    robot: Robot, families: Iterable[str] = _FAMILIES, scale: float = 1.0
) -> tuple[Tolerance, ...]:
    """
    Return tolerances of the typical magnitude of every parameter of some effects.

    A parameter that may have either sign is normal with its typical magnitude as std; one that
    may not be negative is uniform from zero to twice that.

    Parameters
    ----------
    robot : Robot
    families : iterable of str
        Names of effects; every joint gets those of a joint.
    scale : float
        Multiplies the typical magnitudes.

    Raises
    ------
    ModelError
        An effect is not known.

    """
    out: list[Tolerance] = []
    for family in families:
        out += _expanded(robot, {'effect': family}, scale)
    return tuple(out)


def tolerances_from_list(entries: Any, robot: Robot) -> tuple[Tolerance, ...]:
    """
    Build tolerances from the entries of a tolerance file.

    An entry names an ``effect``, and may narrow it to a ``joint``, a ``parameter`` and an
    ``index``; the other keys are a distribution. A later entry replaces an earlier one of the
    same parameter.

    Parameters
    ----------
    entries : sequence of mapping
    robot : Robot

    Raises
    ------
    ModelError
        Not a list, or an entry that cannot be used; the message names the entry.

    """
    if not isinstance(entries, Sequence) or isinstance(entries, str) or not entries:
        raise ModelError('a tolerance file must be a list with at least one entry')
    out: dict[str, Tolerance] = {}
    for k, entry in enumerate(entries):
        if not isinstance(entry, Mapping) or 'effect' not in entry:
            raise ModelError(f"tolerance {k} must be a mapping with the key 'effect'")
        try:
            result = _expanded(robot, entry, 1.0)
        except ModelError as error:
            raise ModelError(f'tolerance {k}: {error}') from None
        if not result:
            raise ModelError(f'tolerance {k}: effect {entry["effect"]!r} has no such parameter')
        out |= {item.name: item for item in result}
    return tuple(out.values())


def _expanded(robot: Robot, entry: Mapping[str, Any], scale: float) -> list[Tolerance]:
    name = str(entry['effect'])
    if name not in REGISTRY:
        raise ModelError(
            f'unknown effect {name!r}; known effects are ' + ', '.join(sorted(REGISTRY))
        )
    numbers = {k: v for k, v in entry.items() if k not in _OWN_KEYS}
    out = []
    for joint in _sites(robot, name, entry.get('joint')):
        effect = _blank_effect(name, joint)
        for parameter, index in effect.components():
            if entry.get('parameter', parameter.name) != parameter.name:
                continue
            if index is not None and entry.get('index', index) != index:
                continue
            distribution = (
                Distribution.from_mapping(numbers, parameter.lower, parameter.upper)
                if numbers
                else _typical(parameter, scale)
            )
            out.append(Tolerance(name, joint, parameter.name, index, distribution, parameter.unit))
    return out


def _sites(robot: Robot, name: str, joint: Any) -> tuple[str | None, ...]:
    if REGISTRY[name].of not in ('joint', 'link'):
        if joint is not None:
            raise ModelError(f'effect {name!r} is of the whole robot and takes no joint')
        return (None,)
    if joint is None or joint == 'all':
        return robot.joint_names
    return (robot.joint_names[robot.index(str(joint))],)


def _typical(parameter: Parameter, scale: float) -> Distribution:
    size = scale * parameter.typical
    bounds = parameter.lower, parameter.upper
    if parameter.lower >= 0.0:
        return Distribution('uniform', (parameter.lower, min(2.0 * size, bounds[1])), *bounds)
    return Distribution('normal', (0.0, size), *bounds)


def _blank_effect(name: str, joint: str | None) -> Effect:
    """Return an effect whose parameters have their defaults."""
    entry = {'effect': name} if joint is None else {'effect': name, 'joint': joint}
    return effect_from_mapping(entry)


def with_draws(
    known: Sequence[Effect], tolerances: Sequence[Tolerance], draws: Array
) -> tuple[Effect, ...]:
    """
    Return effects whose uncertain parameters carry draws, (D, P), or (P,) for plain numbers.

    A draw is added to the value that a parameter has in the effects believed to act.
    """
    columns: dict[tuple[str, str | None], list[int]] = {}
    for k, tolerance in enumerate(tolerances):
        columns.setdefault(tolerance.key, []).append(k)
    out = {(effect.name, effect.site): effect for effect in known}
    others = [effect for effect in known if out[effect.name, effect.site] is not effect]
    for key, members in columns.items():
        effect = out[key] if key in out else _blank_effect(*key)
        base = effect.vector()
        place = {(p.name, index): c for c, (p, index) in enumerate(effect.components())}
        vector = np.array(np.broadcast_to(base, draws.shape[:-1] + base.shape))
        for k in members:
            vector[..., place[tolerances[k].parameter, tolerances[k].index]] += draws[..., k]
        out[key] = effect.with_vector(vector)
    return (*others, *out.values())


def places(effects: Sequence[Effect], tolerances: Sequence[Tolerance]) -> dict[int, int]:
    """Return which of the differentiable components of effects each tolerance is that is one."""
    keys = [
        (effect.name, effect.site, parameter.name, index)
        for effect in effects
        for parameter, index in effect.components()
        if parameter.differentiable
    ]
    wanted = [(t.effect, t.joint, t.parameter, t.index) for t in tolerances]
    return {k: keys.index(key) for k, key in enumerate(wanted) if key in keys}


def scaled(tolerances: Sequence[Tolerance], factors: Mapping[str, float]) -> tuple[Tolerance, ...]:
    """
    Return tolerances whose distribution is stretched, by family; others stay as they are.

    Parameters
    ----------
    tolerances : sequence of Tolerance
    factors : mapping of str to float
        Factor for the tolerances of an effect.

    """
    out = []
    for item in tolerances:
        factor, law = factors.get(item.effect, 1.0), item.distribution
        each = (factor, 1.0) if law.kind == 'lognormal' else (factor,) * len(law.numbers)
        numbers = tuple(v * f for v, f in zip(law.numbers, each, strict=True))
        out.append(replace(item, distribution=replace(law, numbers=numbers)))
    return tuple(out)
