# Copyright 2026 weld_twin contributors
# SPDX-License-Identifier: Apache-2.0
"""What happens to an arm in a year: knocks, slips, wear, services, seasons, weeks without a check."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass, replace
from datetime import datetime
from pathlib import Path
from tempfile import TemporaryDirectory
from typing import Any, NamedTuple

import numpy as np

from weld_twin_core.arrays import Array
from weld_twin_core.errors import DataError
from weld_twin_msgs_py.bags import write_recording
from weld_twin_msgs_py.robots import write_robot_yaml
from weld_twin_nodes.cli.in_process import weld_twin
from weld_twin_report.history import Entry, entry_of

from ..blind.blind_cell import BlindCell, Take, as_recording, draw_cell, record, take

WEEKS = 52
"""Of a year of a cell."""
SEASON = 365.25 / 7.0
"""Weeks of the seasons."""
SHOWN = 0.5
"""Share of its width before the data that a value's standard error must be under, to be drawn: what a
check cannot show cannot be found."""
QUIET = 0.25
"""Share of years in which nothing happens."""
MISSED = 0.1
"""Share of weeks without a check, one by one."""
HOLIDAY = (3, 6)
"""Weeks without a check in a row, in half of the years."""
NEW_SET_UP = 1.0 / 13.0
"""Chance in a week that the tracker stands elsewhere and sees other stations: once a quarter."""
STEPS = {'tool_pose': (5e-5, 1e-3), 'joint_offset': (5e-5, 1e-3)}
"""A torch that was knocked [m], a motor or belt that was taken off and put back [rad]."""
WEAR = {'backlash': (1e-4, 1e-3), 'joint_compliance': (2e-6, 1e-5), 'joint_offset': (1e-4, 1e-3)}
"""Rise in a year of play [rad], of the give of a gear [rad/(N m)], of a belt that stretches [rad]."""
SEASONS = {'link_length': (1e-5, 8e-5), 'joint_offset': (3e-5, 3e-4)}
"""Half the swing of a link in a hall 5 to 10 K warmer [m], of an arm warmer on one side [rad]."""


class Event(NamedTuple):
    kind: str
    """'step', 'trend' or 'season'."""
    name: str
    """The coordinate that it moves."""
    begin: int
    """Week from which on."""
    size: float
    """Height of a step, rise of a trend in a week, half the swing of a season."""
    phase: float = 0.0
    """Of a season [rad]."""

    def columns(self, weeks: Array) -> Array:
        """Return the shape in time at some weeks, shape (W, 1), of a season (W, 2)."""
        if self.kind == 'step':
            return (weeks >= self.begin).astype(float)[:, None]
        if self.kind == 'trend':
            return np.maximum(weeks - self.begin, 0.0)[:, None]
        turn = 2.0 * np.pi * weeks / SEASON
        return np.column_stack([np.cos(turn), np.sin(turn)])

    def sizes(self) -> Array:
        """Return by what the columns are multiplied."""
        if self.kind == 'season':
            return self.size * np.array([np.cos(self.phase), np.sin(self.phase)])
        return np.array([self.size])

    def values(self, weeks: Array) -> Array:
        """Return by how much the coordinate is moved at some weeks, shape (W,)."""
        return np.asarray(self.columns(weeks) @ self.sizes())


@dataclass(frozen=True)
class Year:
    events: tuple[Event, ...]
    weeks: tuple[int, ...]
    """Those with a check."""
    set_ups: tuple[int, ...]
    """Number of the tracker's set-up at each check."""


def year(entry: Entry, rng: np.random.Generator) -> Year:
    """Return a year of a cell whose first check gave an entry."""
    events: list[Event] = []
    free = _showing(entry)
    if rng.random() >= QUIET:
        for _ in range(int(rng.choice([0, 1, 2], p=[0.35, 0.45, 0.2]))):
            events += _one('step', STEPS, free, rng, (6, 46))
        if rng.random() < 0.45:
            events += _wear(free, rng)
        if rng.random() < 0.4:
            events += _one('season', SEASONS, free, rng, (0, 1))
    weeks = np.flatnonzero(rng.random(WEEKS) >= MISSED)
    if rng.random() < 0.5:
        start, length = rng.integers(4, WEEKS - 8), rng.integers(*HOLIDAY, endpoint=True)
        weeks = weeks[(weeks < start) | (weeks >= start + length)]
    moved = np.cumsum(rng.random(WEEKS) < NEW_SET_UP)[weeks]
    return Year(tuple(events), tuple(map(int, weeks)), tuple(map(int, moved)))


