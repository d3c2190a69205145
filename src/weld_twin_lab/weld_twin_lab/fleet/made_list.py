# Copyright 2026 weld_twin contributors
# SPDX-License-Identifier: Apache-2.0
"""Short recordings of many cells, made by the plant, and the list that a fleet runs."""

from __future__ import annotations

from dataclasses import replace
from pathlib import Path

import numpy as np

from weld_twin_msgs_py.bags import write_recording
from weld_twin_msgs_py.robots import write_robot_yaml

from ..blind.blind_cell import as_recording, draw_cell, record, take
from .yearly_cell import ROBOTS

SPAN = 20.0
"""Length of a recording [s]: fifty stations."""
MINUTE = 60.0
"""Length [s] of what users drop."""
PLAY = (2e-4, 1e-3)
"""Width [rad] of the play of one joint."""


def make_list(place: Path, count: int, seed: int = 1) -> Path:
    """
    Write recordings and their list, and return its path; what is there already stays.

    Parameters
    ----------
    place : Path
    count : int
    seed : int

    """
    file = place / f'list_{count}.csv'
    lines = ['cell,recording,robot,at,align']
    place.mkdir(parents=True, exist_ok=True)
    for number in range(count):
        name, robot = f'bag_{number:04d}', f'robot_{number:04d}.yaml'
        if not (place / name).exists():
            _make(place / name, place / robot, number, seed)
        lines.append(f'cell {number:04d},{name},{robot},2026-03-02,base')
    file.write_text('\n'.join(lines) + '\n', encoding='utf-8')
    return file


def make_one(place: Path, seed: int = 2) -> tuple[Path, Path]:
    """Write a recording of a minute in motion; return its bag and its robot's file."""
    bag, robot = place / 'one_minute', place / 'robot.yaml'
    _make(bag, robot, 0, seed, 'seams', MINUTE)
    return bag, robot


def _make(
    bag: Path, robot: Path, number: int, seed: int, kind: str = 'stations', span: float = SPAN
) -> None:
    rng = np.random.default_rng([seed, number])
    cell = draw_cell(ROBOTS[number % len(ROBOTS)], kind, (), rng)
    cell = replace(cell, warming=False, loaded=False, known=())
    joint = cell.robot.joint_names[int(rng.integers(1, 3))]
    play = {'effect': 'backlash', 'joint': joint, 'width': float(rng.uniform(*PLAY))}
    taken = take(cell, kind, span, rng)
    write_robot_yaml(robot, cell.robot)
    write_recording(bag, as_recording(bag.name, record(cell, [play], taken)), cell.robot)
