# Copyright 2026 weld_twin contributors
# SPDX-License-Identifier: Apache-2.0
"""A first measurement: how many stations, which, and the files to make it with."""

from collections.abc import Callable
from dataclasses import dataclass, replace
from pathlib import Path

import numpy as np

from weld_twin_core.arm.robot import Robot
from weld_twin_core.arrays import Array
from weld_twin_core.diagnosis.predicting.planned import MeasurementPlan
from weld_twin_core.errors import DataError
from weld_twin_msgs_py.files.csv_text import csv_text
from weld_twin_msgs_py.files.joint_file import write_joint_motion
from weld_twin_msgs_py.files.whole_files import write_text
from weld_twin_msgs_py.programs import Context

from .exporting import SLOW
from .exports import NOTHING_KNOWN

STATIONS, TABLE = 'stations.yaml', 'measurements.csv'
"""Files of a plan: the stations as a path file, and a table to write the measurements into."""
LABELS = {'krl': 'A{}', 'rapid': 'rax_{}', 'fanuc-ls': 'J{}'}
YASKAWA = 'SLURBT'
"""What pendants call the joints."""
MOST = 120
"""Stations of a plan: more make a model surer by less than one in a hundred each."""
MOST_ASKED = 500
"""Stations that may be asked for: at ten seconds each and the way between them, two hours."""
LEAST = 24
"""Stations of a plan at the least: after about 15 on measured arms up to six times as much was left as
is promised of arms as usual (docs/first_measurement.md)."""
SHOWN = (8, 16, 24, 40, 60, 80, 120)
"""Rows of the table on the terminal, besides the first, the last and the number needed [stations]."""
SURE = 0.95
"""Share of the region's postures at which the tool is to be within the tolerance."""


@dataclass(frozen=True, eq=False)
class Planned:
    """A measurement planned for a robot."""

    q: Array  # shape (N, n) [rad, m], stations in the order of a short way
    minutes: Array  # shape (M + 1,), that 0, 1, ... stations take
    sigma: Array
    within: Array
    elsewhere: Array
    """Shape (M + 1,): as `MeasurementPlan` has them, up to the most that fit into the time."""
    needed: int | None
    """Stations after which the tolerance is kept; None where not even all that fit do."""


def planned(
    robot: Robot,
    plan_of: Callable[[int], MeasurementPlan],  # returns the plan of so many stations
    minutes: float | None,  # there is time for; left out, as many as ``postures`` take
    seconds: float,  # [s], that one station takes, the way to it apart
    # So many stations and no other number; left out, as many as the tolerance needs.
    postures: int | None = None,
    *,
    # least, offered: fewest stations that can be judged, and most that there are.
    least: int = LEAST,
    offered: int = MOST_ASKED,
) -> Planned:
    """Return the stations that a measurement needs."""
    if postures is not None:
        return _so_many(robot, postures, minutes, seconds, plan_of, (least, offered))
    if minutes is None:
        raise DataError('say for how long there is time, or how many postures are wanted')
    most = int(min(60.0 * minutes / seconds, MOST, offered))
    if most >= least:
        plan = plan_of(most)
        took = _took(robot, plan.q, seconds)
        most = int(np.searchsorted(took, minutes, side='right')) - 1
    if most < least:
        raise DataError(
            f'{minutes:g} minutes are enough for {max(most, 0)} stations of {seconds:g} s and the '
            f'way between them, and {least} are the fewest; give more time or shorter stations'
        )
    enough = np.flatnonzero(plan.within[: most + 1] >= SURE)
    needed = int(max(enough[0], least)) if enough.size else None
    count = needed or most
    q = plan.q[:count][_way(robot, plan.q[:count])]
    took, sigma, within, elsewhere = (
        each[: most + 1] for each in (took, plan.sigma, plan.within, plan.elsewhere)
    )
    return Planned(q, took, sigma, within, elsewhere, needed)


def _so_many(
    robot: Robot,
    count: int,
    minutes: float | None,
    seconds: float,
    plan_of: Callable[[int], MeasurementPlan],
    limits: tuple[int, int],
) -> Planned:
    """Return so many stations, however sure they make one."""
    if not limits[0] <= count <= limits[1]:
        raise DataError(f'{count} postures are asked for; a plan has {limits[0]} to {limits[1]}')
    plan = plan_of(count)
    q = plan.q[_way(robot, plan.q)]
    took = _took(robot, plan.q, seconds)
    if minutes is not None and took[-1] > minutes:
        raise DataError(
            f'{count} postures take {took[-1]:.1f} minutes, and there is time for {minutes:g}; '
            'give more time or fewer postures'
        )
    return Planned(q, took, plan.sigma, plan.within, plan.elsewhere, count)


