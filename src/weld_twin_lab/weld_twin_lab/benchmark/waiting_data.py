# Copyright 2026 weld_twin contributors
# SPDX-License-Identifier: Apache-2.0
"""The recordings and tables that waits are measured on, made once."""

from __future__ import annotations

from collections.abc import Callable, Iterator
from datetime import datetime, timedelta, timezone
from functools import partial
from pathlib import Path
from typing import TYPE_CHECKING

import numpy as np

from weld_twin_core.arm import catalog
from weld_twin_core.arm.catalog import load
from weld_twin_core.arm.robot import Robot
from weld_twin_core.arrays import Array
from weld_twin_core.effects import Backlash, JointOffset, LinkLength, TransmissionRipple
from weld_twin_core.effects.effect import Effect
from weld_twin_core.recording import JointMotion, Measurements, Recording
from weld_twin_core.twin.twin import Twin
from weld_twin_msgs_py.bags import write_recording
from weld_twin_report.history import Database, Entry

from .race import smooth_motion

if TYPE_CHECKING:
    from sqlalchemy import Connection

DRIFTING = (
    'joint_offset',
    'link_length',
    'link_offset',
    'link_twist',
    'joint_compliance',
    'backlash',
)
SCALES = (2e-4, 5e-5, 5e-5, 2e-4, 2e-6, 1e-4)
"""Standard errors of the families' values, SI units."""
FIRST = datetime(2025, 1, 6, 8, tzinfo=timezone.utc)
"""When the first diagnosis of every cell is of: a Monday."""
WORN = 4
"""Every so many cells has an elbow that wears, and one whose zero has stepped."""


def fill(database: Database, cells: int, diagnoses: int, seed: int = 1) -> None:
    def work(connection: Connection) -> None:
        for number in range(cells):
            for entry in drawn(number, diagnoses, seed):
                database.put(connection, f'line {number + 1:03d}', entry)

    database.write(work)


