# Copyright 2026 weld_twin contributors
# SPDX-License-Identifier: Apache-2.0
"""
Points by the names of joints: trajectories of ROS as text, and tables.

A trajectory is YAML or JSON of ``trajectory_msgs/JointTrajectory``, as ``ros2 topic echo`` and
``ros2 topic pub`` write and take it. Positions are rad and m. The whole trajectory is one seam: it
is corrected whole or not at all. Velocities stay as they are.

A table, ``.csv``, has a line for each point, joints or poses by the names of the columns. Joints: one
column for every joint, by its name, in rad or, where it slides, in m; a unit may stand behind the
name: ``_deg``, ``_mm``, ``[deg]``, ``[mm]``. Poses: ``x y z`` [m] with ``qx qy qz qw``. Optional:
``move`` (joint, linear), ``speed`` (m/s, of joint moves the share of full speed), ``dwell`` [s].
Lines that begin with ``#`` are comments.
"""

import re
from collections.abc import Sequence
from itertools import pairwise

import numpy as np

from weld_twin_core.arm.rotation import matrix_from_quaternion, quaternion_from_matrix, transform
from weld_twin_core.arrays import Array
from weld_twin_core.errors import DataError
from weld_twin_core.motion.programs.travel import Kind

from ..files.csv_text import unguarded
from .build import Program, Ref, Step
from .reader import LEAST_SPEED, Reader, Span
from .source import Notation, closing, joint_notation, stripped

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


POSE = ('x', 'y', 'z', 'qx', 'qy', 'qz', 'qw')
_TURNS = {'': 1.0, '_rad': 1.0, ' [rad]': 1.0} | dict.fromkeys(
    ('_deg', ' [deg]', ' [\N{DEGREE SIGN}]'), np.pi / 180.0
)
_SLIDES = {'': 1.0, '_m': 1.0, ' [m]': 1.0, '_mm': 1e-3, ' [mm]': 1e-3}
"""What may stand behind the name of a joint, and what its numbers are then in SI."""
_KINDS: dict[str, Kind] = {'joint': 'joint', 'linear': 'linear'}
SPEED = 0.1
"""m/s, and share of full speed, without a column."""


class CsvReader(Reader):
    """Goes through a table line by line."""

    comments = ()

    def read(self) -> Program:
        head, columns, cells = list[str](), list[str](), dict[str, Span]()
        for line in re.finditer(r'[^\r\n]+', self.text):
            place = line.start()
            if not line[0].strip() or line[0].lstrip().startswith('#'):
                continue
            parts, where = self.pieces(*line.span()), self.source.where(place)
            if not head:
                head = [unguarded(self.source.text[slice(*part)].strip('"')) for part in parts]
                columns, notation = self._columns(where, head)
                continue
            if len(parts) != len(head):
                raise DataError(f'{where}: {len(head)} cells are needed, there are {len(parts)}')
            cells = dict(zip(head, parts, strict=True))
            numbers = [self.number(*cells[name], name) for name in columns]
            point = self.program.add_point(f'line {self.source.line(place)}', numbers, notation)
            self.program.add(self._step(cells, point, notation.joints, where))
        others = [name for name in head if name not in (*columns, 'move', 'speed', 'dwell')]
        if named := [name for name in others if np.isfinite(self.value(cells.get(name), np.nan))]:
            self.program.notes.append(
                f'the numbers of {", ".join(named)} are not read: they stay, and the arm is taken to '
                'stand still in them'
            )
        return self.program

    def _columns(self, where: str, head: Sequence[str]) -> tuple[list[str], Notation]:
        robot = self.context.robot
        if len(set(head)) != len(head):
            raise DataError(f'{where}: a column is named twice')
        named = {}
        for joint, slides in zip(robot.joint_names, robot.prismatic, strict=True):
            ends = _SLIDES if slides else _TURNS
            spelt = next((joint + end for end in ends if joint + end in head), None)
            if spelt is not None:
                named[spelt] = ends[spelt.removeprefix(joint)]
        if len(named) == robot.n:
            units = np.array(list(named.values()))
            return list(named), joint_notation(units, np.eye(robot.n), 9, 'joints')
        if all(name in head for name in POSE):
            return list(POSE), CSV_POSE
        raise DataError(
            f'{where}: a column for every joint ({", ".join(robot.joint_names)}) or '
            f'{" ".join(POSE)} is needed'
        )

    def _step(self, cells: dict[str, Span], point: int, joints: bool, where: str) -> Step:
        kind: Kind = 'joint' if joints else 'linear'
        if 'move' in cells:
            word = self.source.text[slice(*cells['move'])].strip('"')
            if word not in _KINDS:
                raise DataError(f'{where}: move must be joint or linear, got {word!r}')
            kind = _KINDS[word]
        speed = self.number(*cells['speed'], 'speed').value if 'speed' in cells else SPEED
        dwell = self.number(*cells['dwell'], 'dwell').value if 'dwell' in cells else 0.0
        stop = dwell > 0.0 or 'dwell' not in cells
        speed = max(speed, LEAST_SPEED)
        return Step(kind, where, Ref(point), speed=speed, stop=stop, dwell=max(dwell, 0.0))


def _value(numbers: Sequence[float]) -> Array:
    rotation = matrix_from_quaternion(np.array(numbers[3:7]))
    return transform(rotation, np.array(numbers[:3]))


def _numbers(pose: Array, old: Sequence[float]) -> list[float]:
    turn = quaternion_from_matrix(pose[:3, :3])
    sign = 1.0 if float(turn @ np.array(old[3:7])) >= 0.0 else -1.0
    return [*(float(v) for v in pose[:3, 3]), *(float(sign * v) for v in turn)]


CSV_POSE = Notation('x y z qx qy qz qw', False, _value, _numbers, (7, 9))
"""Of the poses in a table."""