def _took(robot: Robot, q: Array, seconds: float) -> Array:
    """Return the minutes that the first 0, 1, ... stations take, the short way."""
    out = [0.0]
    for count in range(1, len(q) + 1):
        ordered = q[:count][_way(robot, q[:count])]
        out.append((count * seconds + _travel(robot, np.diff(ordered, axis=0)).sum()) / 60.0)
    return np.maximum.accumulate(np.array(out))


def _travel(robot: Robot, steps: Array) -> Array:
    """Return the time of joint moves at the share of a first run, shape (..., ) [s]."""
    return np.asarray((np.abs(steps) / robot.planned_velocity).max(axis=-1) / SLOW[0])


def _way(robot: Robot, q: Array) -> list[int]:
    """Return the stations in the order of always the nearest next."""
    times = _travel(robot, q[:, None] - q[None])
    order = [0]
    for _ in range(1, len(q)):
        times[:, order[-1]] = np.inf
        order.append(int(times[order[-1]].argmin()))
    return order


def plan_table(plan: Planned, tolerance: float, *, diagnosed: bool = False) -> list[str]:
    """Return how sure so many poses make one, of an arm diagnosed already or not; tolerance [m]."""
    wanted = f'{1e3 * tolerance:g} mm'
    most, count = len(plan.minutes) - 1, len(plan.q)
    steps = {0, *SHOWN, count, most}
    out = [f'poses  minutes  usual error left  within {wanted}']
    out += [
        f'{k:5d}  {plan.minutes[k]:7.1f}  {plan.sigma[k] * 1e3:13.3f} mm  {plan.within[k]:8.0%}'
        for k in sorted(step for step in steps if step <= most)
    ]
    far = plan.elsewhere[count]
    beyond = f'may still be off by {far * 1e3:.2g} mm' if far < NOTHING_KNOWN else 'is not known'
    out.append(f'elsewhere in its reach the corrected robot {beyond} after {count} poses')
    if not diagnosed:
        out.append(
            'all this is of an arm as its kind usually is: one with rough gears keeps up to six times'
        )
    if plan.needed is None:
        out.append(
            f'all {most} poses that fit into the time keep {wanted} at {plan.within[-1]:.0%} of '
            'postures; more time, less noise or a smaller --spread help'
        )
        return out
    set_up = 'the set-up is as it was recorded' if diagnosed else 'base and tool are found along'
    out.append(f'{count} poses, {plan.minutes[count]:.0f} minutes: {set_up}')
    if plan.within[count] < SURE:
        out.append(
            f'{count} poses keep {wanted} at {plan.within[count]:.0%} of postures; more of them, '
            'less noise or a smaller --spread help'
        )
    return out


def write_plan(folder: Path, context: Context, language: str | None, plan: Planned) -> None:
    """
    Write the stations and the table to fill in, its joints named as in a language.

    The table has the joint angles that are asked for; where the arm stands at others, those count.
    """
    robot = context.robot
    t = plan.minutes[len(plan.q)] * 60.0 / len(plan.q) * np.arange(1.0, len(plan.q) + 1.0)
    motion = {'static': True, 'joint_names': robot.joint_names, 't': t, 'q': plan.q}
    write_joint_motion(folder / STATIONS, motion, 'Stations of a first measurement')
    if context.controller.external:  # an import knows joints by the names of the robot file alone
        plain = replace(context.controller, mix=np.eye(robot.n))
        context, language = context._replace(controller=plain), None
    shown = context.degrees(4)
    units = np.where(robot.prismatic, 'mm', 'deg')
    labels = [
        f'{name} [{unit}]' for name, unit in zip(_labels(robot, language), units, strict=True)
    ]
    point = [f'{axis} [mm]' for axis in 'xyz']
    if set(point) & set(labels):  # slides of a gantry may be called x, y, z, too
        point = [f'measured {name}' for name in point]
    rows = [
        [k, *(f'{value:.4f}' for value in shown.numbers(q, [])), *[''] * len(point)]
        for k, q in enumerate(plan.q, start=1)
    ]
    write_text(folder / TABLE, csv_text(['station', *labels, *point], rows))


def _labels(robot: Robot, language: str | None) -> list[str]:
    if language == 'inform' and robot.n == len(YASKAWA):
        return list(YASKAWA)
    label = LABELS.get(language or '')
    return [label.format(k + 1) for k in range(robot.n)] if label else list(robot.joint_names)