def _showing(entry: Entry) -> list[str]:
    std = np.sqrt(np.diag(entry.covariance))
    return [
        name
        for name, error, width in zip(entry.names, std, entry.prior_std, strict=True)
        if error < SHOWN * width
    ]


def _one(
    kind: str,
    sizes: dict[str, tuple[float, float]],
    free: list[str],
    rng: np.random.Generator,
    begins: tuple[int, int],
) -> list[Event]:
    """Return one event on a coordinate that has none yet, or none where no such is left."""
    families = [f for f in sizes if any(_is(f, name) for name in free)]
    if not families:
        return []
    family = families[int(rng.integers(len(families)))]
    names = [name for name in free if _is(family, name)]
    name = names[int(rng.integers(len(names)))]
    free.remove(name)
    low, high = np.log(sizes[family])
    size = float(np.exp(rng.uniform(low, high)))
    sign = 1.0 if family in ('backlash', 'joint_compliance') else float(rng.choice([-1.0, 1.0]))
    begin = int(rng.integers(*begins))
    return [Event(kind, name, begin, sign * size, float(rng.uniform(0.0, 2.0 * np.pi)))]


def _is(family: str, name: str) -> bool:
    """Tell whether a coordinate is of a family; of the tool its place, which a knock moves."""
    if family == 'tool_pose':
        return name in ('tool_pose 0', 'tool_pose 1', 'tool_pose 2', 'tool.x', 'tool.y', 'tool.z')
    return name.startswith(f'{family} ')


def _wear(free: list[str], rng: np.random.Generator) -> list[Event]:
    """Return wear, and the service that takes most of it back where there is one; it goes on."""
    worn = _one('trend', WEAR, free, rng, (0, 26))
    if not worn:
        return []
    event = worn[0]._replace(size=worn[0].size / WEEKS)
    events = [event]
    if rng.random() < 0.4:
        at = int(rng.integers(event.begin + 12, WEEKS - 4))
        back = -float(rng.uniform(0.6, 1.0)) * event.size * (at - event.begin)
        events.append(Event('step', event.name, at, back))
        joint = event.name.split(' ')[1]
        zero = f'joint_offset {joint} 0'
        if zero in free:
            low, high = np.log(STEPS['joint_offset'])
            size = float(np.exp(rng.uniform(low, high)) * rng.choice([-1.0, 1.0]))
            events.append(Event('step', zero, at, size))
            free.remove(zero)
    return events


def moved(events: Sequence[Event], week: int) -> dict[str, float]:
    out: dict[str, float] = {}
    for event in events:
        value = float(event.values(np.array([float(week)]))[0])
        out[event.name] = out.get(event.name, 0.0) + value
    return out


SIZES = {
    'joint_offset': 'offset',
    'link_length': 'da',
    'backlash': 'width',
    'joint_compliance': 'compliance',
}
"""What the plant calls the coordinate of an effect."""


def cause(name: str, value: float) -> dict[str, object]:
    if name.startswith('tool'):
        axis = int(name[-1]) if name[-1].isdigit() else 'xyz'.index(name[-1])
        xyz = [value if k == axis else 0.0 for k in range(3)]
        return {'effect': 'tool_pose', 'xyz': xyz, 'rotvec': [0.0, 0.0, 0.0]}
    family, joint, _ = name.split(' ')
    return {'effect': family, 'joint': joint, SIZES[family]: value}


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
    yearly: YearlyCell, causes: Sequence[Cause], check: int, seed: int, at: datetime
) -> Entry:
    """Return the entry of one check: simulated, written as a bag, diagnosed by the command."""
    taken = yearly.checks[check]._replace(seed=seed)
    made = as_recording('check', record(yearly.cell, causes, taken))
    with TemporaryDirectory(prefix='years-') as folder:
        place = Path(folder)
        write_recording(place / 'bag', made, yearly.cell.robot)
        write_robot_yaml(place / 'robot.yaml', yearly.cell.robot)
        words = ('diagnose', place / 'bag', '--robot', place / 'robot.yaml', '--align', 'base')
        said = weld_twin(*words, '--out', place / 'found')
        if said.code:
            raise DataError(f'{place}: {said.err.strip() or said.out.splitlines()[0]}')
        return entry_of(place / 'found', at)
