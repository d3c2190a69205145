# Copyright 2026 weld_twin contributors
# SPDX-License-Identifier: Apache-2.0
"""Coordinates of a history as people read them."""

from __future__ import annotations

from typing import NamedTuple

from weld_twin_core.effects import REGISTRY
from weld_twin_nodes.wording.quantities import display_unit
from weld_twin_nodes.wording.words import cause

_TOOL = 'tool.'


class Coordinate(NamedTuple):
    """
    Effect, joint and unit of a coordinate.

    ``factor`` and ``unit`` are those in which people read it; ``words`` names it.
    """

    effect: str
    joint: str | None
    words: str
    factor: float
    unit: str


def coordinate(name: str) -> Coordinate:
    """
    Return what a coordinate is.

    Parameters
    ----------
    name : str
        'tool.x' or 'joint_offset elbow_joint 0'.

    """
    if name.startswith(_TOOL):
        axis = name.removeprefix(_TOOL)
        factor, unit = display_unit(axis, 'rad' if axis.startswith('turn') else 'm')
        words = f'turn of the tool about {axis[-1]}' if 'turn' in axis else f'tool along {axis}'
        return Coordinate('tool_pose', None, words, factor, unit)
    effect, *joint, number = name.split(' ')
    kind = REGISTRY.get(effect)
    reported = [p for p in kind.parameters if p.differentiable] if kind else []
    factor, unit = 1.0, ''
    if reported:
        parameter = reported[min(int(number), len(reported) - 1)]
        factor, unit = display_unit(parameter.name, parameter.unit)
    where, _, source = ' '.join(joint).partition('<')
    one = len(reported) == 1 and number == '0'
    words = cause(effect, where or None) + ('' if one else f', part {int(number) + 1}')
    words += f' from {source}' if source else ''
    return Coordinate(effect, where or None, words, factor, unit)
