# Copyright 2026 weld_twin contributors
# SPDX-License-Identifier: Apache-2.0
"""
The text of a program, kept to the byte, and how makers write poses and joints in its numbers.

| maker | position | orientation |
|---|---|---|
| KUKA | X Y Z [mm] | A B C [deg]: about z, then the new y, then the new x |
| FANUC | X Y Z [mm] | W P R [deg]: about the fixed x, y, z |
| Yaskawa | X Y Z [mm] | Rx Ry Rz [deg]: about the fixed x, y, z |
| ABB | x y z [mm] | q1 q2 q3 q4: a quaternion, its scalar first |
| Universal Robots | x y z [m] | rx ry rz [rad]: axis times angle |

A about z, B about the new y and C about the new x is the same turn as C, B, A about the fixed x, y
and z, so KUKA, FANUC and Yaskawa differ in the order of the numbers alone.
"""

import re
from bisect import bisect_left
from collections.abc import Callable, Sequence
from dataclasses import dataclass
from functools import cached_property
from pathlib import Path
from typing import NamedTuple

import numpy as np

from weld_twin_core.arm.rotation import (
    matrix_from_quaternion,
    quaternion_from_matrix,
    rotation_matrix,
    rotation_vector,
    transform,
)
from weld_twin_core.arrays import Array
from weld_twin_core.errors import DataError

GIMBAL = 1e-7
"""Cosine of the middle angle below which the other two turn about the same axis."""
LENGTH = 0.02
"""Quaternions are written with few digits; one off its length by more than this is a mistake."""


class Notation(NamedTuple):
    """One way of writing a target."""

    name: str
    joints: bool  # the numbers are joint positions
    value: Callable[[Sequence[float]], Array]
    """Takes the numbers, returns a pose (4, 4) [m] or joint positions (n,) [rad]."""
    numbers: Callable[[Array, Sequence[float]], list[float]]
    """Takes a value and the numbers it replaces; returns the new numbers, as near the old ones as
    the same value can be written."""
    decimals: tuple[int, int]
    """Digits after the point that a length and an angle get at least."""


def fixed_angles(rx: float, ry: float, rz: float) -> Array:
    """Return the rotation, shape (3, 3), about the fixed x, then y, then z [rad]."""
    about = [rotation_matrix(row) for row in np.diag([rx, ry, rz])]
    return np.asarray(about[2] @ about[1] @ about[0])


def angles_fixed(rotation: Array, near: Sequence[float]) -> list[float]:
    """Return the angles about the fixed x, y and z that are nearest given ones [rad]."""
    cosine = float(np.hypot(rotation[0, 0], rotation[1, 0]))
    pitch = float(np.arctan2(-rotation[2, 0], cosine))
    if cosine < GIMBAL:
        # Only the difference (or sum) of the two others counts: the last stays as it was.
        yaw = float(near[2])
        back = rotation_matrix([0.0, 0.0, -yaw]) @ rotation
        roll = float(np.arctan2(-back[1, 2], back[1, 1]))
        return [_unwound(v, n) for v, n in zip((roll, pitch, yaw), near, strict=True)]
    roll = float(np.arctan2(rotation[2, 1], rotation[2, 2]))
    yaw = float(np.arctan2(rotation[1, 0], rotation[0, 0]))
    other = (roll + np.pi, np.pi - pitch, yaw + np.pi)
    ways = [
        [_unwound(v, n) for v, n in zip(angles, near, strict=True)]
        for angles in ((roll, pitch, yaw), other)
    ]
    return min(ways, key=lambda way: sum(abs(v - n) for v, n in zip(way, near, strict=True)))


def _unwound(angle: float, near: float) -> float:
    return float(angle - 2.0 * np.pi * np.round((angle - near) / (2.0 * np.pi)))


