# Copyright 2026 weld_twin contributors
# SPDX-License-Identifier: Apache-2.0
"""
Joint trajectories of ROS as text: YAML or JSON of ``trajectory_msgs/JointTrajectory``.

That is what ``ros2 topic echo`` and ``ros2 topic pub`` write and take. Positions are rad and m. The
whole trajectory is one seam: it is corrected whole or not at all. Velocities stay as they are.
"""

from __future__ import annotations

import re
from collections.abc import Sequence
from itertools import pairwise

import numpy as np

from weld_twin_core.errors import DataError

from .build import Program, Ref, Step
from .context import Context
from .notation import joint_notation
from .source import Number, Source, closing, masked, number_at, split_outside, stripped

NAME = 'joint-trajectory'
_NAMES = re.compile(r'["\']?joint_names["\']?[ \t]*:[ \t]*')
_POSITIONS = re.compile(r'["\']?\bpositions["\']?[ \t]*:[ \t]*')
_ITEM = re.compile(r'\s*-[ \t]*([^\r\n]*)')
_TIME = re.compile(
    r'["\']?time_from_start["\']?\s*:\s*\{?\s*["\']?secs?["\']?\s*:\s*(\d+)\s*,?\s*'
    r'["\']?nano?secs?["\']?\s*:\s*(\d+)'
)
DIGITS = 9
"""Of a position in rad or m: messages carry doubles."""


def read(sources: Sequence[Source], context: Context) -> Program:
    """
    Return what is understood of a trajectory.

    Raises DataError: it names other joints than the robot's, or a position is broken.
    """
    source, robot = sources[0], context.robot
    program = Program(NAME, [source], one_seam=True)
    text = masked(source.text, (r'(?<![\w"\'])#[^\r\n]*',))
    order = _order(source, text, robot.joint_names)
    mix = np.eye(robot.n)[:, order]
    notation = joint_notation(np.ones(robot.n), mix, DIGITS, 'positions')
    places = [result.end() for result in _POSITIONS.finditer(text)]
    times = _times(text, places)
    for k, place in enumerate(places):
        numbers = _numbers(source, text, place)
        where = source.where(place)
        if len(numbers) != robot.n:
            raise DataError(f'{where}: {robot.n} positions are needed, there are {len(numbers)}')
        point = program.add_point(f'point {k + 1}', numbers, notation)
        duration = times[k] - times[k - 1] if k and times else 0.0
        last = k == len(places) - 1
        program.add(Step('joint', where, Ref(point), duration=max(duration, 0.0), stop=last))
    return program


def _order(source: Source, text: str, joints: Sequence[str]) -> list[int]:
    """Return which joint of the robot each position is."""
    result = _NAMES.search(text)
    if result is None:
        raise DataError(f'{source.where(0)}: a trajectory needs joint_names')
    names = [text[a:b].strip(' "\'') for a, b in _items(source, text, result.end())]
    if sorted(names) != sorted(joints):
        raise DataError(
            f'{source.where(result.start())}: it moves {", ".join(names)}; the robot has '
            + ', '.join(joints)
        )
    return [list(joints).index(name) for name in names]


def _items(source: Source, text: str, place: int) -> list[tuple[int, int]]:
    """Return the parts of a list, ``[a, b]`` or a line each."""
    if text.startswith('[', place):
        end = closing(source, text, place)
        parts = [stripped(text, *part) for part in split_outside(text, place + 1, end)]
        return [part for part in parts if part[0] < part[1]]
    out = []
    result = _ITEM.match(text, place)
    while result is not None:
        out.append(stripped(text, *result.span(1)))
        result = _ITEM.match(text, result.end())
        if result is not None and ':' in result[1]:
            break  # The next point begins, "- positions:".
    return out


def _numbers(source: Source, text: str, place: int) -> list[Number]:
    return [number_at(source, *part, 'a position') for part in _items(source, text, place)]


def _times(text: str, places: Sequence[int]) -> list[float]:
    """Return the time of every point [s]; empty where they are not told in order."""
    times = [int(m[1]) + int(m[2]) * 1e-9 for m in _TIME.finditer(text)]
    rises = len(times) == len(places) and all(b > a for a, b in pairwise(times))
    return times if rises else []
