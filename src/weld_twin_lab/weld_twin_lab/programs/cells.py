# Copyright 2026 weld_twin contributors
# SPDX-License-Identifier: Apache-2.0
"""For every language a robot that speaks it, its files, and a reader that shares nothing."""

from __future__ import annotations

from collections.abc import Callable
from typing import NamedTuple

import numpy as np

from weld_twin_core.arm.catalog import load
from weld_twin_core.arm.robot import Robot
from weld_twin_msgs_py.programs import Context, controller_of

from . import plain_readers as readers

PULSES = (1000.0, -1200.0, 1100.0, 900.0, -800.0, 700.0)
"""Per degree, of the axes of the Yaskawa arm: of the usual size, with both signs."""


class Cell(NamedTuple):
    """A robot, the suffix of its programs, an independent reader, and rounding [rad or m]."""

    robot: str
    suffix: str
    reader: Callable[[readers.Texts], readers.Moves]
    rounding: float


CELLS: dict[str, Cell] = {
    'urscript': Cell('ur5', '.script', readers.urscript, 1e-6),
    'krl': Cell('kuka_kr16_2', '.src', readers.krl, 1e-6),
    'rapid': Cell('abb_irb1600', '.mod', readers.rapid, 1e-6),
    'inform': Cell('yaskawa_ma1440', '.jbi', readers.inform, 2e-5),
    'fanuc-ls': Cell('fanuc_m10ia', '.ls', readers.fanuc, 2e-5),
    'joint-trajectory': Cell('ur5', '.yaml', readers.trajectory, 1e-8),
    'csv': Cell('ur5', '.csv', readers.table, 1e-8),
}
"""By language."""


def robot_of(language: str) -> Robot:
    """Return the robot that speaks a language."""
    return load(CELLS[language].robot)


def context_of(language: str, tool: np.ndarray | None = None) -> Context:
    """Return what a program is read with; ``tool`` is what tool 0 and 1 stand for."""
    robot = robot_of(language)
    tools = {} if tool is None else {'0': tool, '1': tool}
    controller = controller_of(robot, language, tools)
    return Context(robot, controller, np.array(PULSES))