def _euler(name: str, order: tuple[int, int, int], decimals: tuple[int, int]) -> Notation:
    """Return a notation in millimetres and degrees; order: which number turns about x, y, z."""
    places = [3 + k for k in order]

    def value(numbers: Sequence[float]) -> Array:
        turns = np.radians([numbers[k] for k in places])
        return transform(fixed_angles(*turns), np.array(numbers[:3]) * 1e-3)

    def numbers(pose: Array, old: Sequence[float]) -> list[float]:
        angles = angles_fixed(pose[:3, :3], np.radians([old[k] for k in places]).tolist())
        out = [*(float(v) for v in pose[:3, 3] * 1e3), 0.0, 0.0, 0.0]
        for place, angle in zip(places, angles, strict=True):
            out[place] = float(np.degrees(angle))
        return out

    return Notation(name, False, value, numbers, decimals)


def _quaternion_value(numbers: Sequence[float]) -> Array:
    w, x, y, z = numbers[3:7]
    length = float(np.linalg.norm(numbers[3:7]))
    if abs(length - 1.0) > LENGTH:
        raise DataError(f'the quaternion has length {length:.4g}, an orientation needs 1')
    turn = matrix_from_quaternion(np.array([x, y, z, w]) / length)
    return transform(turn, np.array(numbers[:3]) * 1e-3)


def _quaternion_numbers(pose: Array, old: Sequence[float]) -> list[float]:
    x, y, z, w = quaternion_from_matrix(pose[:3, :3]).tolist()
    sign = 1.0 if np.dot([w, x, y, z], old[3:7]) >= 0.0 else -1.0
    return [*(float(v) for v in pose[:3, 3] * 1e3), *(sign * v for v in (w, x, y, z))]


def _rotvec_value(numbers: Sequence[float]) -> Array:
    return transform(rotation_matrix(list(numbers[3:6])), np.array(numbers[:3]))


def _rotvec_numbers(pose: Array, old: Sequence[float]) -> list[float]:
    vector = rotation_vector(pose[:3, :3])
    angle = float(np.linalg.norm(vector))
    if angle > 1e-9:
        # Any number of full turns about the axis is the same; the nearest to what stood there.
        axis = vector / angle
        turns = np.round((float(axis @ np.array(old[3:6])) - angle) / (2.0 * np.pi))
        vector = axis * (angle + 2.0 * np.pi * turns)
    return [*(float(v) for v in pose[:3, 3]), *(float(v) for v in vector)]


KUKA_POSE = _euler('X Y Z A B C', (2, 1, 0), (4, 5))
FANUC_POSE = _euler('X Y Z W P R', (0, 1, 2), (3, 3))
YASKAWA_POSE = _euler('X Y Z Rx Ry Rz', (0, 1, 2), (3, 4))
ABB_POSE = Notation('x y z q1 q2 q3 q4', False, _quaternion_value, _quaternion_numbers, (4, 8))
UR_POSE = Notation('x y z rx ry rz', False, _rotvec_value, _rotvec_numbers, (7, 7))


def joint_notation(per_unit: Array, mix: Array, decimals: int, name: str) -> Notation:
    """
    Return a notation of joint positions, each in units of the model's [rad or m], shape (n,).

    mix: from joints of the controller to those of the model where they are coupled, (n, n).
    """
    back = np.linalg.inv(mix)

    def value(numbers: Sequence[float]) -> Array:
        return np.asarray(mix @ (np.array(numbers) * per_unit))

    def numbers(joints: Array, old: Sequence[float]) -> list[float]:
        del old
        return [float(v) for v in (back @ joints) / per_unit]

    return Notation(name, True, value, numbers, (decimals, decimals))


SIZE_LIMIT = 20_000_000
"""Bytes; programs of a hundred thousand points have some ten megabytes."""
NUMBER = r'[-+]?(?:\d+\.?\d*|\.\d+)(?:[eE][-+]?\d+)?'
"""A number as all of these languages write it."""
_ALONE = re.compile(rf'\s*({NUMBER})\s*\Z')


