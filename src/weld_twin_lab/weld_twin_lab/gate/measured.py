# Copyright 2026 weld_twin contributors
# SPDX-License-Identifier: Apache-2.0
"""The gate on recordings of real arms: spared as they are, named with a mistake put into them."""

from __future__ import annotations

from functools import cache
from pathlib import Path
from typing import Any

import numpy as np

from weld_twin_core.arm import catalog
from weld_twin_core.arm.robot import Robot
from weld_twin_core.diagnosis.frames.aligned import aligned
from weld_twin_core.diagnosis.soundness.snapshot import gap
from weld_twin_core.errors import DataError
from weld_twin_core.recording import Recording

from ..real_robots.data import tables
from ..transfer.servo_axis import axis_recording, axis_robot
from ..transfer.splits import COUNTS, HOME, alone, splits
from .mistakes import KINDS, Hidden
from .sound import Sound
from .trials import judged, looked

ARMS = ('ur5', 'ur10')
ALIGN = ('base', 'tool')
"""The tracker stands anywhere, and the reflector was never measured in."""
FEWEST = 60
"""Stations in which a mistake is made: fewer may not show it."""
NOT_HERE = ('zero_velocities', 'clock', 'base_turned', 'stamps_in_bursts')
"""Mistakes that stations with an aligned base cannot have."""
ONE_PLACE = (('instrument_knocked', 'ur5'),)
"""A kind that an arm's stations cannot show: the UR5's tool turns by thirteen degrees, and a knock
is a jump of the reflector there."""
TAKEN_UP = ('constant_angle', 'sign', 'joints_swapped')
"""Mistakes that fitted frames may take up, and"""
SHOWN = 1.5
"""how many times as much the frames alone must leave with the mistake as without."""
SPLITS = 20
"""Of every arm; see `transfer.splits.splits`."""
TRIES = 20
"""Draws of stations in which a mistake may show; then none will."""


def spared(folder: str, arm: str, number: int, engine: str = '') -> dict[str, Any]:
    """
    Return whether the gate was silent about a poor part of an arm's stations.

    The first are the splits of `transfer`, then come draws of 15 to 240 stations. ``engine`` only
    tells the results of one version of the core from those of another.
    """
    recording, name = _part(folder, arm, number)
    found = looked(recording, catalog.load(arm), ALIGN, 'table')
    return {'number': number, 'way': name, 'robot': arm, **found, 'right': not found['kinds']}


def axis_spared(folder: str, engine: str = '') -> dict[str, Any]:
    """Return whether the gate was silent about the servo axis in motion."""
    found = looked(axis_recording(Path(folder)), axis_robot(), (), 'bag')
    return {'number': 0, 'way': 'motion', 'robot': 'emps', **found, 'right': not found['kinds']}


def found_out(folder: str, arm: str, kind: str, number: int, engine: str = '') -> dict[str, Any]:
    """
    Return whether the gate named a mistake put into stations of a real arm, drawn by number.

    Raises
    ------
    DataError
        The mistake never showed in what was drawn.

    """
    rng = np.random.default_rng([17, ARMS.index(arm), list(KINDS).index(kind), number])
    robot = catalog.load(arm)
    for _ in range(TRIES):
        count = int(rng.choice([n for n in COUNTS if n >= FEWEST]))
        drawn = _drawn(folder, arm, count, rng)
        real = aligned((drawn,), robot, frozenset(ALIGN), ())[1].robot
        sound = Sound(robot, drawn, ALIGN, real, {'robot': arm})
        try:
            told, recording, said = KINDS[kind](sound, rng)
        except Hidden:
            continue
        if kind in TAKEN_UP and _left(recording, told) < SHOWN * _left(drawn, robot):
            continue
        found = looked(recording, told, ALIGN, 'table')
        return {
            'kind': kind,
            'way': arm,
            'number': number,
            'what': f'{said}, {count} stations',
            **found,
            **judged(kind, found),
        }
    raise DataError(f'no stations of the {arm} show a mistake of kind {kind}')


def _left(recording: Recording, robot: Robot) -> float:
    """Return the median distance [m] that fitted frames leave."""
    problem, model = aligned((recording,), robot, frozenset(ALIGN), ())
    return gap(problem, model)


def _part(folder: str, arm: str, number: int) -> tuple[Recording, str]:
    if number < SPLITS:
        return _splits(folder, arm)[number]
    rng = np.random.default_rng([19, ARMS.index(arm), number])
    count = int(rng.integers(COUNTS[0], COUNTS[-1] + 1))
    return _drawn(folder, arm, count, rng), f'{count} stations'


def _drawn(folder: str, arm: str, count: int, rng: np.random.Generator) -> Recording:
    table = _table(folder, arm)
    rows = np.arange(HOME[arm], table.joints.t.size)
    return alone(table, np.sort(rng.choice(rows, count, replace=False)))


@cache
def _table(folder: str, arm: str) -> Recording:
    return tables(arm, Path(folder))[0].recording


@cache
def _splits(folder: str, arm: str) -> tuple[tuple[Recording, str], ...]:
    found = splits(arm, _table(folder, arm), HOME[arm])
    return tuple((split.train, split.kind) for split in found)
