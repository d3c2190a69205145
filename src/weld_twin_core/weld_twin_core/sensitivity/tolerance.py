# Copyright 2026 weld_twin contributors
# SPDX-License-Identifier: Apache-2.0
"""Which parameters of which effects are uncertain, and by how much."""

from __future__ import annotations

from collections.abc import Iterable, Mapping, Sequence
from dataclasses import dataclass, replace
from typing import Any

import numpy as np

from ..arm.robot import Robot
from ..arrays import Array
from ..effects import REGISTRY, Effect, Parameter, effect_from_mapping
from ..errors import ModelError
from .distribution import Distribution

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