@dataclass(frozen=True)
class Source:
    """One file of a program."""

    name: str  # without folders
    text: str
    """Every byte one character, so that what is not understood goes through unharmed."""

    def line(self, place: int) -> int:
        """Return the number of the line, counted from 1, in which a character stands."""
        return bisect_left(self._ends, place) + 1

    @cached_property
    def _ends(self) -> list[int]:
        """Return where lines end: of long programs they are looked for once, not for every point."""
        return [end.start() for end in re.finditer('\n', self.text)]

    def where(self, place: int) -> str:
        """Return file and line of a character, as messages have it."""
        return f'{self.name} line {self.line(place)}'


class Number(NamedTuple):
    """A number in a text: its value, and where it stands."""

    value: float
    start: int
    end: int
    file: int = 0


def read_source(path: Path | str) -> Source:
    try:
        with Path(path).open('rb') as file:
            raw = file.read(SIZE_LIMIT + 1)
    except OSError as error:
        raise DataError(f"program '{path}' cannot be read: {error.strerror}") from None
    if len(raw) > SIZE_LIMIT:
        raise DataError(f"program '{path}' is larger than any robot program")
    if not raw.strip():
        raise DataError(f"program '{path}' is empty")
    if b'\0' in raw:
        raise DataError(
            f"program '{path}' is no text; export it from the controller as text (ASCII) first"
        )
    if b'\r' in raw and b'\n' not in raw:
        raise DataError(
            f"program '{path}' has line ends of another age (CR alone); save it with those of "
            'Windows or Linux'
        )
    return Source(Path(path).name, raw.decode('latin-1'))


def number_at(source: Source, start: int, end: int, what: str, file: int = 0) -> Number:
    """Return the number that a piece of a file is; ``what`` it is, a message says."""
    piece = source.text[start:end]
    match = _ALONE.match(piece)
    if match is None:
        raise DataError(f'{source.where(start)}: {what} must be a number, got {_short(piece)!r}')
    value = float(match[1])
    if not abs(value) < 1e12:
        raise DataError(f'{source.where(start)}: {what} is {match[1]}, which no robot can reach')
    return Number(value, start + match.start(1), start + match.end(1), file)


def split_outside(text: str, start: int, end: int, comma: str = ',') -> list[tuple[int, int]]:
    """Return the parts of text[start:end] between commas that stand in no brackets."""
    parts, depth, begin = [], 0, start
    for k in range(start, end):
        letter = text[k]
        if letter in '([{':
            depth += 1
        elif letter in ')]}':
            depth -= 1
        elif letter == comma and depth == 0:
            parts.append((begin, k))
            begin = k + 1
    parts.append((begin, end))
    return parts


def closing(source: Source, text: str, opening: int) -> int:
    """Return the place of the bracket that closes the one at a place."""
    depth = 0
    for k in range(opening, len(text)):
        if text[k] in '([{':
            depth += 1
        elif text[k] in ')]}':
            depth -= 1
            if depth == 0:
                return k
    raise DataError(f'{source.where(opening)}: the bracket {text[opening]!r} is not closed')


def stripped(text: str, start: int, end: int) -> tuple[int, int]:
    """Return a piece of text without white space at its ends."""
    while start < end and text[start].isspace():
        start += 1
    while end > start and text[end - 1].isspace():
        end -= 1
    return start, end


def masked(text: str, patterns: Sequence[str]) -> str:
    """Return a text with comments, strings and the mark of Windows blanked out."""
    either = re.compile('|'.join(f'(?:{pattern})' for pattern in (r'\A\xef\xbb\xbf', *patterns)))
    return either.sub(lambda result: re.sub(r'[^\r\n]', ' ', result[0]), text)


def _short(text: str) -> str:
    text = ' '.join(text.split())
    return text if len(text) <= 40 else text[:37] + '...'
