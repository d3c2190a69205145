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
from .reader import Reader, Span
from .source import closing, joint_notation, stripped

_NAMES = re.compile(r'["\']?joint_names["\']?[ \t]*:[ \t]*')
_POSITIONS = re.compile(r'["\']?\bpositions["\']?[ \t]*:[ \t]*')
_ITEM = re.compile(r'\s*-[ \t]*([^\r\n]*)')
_TIME = re.compile(
    r'["\']?time_from_start["\']?\s*:\s*\{?\s*["\']?secs?["\']?\s*:\s*(\d+)\s*,?\s*'
    r'["\']?nano?secs?["\']?\s*:\s*(\d+)'
)
DIGITS = 9
"""Of a position in rad or m: messages carry doubles."""


class TrajectoryReader(Reader):
    """Goes through a trajectory once."""

    comments = (r'(?<![\w"\'])#[^\r\n]*',)

    def read(self) -> Program:
        robot, self.program.one_seam = self.context.robot, True
        mix = np.eye(robot.n)[:, self._order(robot.joint_names)]
        notation = joint_notation(np.ones(robot.n), mix, DIGITS, 'positions')
        places = [result.end() for result in _POSITIONS.finditer(self.text)]
        times = _times(self.text, places)
        for k, place in enumerate(places):
            numbers = [self.number(*part, 'a position') for part in self._items(place)]
            where = self.source.where(place)
            if len(numbers) != robot.n:
                raise DataError(
                    f'{where}: {robot.n} positions are needed, there are {len(numbers)}'
                )
            point = Ref(self.program.add_point(f'point {k + 1}', numbers, notation))
            duration = max(times[k] - times[k - 1], 0.0) if k and times else 0.0
            stop = k == len(places) - 1
            self.program.add(Step('joint', where, point, duration=duration, stop=stop))
        return self.program

    def _order(self, joints: Sequence[str]) -> list[int]:
        """Return which joint of the robot each position is."""
        # Goals and plans of MoveIt have an empty one beside it, of joints with several axes.
        lists = [(r, items) for r in _NAMES.finditer(self.text) if (items := self._items(r.end()))]
        if not lists:
            raise DataError(f'{self.source.where(0)}: a trajectory needs joint_names')
        if len(lists) > 1:
            raise DataError(
                f'{self.source.name}: it holds several trajectories; give each a file of its own'
            )
        ((result, items),) = lists
        names = [self.text[a:b].strip(' "\'') for a, b in items]
        if sorted(names) != sorted(joints):
            raise DataError(
                f'{self.where(result)}: it moves {", ".join(names)}; the robot has '
                + ', '.join(joints)
            )
        return [list(joints).index(name) for name in names]

    def _items(self, place: int) -> list[Span]:
        """Return the parts of a list, ``[a, b]`` or a line each."""
        if self.text.startswith('[', place):
            end = closing(self.source, self.text, place)
            return [(a, b) for a, b in self.pieces(place + 1, end) if a < b]
        out = []
        result = _ITEM.match(self.text, place)
        while result is not None:
            out.append(stripped(self.text, *result.span(1)))
            result = _ITEM.match(self.text, result.end())
            if result is not None and ':' in result[1]:
                break  # The next point begins, "- positions:".
        return out


def _times(text: str, places: Sequence[int]) -> list[float]:
    """Return the time of every point [s]; empty where they are not in order."""
    times = [int(m[1]) + int(m[2]) * 1e-9 for m in _TIME.finditer(text)]
    rises = len(times) == len(places) and all(b > a for a, b in pairwise(times))
    return times if rises else []
