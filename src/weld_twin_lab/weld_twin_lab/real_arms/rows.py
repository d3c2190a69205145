# Copyright 2026 weld_twin contributors
# SPDX-License-Identifier: Apache-2.0
"""The recordings that are diagnosed: parts of every source, and what was recorded beside them."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass, replace
from functools import partial
from pathlib import Path

import numpy as np

from weld_twin_core.arm.robot import Robot
from weld_twin_core.contacts import Contacts
from weld_twin_core.diagnosis.frames.aligned import frames_only
from weld_twin_core.recording import JointMotion, Measurements, Recording

from ..blind.scoring import measured_of
from . import sources
from .sources import Rows, Source, alone

COUNTS = (15, 30, 60, 120)
"""Stations of a subset: from hardly enough to plenty."""
HALVED = 60
"""Stations from which on the two halves of a row are diagnosed as well, where it asks for that."""
Make = Callable[[Source], tuple[Rows, Rows]]
"""Returns the stations that are fitted, and those that are not."""


@dataclass(frozen=True, eq=False)
class ArmRow:
    """One recording to diagnose, and what else was recorded of the same arm."""

    name: str
    robot: Robot
    align: tuple[str, ...]
    fitted: Recording
    other: Recording | None
    """None where everything is fitted."""


@dataclass(frozen=True)
class ArmPlan:
    """How a row is made: its source, which stations, and what is known or left out."""

    name: str
    source: Callable[[Path], Source]
    make: Make
    tool_known: bool = False
    points_only: bool = False
    halved: bool = False


def plans() -> tuple[ArmPlan, ...]:
    """Return every row of the study; nothing is read yet."""
    out = [plan for arm in ('ur5', 'ur10') for plan in _of_tracked(arm)]
    for arm in ('panda_1', 'panda_2', 'kuka_14'):
        source = partial(sources.sockets, arm=arm)
        out += [ArmPlan(f'{arm} without place {k}', source, partial(_place, k)) for k in range(3)]
    for name, make in _PARTS.items():
        halved = name == 'all'
        out += [
            ArmPlan(f'positioner {name}', sources.positioner, make, halved=halved),
            ArmPlan(f'iiwa {name}', sources.iiwa, make, halved=halved),
            ArmPlan(f'motoman {name}', partial(sources.motoman, masses=True), make, halved=halved),
        ]
    return (
        *out,
        ArmPlan('motoman all, no masses', partial(sources.motoman, masses=False), _all),
        ArmPlan('emps first 60 %', sources.servo, partial(_span, 0.0, 0.6)),
        ArmPlan('emps last 60 %', sources.servo, partial(_span, 0.4, 1.0)),
        ArmPlan('emps middle third', sources.servo, partial(_span, 0.33, 0.67)),
        ArmPlan('ur5 swinging', sources.swinging, _all),
    )


def _of_tracked(arm: str) -> list[ArmPlan]:
    """Return the rows of one of the two arms under a laser tracker."""
    source = partial(sources.tracked, name=f'{arm}_laser_tracker')
    out = [
        ArmPlan(f'{arm} {n} stations, draw {seed}', source, partial(_drawn, n, seed), halved=True)
        for seed in (1, 2)
        for n in COUNTS
    ]
    out += [
        ArmPlan(f'{arm} {n} stations, tool known', source, partial(_drawn, n, 3), tool_known=True)
        for n in COUNTS[1:]
    ]
    out += [
        ArmPlan(f'{arm} quarter 1', source, partial(_span, 0.0, 0.25)),
        ArmPlan(f'{arm} octant 0', source, partial(_octant, 0)),
    ]
    if arm == 'ur5':
        return [
            *out,
            ArmPlan('ur5 quarter 4', source, partial(_span, 0.75, 1.0)),
            ArmPlan('ur5 octant 7', source, partial(_octant, 7)),
        ]
    points = [
        ArmPlan(f'{arm} {n} points', source, partial(_drawn, n, 4), points_only=True, halved=True)
        for n in COUNTS[1:]
    ]
    return [*out, *points]


def row(data: Path, plan: ArmPlan) -> ArmRow:
    source = plan.source(data)
    recording, robot, align = source.recording, source.robot, source.align
    if plan.points_only:
        seen = measured_of(recording)
        recording = recording.with_measured(Measurements(seen.t, seen.position))
    fitted, other = plan.make(replace(source, recording=recording))
    if plan.tool_known:
        # As somebody has it who measured the tool apart: by everything that was recorded.
        whole = frames_only(recording, robot, frozenset(align))
        robot = robot.with_frames(tool=whole.robot.T_flange_tool)
        align = ('base',)
    rest = _part(recording, other) if other.size else None
    return ArmRow(plan.name, robot, align, _part(recording, fitted), rest)


def halves(recording: Recording) -> tuple[Recording, Recording] | None:
    """Return the odd and the even rows, each alone; None of motion, contacts and few stations."""
    touched = recording.contacts is not None
    if not recording.joints.static or touched or size(recording) < HALVED:
        return None
    return sources.halves(recording)


def size(recording: Recording) -> int:
    if recording.contacts is not None:
        return int(recording.joints.t.size)
    return int(measured_of(recording).t.size)


def _part(recording: Recording, rows: Rows) -> Recording:
    """Return some rows of a recording, as somebody has it who measured no others."""
    motion, contacts = recording.joints, recording.contacts
    if contacts is not None:
        labels = tuple(contacts.labels[k] for k in rows)
        part = contacts.artefact.part(tuple(dict.fromkeys(labels)))
        joints = JointMotion(motion.t[rows], motion.q[rows], static=True)
        return Recording(recording.name, joints, contacts=Contacts(part, labels))
    if motion.static:
        return alone(recording, rows)
    return recording.with_measured(measured_of(recording).take(rows))


def _parted(source: Source, chosen: Rows) -> tuple[Rows, Rows]:
    return np.sort(chosen), np.setdiff1d(np.arange(size(source.recording)), chosen)


def _drawn(count: int, seed: int, source: Source) -> tuple[Rows, Rows]:
    rng = np.random.default_rng([seed, count])
    return _parted(source, rng.choice(size(source.recording), count, replace=False))


def _span(low: float, high: float, source: Source) -> tuple[Rows, Rows]:
    count = size(source.recording)
    return _parted(source, np.arange(round(low * count), round(high * count)))


def _every_other(first: int, source: Source) -> tuple[Rows, Rows]:
    return _parted(source, np.arange(first, size(source.recording), 2))


def _octant(number: int, source: Source) -> tuple[Rows, Rows]:
    octant = sources.octants(measured_of(source.recording).position)
    return _parted(source, np.flatnonzero(octant == number))


def _place(k: int, source: Source) -> tuple[Rows, Rows]:
    contacts = source.recording.contacts
    assert contacts is not None
    place = np.array([label.partition('/')[0] for label in contacts.labels])
    left_out = list(dict.fromkeys(place.tolist()))[k]
    return _parted(source, np.flatnonzero(place != left_out))


_all = partial(_span, 0.0, 1.0)
_PARTS: dict[str, Make] = {
    'all': _all,
    'odd': partial(_every_other, 1),
    'even': partial(_every_other, 0),
    'first half': partial(_span, 0.0, 0.5),
    'last half': partial(_span, 0.5, 1.0),
}
"""Parts of the smaller tables, both ways where there are two."""
