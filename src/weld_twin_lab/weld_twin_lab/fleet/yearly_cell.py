# Copyright 2026 weld_twin contributors
# SPDX-License-Identifier: Apache-2.0
"""A cell that is measured every week: its arm as built, its check stations, its diagnosis."""

from __future__ import annotations

import shutil
from collections.abc import Sequence
from dataclasses import dataclass, replace
from datetime import datetime
from pathlib import Path
from typing import Any

import numpy as np

from weld_twin_core.errors import DataError
from weld_twin_msgs_py.bags import write_recording
from weld_twin_msgs_py.robots import write_robot_yaml
from weld_twin_nodes.cli.in_process import weld_twin
from weld_twin_report.history import Entry, entry_of

from ..blind.blind_cell import BlindCell, Take, as_recording, draw_cell, record, take

Cause = dict[str, Any]
ROBOTS = ('ur5', 'kuka_kr6_r900', 'abb_irb120', 'fanuc_m10ia', 'ur10', 'yaskawa_ar2010')
"""Arms of the cells, one after the other."""
SPAN = 48.0
"""Length of a check [s]: 120 stations, what a tracker takes in half an hour."""
AS_BUILT = {'joint_offset': ('offset', 4e-5), 'link_length': ('da', 1e-5)}
"""Standard deviations of the arm's own errors [rad, m]: what a first calibration leaves."""
PLAY = (3e-4, 8e-4)
"""Width [rad] of the play of one joint: half of what makers allow, and more."""
MOVED = 0.05
"""How far the tracker stands off from where it stood, in the worst direction [m and rad]."""


@dataclass(frozen=True, eq=False)
class YearlyCell:
    """A cell, and the checks it is measured with."""

    cell: BlindCell
    as_built: tuple[Cause, ...]
    """Its flaws on the first day."""
    checks: tuple[Take, ...]
    """Sets of stations; a new set-up of the tracker may mean another one."""


def draw(seed: int, number: int) -> YearlyCell:
    """Return a cell of a study; the same numbers give the same cell."""
    rng = np.random.default_rng([seed, number])
    cell = draw_cell(ROBOTS[number % len(ROBOTS)], 'stations', (), rng)
    cell = replace(cell, align=('base',), warming=False, loaded=False, known=())
    joints = cell.robot.joint_names
    flaws: list[Cause] = [
        {'effect': effect, 'joint': joint, key: float(width * rng.normal())}
        for effect, (key, width) in AS_BUILT.items()
        for joint in joints
    ]
    worn = joints[int(rng.integers(1, 3))]
    flaws.append({'effect': 'backlash', 'joint': worn, 'width': float(rng.uniform(*PLAY))})
    checks = tuple(take(cell, 'stations', SPAN, rng) for _ in range(2))
    return YearlyCell(cell, tuple(flaws), checks)


def set_up(rng: np.random.Generator) -> Cause:
    """Return where the tracker stands, as an error of the base."""
    xyz, turn = rng.uniform(-MOVED, MOVED, (2, 3))
    return {'effect': 'base_pose', 'xyz': xyz.tolist(), 'rotvec': turn.tolist()}


def diagnosed(
    yearly: YearlyCell, causes: Sequence[Cause], check: int, seed: int, place: Path, at: datetime
) -> Entry:
    """
    Return the entry of one check: simulated, written as a bag, diagnosed by the command.

    Raises DataError: the command refused it.
    """
    taken = yearly.checks[check]._replace(seed=seed)
    made = as_recording('check', record(yearly.cell, causes, taken))
    shutil.rmtree(place, ignore_errors=True)
    place.mkdir(parents=True)
    write_recording(place / 'bag', made, yearly.cell.robot)
    write_robot_yaml(place / 'robot.yaml', yearly.cell.robot)
    words = ('diagnose', place / 'bag', '--robot', place / 'robot.yaml', '--align', 'base')
    said = weld_twin(*words, '--out', place / 'found')
    if said.code:
        raise DataError(f'{place}: {said.err.strip() or said.out.splitlines()[0]}')
    entry = entry_of(place / 'found', at)
    shutil.rmtree(place)
    return entry
