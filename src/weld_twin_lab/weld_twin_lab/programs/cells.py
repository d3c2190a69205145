# Copyright 2026 weld_twin contributors
# SPDX-License-Identifier: Apache-2.0
"""For every language a robot that speaks it, its files, and a reader that shares nothing."""

from __future__ import annotations

from collections.abc import Callable
from functools import partial
from typing import NamedTuple

import numpy as np

from weld_twin_core.arm.catalog import names
from weld_twin_core.arm.robot import Robot
from weld_twin_msgs_py.programs import Context, controller_of

from . import plain_readers as readers

PULSES = (1000.0, -1200.0, 1100.0, 900.0, -800.0, 700.0)
"""Per degree, of the axes of the Yaskawa arm: of the usual size, with both signs."""


class ProgramCell(NamedTuple):
    """A robot, the suffix of its programs, and an independent reader."""

    robot: str
    suffix: str
    reader: Callable[..., readers.Moves]
    maker: str = ''
    """What the bundled robots that the language drives are called."""


CELLS: dict[str, ProgramCell] = {
    'urscript': ProgramCell('ur5', '.script', readers.urscript, 'ur'),
    'krl': ProgramCell('kuka_kr16_2', '.src', readers.krl, 'kuka_kr'),
    'rapid': ProgramCell('abb_irb1600', '.mod', readers.rapid, 'abb'),
    'inform': ProgramCell('yaskawa_ma1440', '.jbi', readers.inform, 'yaskawa'),
    'fanuc-ls': ProgramCell('fanuc_m10ia', '.ls', readers.fanuc, 'fanuc'),
    'joint-trajectory': ProgramCell('ur5', '.yaml', readers.trajectory),
    'csv': ProgramCell('ur5', '.csv', readers.table),
}
"""By language."""


def robots_of(language: str) -> list[str]:
    """Return the bundled robots that a language drives; KUKA's iiwa speaks Java."""
    return [name for name in names() if name.startswith(CELLS[language].maker)]


def reader_of(language: str, robot: Robot) -> Callable[[readers.Texts], readers.Moves]:
    """Return the independent reader for a robot, whose joints have names of their own."""
    if language in ('joint-trajectory', 'csv'):
        return partial(CELLS[language].reader, joints=robot.joint_names)
    return CELLS[language].reader


def context_on(language: str, robot: Robot) -> Context:
    """Return what a program is read with on a robot that has a torch; it is tool 0 and 1."""
    flange = controller_of(robot, language).flange
    tool = np.linalg.inv(flange) @ robot.T_flange_tool
    controller = controller_of(robot, language, {'0': tool, '1': tool})
    return Context(robot, controller, np.array(PULSES))