def drawn(number: int, diagnoses: int, seed: int = 1) -> Iterator[Entry]:
    rng = np.random.default_rng([seed, number])
    joints = catalog.load('ur5').joint_names
    names = tuple(f'{family} {joint} 0' for family in DRIFTING for joint in joints)
    sigma = np.repeat(SCALES, len(joints))
    mixed = rng.normal(size=(3 * len(names), len(names)))
    covariance = np.linalg.inv(mixed.T @ mixed / len(mixed) + 0.1 * np.eye(len(names)))
    covariance *= np.outer(sigma, sigma) / np.mean(np.diag(covariance))
    root = np.linalg.cholesky(covariance)
    play, zero = names.index('backlash elbow_joint 0'), names.index('joint_offset elbow_joint 0')
    for week in range(diagnoses):
        value = root @ rng.normal(size=len(names))
        value[play] += 6e-4 + (2e-5 * week if number % WORN == 0 else 0.0)
        value[zero] += 3e-3 * (number % WORN == 1 and week >= diagnoses // 2)
        width = float(value[play])
        gap = 1e-4 + 0.2 * abs(width) + abs(value[zero]) * 0.1
        effect = {
            'effect': 'backlash',
            'joint': 'elbow_joint',
            'parameters': {'width': width},
            'std': {'width': float(sigma[play])},
        }
        yield Entry(
            FIRST + timedelta(weeks=week),
            'ur5',
            'made up',
            f'{number:08d}{week:08d}',
            'identified',
            float(rng.uniform(0.8, 0.99)),
            float(gap * rng.uniform(0.9, 1.1)),
            2e-5,
            float(2e-5 * rng.uniform(1.0, 1.3)),
            [effect],
            names,
            value,
            10.0 * sigma,
            covariance,
            np.eye(4),
        )


JOINT_RATE, POSE_RATE = 125.0, 60.0
"""Hz: those of a UR controller and of a camera system."""
NOISE, TURN_NOISE = 2e-5, 5e-5
"""Of a laser tracker with a probe [m, rad]."""
PLANT = 200, 50
"""Cells of a plant, and diagnoses of each."""
STATIONS, ROWS = 2772, 100_000
"""Stations of a long calibration, and rows of a long table."""


def made(name: str, folder: Path) -> Path:
    """Return where data of one of `MAKERS` are, made where they are not there yet."""
    place = folder / ('table.csv' if name == 'table' else name)
    if not place.exists():
        MAKERS[name](place)
    return place


def moving(seconds: float) -> Recording:
    """Return a UR5 with play in its elbow, followed by a camera system for so long [s]."""
    robot = load('ur5')
    t = np.arange(round(seconds * JOINT_RATE) + 1) / JOINT_RATE
    at = 0.003 + np.arange(round(seconds * POSE_RATE)) / POSE_RATE
    at = at[at < t[-1]]
    way = smooth_motion(robot, 2)[0] + 0.3 * np.sin(t[:, None] * np.arange(1.0, 7.0) / 5.0)
    commanded = Recording('motion', JointMotion(t, way))
    play = Backlash('elbow_joint', width=5e-4)
    return seen(commanded, robot, [play], at)


def seen(commanded: Recording, robot: Robot, effects: list[Effect], at: Array) -> Recording:
    """Return a recording with what a twin with effects and noise would measure at times (M,) [s]."""
    rng = np.random.default_rng(7)
    poses = Twin(robot, effects).poses(commanded, at)
    position = poses.position + rng.normal(scale=NOISE, size=poses.position.shape)
    tilt = rng.normal(scale=TURN_NOISE, size=(at.size, 3))
    skew = np.cross(np.eye(3), tilt[:, None, :])
    turned, _ = np.linalg.qr(poses.rotation @ (np.eye(3) + skew))
    sign = np.sign((turned * poses.rotation).sum(axis=1, keepdims=True))
    return commanded.with_measured(Measurements(at, position, turned * sign))


def stations(count: int) -> Recording:
    robot, rng = load('ur10'), np.random.default_rng(11)
    t = np.arange(float(count))
    q = rng.uniform(-2.5, 2.5, (count, robot.n))
    orders = np.array([1.0, 2.0, 3.0, 5.0, 8.0, 13.0])
    effects: list[Effect] = [
        LinkLength('shoulder_lift_joint', da=2e-4),
        *(JointOffset(name, offset=rng.normal(scale=3e-4)) for name in robot.joint_names),
        *(
            TransmissionRipple(name, 1e-4 / np.sqrt(orders), orders, rng.uniform(0.0, 6.0, 6))
            for name in robot.joint_names
        ),
    ]
    commanded = Recording('stations', JointMotion(t, q, static=True))
    return seen(commanded, robot, effects, t)


def _table(place: Path) -> None:
    robot, rng = load('ur5'), np.random.default_rng(13)
    q = rng.uniform(-2.5, 2.5, (ROWS, robot.n))
    commanded = Recording('table', JointMotion(np.arange(float(ROWS)), q, static=True))
    position = Twin(robot).poses(commanded).position * 1e3
    head = ','.join([*robot.joint_names, 'x_mm', 'y_mm', 'z_mm'])
    rows = np.column_stack([np.degrees(q), position])
    np.savetxt(place, rows, delimiter=',', header=head, comments='', fmt='%.6f')


def _plant(place: Path) -> None:
    from weld_twin_report.history import Database

    place.mkdir()
    database = Database(str(place / 'plant.db'))
    fill(database, *PLANT)
    database.close()


def _moving(seconds: float, place: Path) -> None:
    write_recording(place, moving(seconds), load('ur5'))


MAKERS: dict[str, Callable[[Path], None]] = {
    'plant': _plant,
    'motion': partial(_moving, 60.0),
    'minutes': partial(_moving, 600.0),
    'hour': partial(_moving, 3600.0),
    'stations': lambda place: write_recording(place, stations(STATIONS), load('ur10')),
    'table': _table,
}
"""What makes the data of a name at a place."""
