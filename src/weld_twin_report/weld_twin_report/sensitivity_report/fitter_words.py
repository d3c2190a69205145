# Copyright 2026 weld_twin contributors
# SPDX-License-Identifier: Apache-2.0
"""Tolerances in the words of who fits and masters the robot: what to do, to what, and its gain."""

import re
from collections.abc import Sequence
from math import degrees, sqrt
from typing import Any, NamedTuple

from weld_twin_nodes.wording.words import cause

TIGHTER = 5.0
"""How many times tighter a tolerance is asked for: what remains of it is 4 % of its square, so
that the gain is nearly all that can be had of it."""
_AXES = 'xyz'
_NAME = re.compile(r'(?P<effect>\w+?)(\.(?P<joint>[^.]+))?\.(?P<parameter>\w+)(\[(?P<at>\d)\])?')
_DO = {
    'joint_offset': 'master {joint}',
    'link_length': 'measure the link length of {joint} and enter it',
    'link_offset': 'measure the link offset of {joint} and enter it',
    'link_twist': 'measure the twist of the link of {joint} and enter it',
    'axis_parallelism': 'measure how parallel the axis of {joint} is and enter it',
    'backlash': 'preload or renew the gear of {joint}',
    'gear_ratio': 'measure the gear ratio of {joint} and enter it',
    'joint_compliance': 'measure how far {joint} yields and compensate it',
    'payload': 'weigh the tool and enter it',
}
_FRAMES = {
    ('base_pose', 'rotvec'): 'square up the base about its {axis} axis',
    ('base_pose', 'xyz'): 'survey the base along its {axis} axis',
    ('tool_pose', 'rotvec'): 'square up the tool about its {axis} axis',
    ('tool_pose', 'xyz'): 'measure the tool centre point along its {axis} axis',
}


class Advice(NamedTuple):
    """What to do about one tolerance: an instruction, from and to what, gain [m] and RMS then [m]."""

    instruction: str
    now: str
    wanted: str
    gain_m: float
    then_m: float


def parameter_words(name: str) -> str:
    """Return the name of a tolerance, such as ``base_pose.rotvec[1]``, as people say it."""
    result = _NAME.fullmatch(name)
    if result is None:
        return name.replace('_', ' ')
    text = cause(result['effect'], result['joint'])
    if result['at'] is None:
        return text
    axis = _AXES[int(result['at']) % 3]
    return f'{text}, {"about" if result["parameter"] == "rotvec" else "along"} {axis}'


def instruction(name: str) -> str:
    """Return what to do to keep a tolerance."""
    result = _NAME.fullmatch(name)
    if result is None:
        return f'tighten {name}'
    if result['at'] is not None and (result['effect'], result['parameter']) in _FRAMES:
        axis = _AXES[int(result['at']) % 3]
        return _FRAMES[result['effect'], result['parameter']].format(axis=axis)
    sentence = _DO.get(result['effect'])
    if sentence is None:
        return f'tighten the {parameter_words(name)}'
    return sentence.format(joint=result['joint'] or 'the robot')


def advised(parameters: Sequence[dict[str, Any]], most: int) -> list[Advice]:
    """
    Return what gains most, largest gain first.

    Tolerances are independent: one that is tightened takes its square off that of the whole.
    """
    whole = sum(row['contribution_m'] ** 2 for row in parameters)
    out = []
    for row in parameters:
        then = sqrt(max(whole - row['contribution_m'] ** 2 * (1.0 - TIGHTER**-2), 0.0))
        size = spread_of(row['tolerance'])
        out.append(
            Advice(
                instruction(row['name']),
                sized(size, row['unit']),
                sized(size / TIGHTER, row['unit']),
                sqrt(whole) - then,
                then,
            )
        )
    return sorted(out, key=lambda advice: -advice.gain_m)[:most]


def spread_of(distribution: dict[str, Any]) -> float:
    """Return how wide a tolerance is: a standard deviation, or half the width of a uniform one."""
    if 'std' in distribution:
        return float(distribution['std'])
    if 'low' in distribution and 'high' in distribution:
        return 0.5 * abs(float(distribution['high']) - float(distribution['low']))
    return max((abs(float(v)) for v in distribution.values() if isinstance(v, float)), default=0.0)


def sized(value: float, unit: str) -> str:
    """Return a tolerance in the units of a workshop."""
    if unit == 'm':
        return f'{1e3 * value:.3g} mm'
    if unit == 'rad':
        return f'{degrees(value):.2g}° ({1e3 * value:.2g} mrad)'
    return f'{value:.3g} {unit}'.rstrip(' -')
