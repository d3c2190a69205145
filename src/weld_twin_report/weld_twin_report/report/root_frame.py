# Copyright 2026 weld_twin contributors
# SPDX-License-Identifier: Apache-2.0
"""Where a positioner stands, in the numbers that its controller takes."""

from collections.abc import Callable
from typing import NamedTuple

import numpy as np

from weld_twin_core.arm.robot import Robot
from weld_twin_core.effects.geometry import RootPose
from weld_twin_msgs_py.programs.controllers import world_of
from weld_twin_msgs_py.programs.source import ABB_POSE, FANUC_POSE, KUKA_POSE, Notation


class _Frames(NamedTuple):
    """How a maker writes a frame of the cell."""

    language: str  # whose world it counts from
    notation: Notation
    words: Callable[[list[float]], str]  # takes its six or seven numbers
    moved: str  # how a frame is displaced by another one in the world, {by} its numbers


def _named(names: str, before: str, after: str) -> Callable[[list[float]], str]:
    def words(numbers: list[float]) -> str:
        places = (3, 3, 3, 4, 4, 4)
        shown = zip(names.split(), numbers, places, strict=True)
        return before + ', '.join(f'{n} {v + 0.0:.{k}f}' for n, v, k in shown) + after

    return words


def _in_metres(numbers: list[float]) -> str:
    place = ', '.join(f'{v * 1e-3 + 0.0:.6f}' for v in numbers[:3])
    turn = ', '.join(f'{v + 0.0:.7f}' for v in numbers[3:])
    return f'x, y, z = {place} (in m), q1 to q4 = {turn}'


def _rapid(numbers: list[float]) -> str:
    parts = [f'{v + 0.0:.{k}f}' for v, k in zip(numbers, (3, 3, 3, 7, 7, 7, 7), strict=True)]
    return f'[[{",".join(parts[:3])}],[{",".join(parts[3:])}]]'


_FRAMES = {
    'kuka': _Frames('krl', KUKA_POSE, _named('X Y Z A B C', '{', '}'), '{by} : old value'),
    'abb': _Frames('rapid', ABB_POSE, _in_metres, 'PoseMult({by}, old value), both in mm'),
    'fanuc': _Frames(
        'fanuc-ls',
        FANUC_POSE,
        _named('X Y Z W P R', '', ''),
        'the frame {by}, times the old value',
    ),
}
"""Makers whose frame of a positioner is given in numbers: as they write it."""


def old_and_new(effect: RootPose, brand: str, robot: Robot) -> str:
    """Return old and new value of a positioner's root frame as its controller writes them."""
    form = _FRAMES[brand]
    world, begins = world_of(robot, form.language)
    now, new = effect.stands(robot, world)
    zeros = [0.0] * 7
    # The old one as near the new one as it can be written: where angles are one, any would do.
    after = form.notation.numbers(new, zeros)
    before = form.notation.numbers(now, after)
    by = form.notation.numbers(np.asarray(new @ np.linalg.inv(now)), zeros)
    step = _rapid(by) if brand == 'abb' else form.words(by)
    return (
        f'Old value {form.words(before)}; new value {form.words(after)}. '
        f'The origin of that world is taken to be {begins}. '
        'Where the old value there is another one, the controller has the root at another place of '
        f'the positioner: then the new value is {form.moved.format(by=step)}.'
    )
