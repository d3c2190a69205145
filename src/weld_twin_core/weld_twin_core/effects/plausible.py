# Copyright 2026 weld_twin contributors
# SPDX-License-Identifier: Apache-2.0
"""
What a machine can have: a spread and a range for every parameter of every effect.

Each effect's file says it with its parameters; here it is asked of a robot. The spread (``sd``)
is that of a Gaussian about zero, the prior of every fit; what lies outside the range is never
named as a cause. ``source`` says where the figures come from: a publication that was read, or,
where none was found, an argument that starts with 'derived'; those are wide.
docs/plausible.md lists them. A robot may narrow them: key ``plausible`` of a robot file.
"""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import replace

import numpy as np

from ..arm.robot import Robot
from ..arrays import Array
from .effect import Effect
from .registry import REGISTRY
from .transmission_ripple import TransmissionRipple
from .view import Plausible

_UNKNOWN = Plausible(np.inf, -np.inf, np.inf, 'derived: nothing is known')
"""What is plausible where an effect does not say."""


def table() -> dict[tuple[str, str], Plausible]:
    """Return what every parameter of every effect may be, by effect and parameter."""
    return {
        (effect.name, parameter.name): parameter.range
        for effect in REGISTRY.values()
        for parameter in effect.parameters
        if parameter.range is not None
    }


def plausible(robot: Robot, effect: str, parameter: str, joint: str | None = None) -> Plausible:
    """Return spread and range of a parameter on a robot; as wide as can be where none is given."""
    kind = REGISTRY.get(effect)
    each = next((p for p in kind.parameters if p.name == parameter), None) if kind else None
    result = (each and each.range) or _UNKNOWN
    if each and each.sliding and joint is not None and robot.prismatic[robot.index(joint)]:
        result = each.sliding
    if result.by_robot is not None:
        low, high = result.by_robot(robot)
        result = replace(result, low=low, high=high)
    if result.times is not None:
        by = result.times(robot)
        result = replace(result, sd=by * result.sd, low=by * result.low, high=by * result.high)
    return _narrowed(result, robot.plausible.get(effect, {}).get(parameter))


def spreads(robot: Robot, effect: Effect) -> Array:
    """Return the prior standard deviation of every fit coordinate, shape (K,)."""
    return np.array([each.sd for each in _each(robot, effect)])


def ranges(robot: Robot, effect: Effect) -> tuple[Array, Array]:
    """Return the least and the most of every fit coordinate, each shape (K,)."""
    result = _each(robot, effect)
    return np.array([each.low for each in result]), np.array([each.high for each in result])


def beyond(robot: Robot, effect: Effect) -> list[tuple[str, float, float]]:
    """Return the parameters of an effect that no machine has, with value and nearest limit."""
    out = []
    for (parameter, _), value in zip(effect.components(), effect.vector(), strict=True):
        each = plausible(robot, effect.name, parameter.name, effect.site)
        if not each.low <= value <= each.high:
            limit = each.low if value < each.low else each.high
            out.append((parameter.name, float(value), float(limit)))
    return out


def _each(robot: Robot, effect: Effect) -> list[Plausible]:
    if isinstance(effect, TransmissionRipple):  # sine and cosine share the amplitude
        wave = plausible(robot, effect.name, 'amplitude', effect.site)
        one = replace(wave, sd=wave.sd / np.sqrt(2.0), low=-wave.high)
        return [one] * effect.fit.coordinates().size
    specs = effect.components()
    return [
        plausible(robot, effect.name, specs[k][0].name, effect.site) for k in effect.fit.fitted()
    ]


def _narrowed(result: Plausible, given: Mapping[str, float] | None) -> Plausible:
    """Return what a robot file says instead, as far as it says anything."""
    if not given:
        return result
    return Plausible(
        float(given.get('sd', result.sd)),
        float(given.get('low', result.low)),
        float(given.get('high', result.high)),
        'the robot file',
    )
