# Copyright 2026 weld_twin contributors
# SPDX-License-Identifier: Apache-2.0
"""
Which joints of a cell a controller has as external axes, under which names.

KUKA has E1 to E6 in every position, ABB the six values of an extjoint, FANUC the extended axes E1 to
E3 of the arm's group and the joints of further groups. No file of a program says which joint of a
robot file is which, so it is told. All count as the joint does, or the other way round.
"""

from __future__ import annotations

import re
from typing import NamedTuple

import numpy as np

from weld_twin_core.arm.robot import Robot
from weld_twin_core.arrays import Array
from weld_twin_core.errors import DataError

LABELS = {
    'krl': (r'E[1-6]', 'E1=rail,E2=tilt'),
    'rapid': (r'eax_[a-f]', 'eax_a=rail,eax_b=tilt'),
    'fanuc-ls': (r'E[1-3]|GP[2-8]\.J[1-9]', 'E1=rail,GP2.J1=tilt'),
}
"""What external axes are called, and how they are told."""
BY_NAME = ('joint-trajectory', 'csv')
"""Languages that call joints by their names, those of a positioner and a track like all others."""
ARM = 6
"""Joints of an arm; that many are left behind a track, or what slides first is the arm itself."""


class ExternalAxis(NamedTuple):
    """One external axis."""

    label: str
    """As the controller calls it."""
    joint: int
    """Of the robot, counted from 0."""
    sign: float = 1.0
    """-1 where it counts the other way round."""


def carrying(robot: Robot) -> int:
    """Return how many first joints of a robot are a positioner's, or a track's that carries an arm."""
    count = robot.behind
    while robot.prismatic[count] and robot.n - count > ARM:
        count += 1
    return count


def external_axes(given: str, robot: Robot, language: str) -> tuple[ExternalAxis, ...]:
    """
    Return the external axes of a robot in the order of its joints.

    Raises DataError: it is not told and has to be, the language has none, or it is told wrongly.

    given: which is which, as ``E1=rail,E2=-tilt``; empty where it is not told.
    """
    names = robot.joint_names[: carrying(robot)]
    listed = ', '.join(names)
    if language not in LABELS:
        if given:
            raise DataError(f'--external is for {", ".join(LABELS)}, and this is {language}')
        if names and robot.behind and language not in BY_NAME:
            raise DataError(
                f'external axes of {language} are not known here, and robot {robot.name!r} has some '
                f'({listed}); choose {", ".join((*LABELS, *BY_NAME))}, or take the robot alone'
            )
        return tuple(map(ExternalAxis, names, range(len(names)))) if robot.behind else ()
    pattern, example = LABELS[language]
    if not given:
        if names:
            raise DataError(
                f'say which external axes of the controller the joints {listed} are, such as '
                f'--external {example}; a minus before a joint is for one that counts the other way'
            )
        return ()
    axes = [_axis(text.strip(), pattern, robot) for text in given.split(',')]
    reported = sorted(axis.joint for axis in axes)
    if reported != list(range(max(len(names), len(axes)))) or len({a.label for a in axes}) < len(
        axes
    ):
        raise DataError(
            f'--external must tell each of the joints {listed or "before the arm"} once, each under a '
            f'name of its own, and no joint of the arm; got {given!r}'
        )
    return tuple(sorted(axes, key=lambda axis: axis.joint))


def _axis(text: str, pattern: str, robot: Robot) -> ExternalAxis:
    label, sign, joint = (part.strip() for part in text.partition('='))
    result = re.fullmatch(pattern, label, re.I)
    if not sign or result is None:
        raise DataError(f'--external needs NAME=joint with NAME like {pattern}, got {text!r}')
    name = label.lower() if label.lower().startswith('eax') else label.upper()
    back = joint.startswith('-')
    return ExternalAxis(name, robot.index(joint.removeprefix('-')), -1.0 if back else 1.0)


def shown_order(robot: Robot, axes: tuple[ExternalAxis, ...]) -> Array:
    """Return the joints of a robot from those a controller shows, (n, n): the arm's, then others."""
    out, own = np.zeros((robot.n, robot.n)), robot.n - len(axes)
    out[np.arange(len(axes), robot.n), np.arange(own)] = 1.0
    for k, axis in enumerate(axes):
        out[axis.joint, own + k] = axis.sign
    return out
