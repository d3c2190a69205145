# Copyright 2026 weld_twin contributors
# SPDX-License-Identifier: Apache-2.0
"""
Third-party recordings as a user has them: a robot, and a table.

Arms whose ball rests in one of two sockets have a directory per place, which holds ``hole_0.csv`` and
``hole_1.csv``: a row of joint angles [rad] per posture.

Each directory is named as the data are published; docs/real_arms.md says where they come from. Where
a maker publishes no masses of its links, round figures from the arm's weight stand in.
"""

from __future__ import annotations

import csv
from collections.abc import Iterator, Sequence
from dataclasses import dataclass, replace
from pathlib import Path
from typing import Any

import numpy as np
from numpy.typing import NDArray
from scipy.io import loadmat
from scipy.spatial import cKDTree
from scipy.spatial.transform import Rotation

from weld_twin_core.arm import catalog
from weld_twin_core.arm.robot import Robot
from weld_twin_core.arrays import Array
from weld_twin_core.contacts import Artefact, Contact, Contacts, Tie
from weld_twin_core.errors import DataError
from weld_twin_core.recording import JointMotion, JointSignal, Measurements, Recording
from weld_twin_msgs_py.robots import load_robot
from weld_twin_msgs_py.tables import read_table

from ..blind.scoring import measured_of

Rows = NDArray[Any]
"""Row numbers."""

TABLES = {'ur5': 'grid.csv', 'ur10': 'series_c_random_poses.csv'}
"""What the stations of each arm are in."""
COUNTS = (15, 30, 60, 120, 240)
"""Stations that are fitted on, at random: from hardly enough to plenty."""
LEAST = 15
"""Stations that must remain to fit on; fewer than the unknowns of a plain geometric fit."""
KEPT_BACK = 4
"""One station in so many of a narrow region is kept back, to judge inside the region."""
STILL = np.radians(1.0)
"""Half the range of a joint that stands still [rad]."""
NARROW = np.radians((2.0, 10.0))
"""Half the ranges of joints in a narrow region [rad]."""
OCTANTS = (0, 2, 5, 7)
"""Octants about the middle of the workspace that are fitted on: two pairs of opposite ones."""
FIRST = 0.2
"""Share of the recording that is fitted on where the first part has to predict the rest."""
HOME = {'ur5': 0, 'ur10': 1}
"""Rows before this one are left out: the UR10's first is its home pose, far from the rest."""
TUNED_ON = ('n15', 'n60', 'wrist_10deg', 'still_2', 'octant_0', 'odd')
"""
Kinds of splits, of the UR5 alone, that thresholds of the diagnosis were looked at on.

All others were run without a change that they themselves had asked for.
"""


@dataclass(frozen=True, eq=False)
class Split:
    name: str
    kind: str
    robot: str
    train: Recording
    inside: Recording | None
    """Stations like those fitted on; None where there are none."""
    outside: Recording | None
    """Stations of the rest of the workspace; None where those fitted on are spread over it."""


def all_splits(ur5: Path, ur10: Path) -> Iterator[Split]:
    """Yield the splits of both measured arms; raises DataError where a table is missing or broken."""
    for robot, directory in (('ur5', ur5), ('ur10', ur10)):
        yield from splits(robot, stations(robot, directory), HOME[robot])


def stations(robot: str, directory: Path) -> Recording:
    """Return the stations of one of the two arms, in the order they were measured; or a DataError."""
    return read_table(directory / TABLES[robot], catalog.load(robot)).recording


def splits(robot: str, table: Recording, first: int = 0) -> Iterator[Split]:
    """Yield twenty splits of one arm's stations, in the order they were measured, from the first on."""
    place = measured_of(table).position
    rows = np.arange(first, len(place))
    rng = np.random.default_rng(13)
    for count in COUNTS:
        chosen = np.sort(rng.choice(rows, count, replace=False))
        yield _split(robot, f'n{count}', table, chosen, np.setdiff1d(rows, chosen), None)
    for kind, chosen in _narrow(table, rows):
        if chosen.size >= LEAST:
            fitted, back = kept_back(chosen)
            yield _split(robot, kind, table, fitted, back, np.setdiff1d(rows, chosen))
    cut = int(FIRST * rows.size)
    near = among(place[rows[:cut]], place[rows[cut:]])
    near &= near.sum() >= LEAST  # on a handful nothing can be judged
    far = None if near.all() else rows[cut:][~near]
    yield _split(robot, 'first_fifth', table, rows[:cut], rows[cut:][near], far)
    yield _split(robot, 'odd', table, rows[1::2], rows[0::2], None)
    yield _split(robot, 'even', table, rows[0::2], rows[1::2], None)


def _narrow(table: Recording, rows: Rows) -> Iterator[tuple[str, Rows]]:
    """Yield regions of joint space and of the workspace, each with all its stations."""
    q = table.joints.q[rows]
    last = np.arange(q.shape[1])[-3:]
    for half, joints in ((NARROW[0], last[1:]), (NARROW[1], last[1:]), (NARROW[1], last)):
        name = f'wrist_{round(np.degrees(half))}deg' + ('' if joints.size == 2 else '_three')
        yield name, rows[densest(q[:, joints], half)]
    for joint in range(5):
        yield f'still_{joint + 1}', rows[densest(q[:, [joint]], STILL)]
    octant = octants(measured_of(table).position[rows])
    for number in OCTANTS:
        yield f'octant_{number}', rows[octant == number]


def octants(place: Array) -> NDArray[Any]:
    """Return the numbers, 0 to 7, of the octants about their middle that places (M, 3) lie in, (M,)."""
    return np.asarray((place > np.median(place, axis=0)) @ np.array([4, 2, 1]))


def densest(q: Array, half: float) -> NDArray[np.bool_]:
    """Return which stations lie within ±half of the station that has most of them, (M,)."""
    near = [(np.abs(q - centre).max(axis=1) <= half) for centre in q]
    best: NDArray[np.bool_] = near[int(np.argmax([mask.sum() for mask in near]))]
    return best


def among(fitted: Array, others: Array) -> NDArray[np.bool_]:
    """
    Return which places lie among those fitted: as near to one as the loneliest to its neighbour.

    An arm that visits a grid plane by plane has been nowhere near most of it after a fifth of the
    time; one that visits places at random has been everywhere.

    fitted, others: measured positions of the tool, shape (M, 3) and (K, 3) [m].
    """
    tree = cKDTree(fitted)
    own = tree.query(fitted, k=2)[0][:, 1]
    return np.asarray(tree.query(others)[0] <= own.max())


def kept_back(rows: Rows) -> tuple[Rows, Rows]:
    """Return the rows to fit on, at least `LEAST`, and those kept back, evenly spread."""
    count = min(rows.size // KEPT_BACK, rows.size - LEAST)
    if count <= 0:
        return rows, rows[:0]
    at = np.unique(np.linspace(0, rows.size - 1, count + 2)[1:-1].round().astype(int))
    return np.delete(rows, at), rows[at]


def _split(
    robot: str, kind: str, table: Recording, fitted: Rows, inside: Rows, outside: Rows | None
) -> Split:
    return Split(
        f'{robot}_{kind}',
        kind,
        robot,
        alone(table, fitted),
        alone(table, inside) if inside.size else None,
        None if outside is None else alone(table, outside),
    )


def alone(table: Recording, rows: Rows) -> Recording:
    """Return some rows of a table, with their stamps, as somebody has it who measured no others."""
    joints, effort = table.joints, table.effort
    return replace(
        table,
        joints=JointMotion(joints.t[rows], joints.q[rows], None, joints.static),
        measured=measured_of(table).take(rows),
        effort=None if effort is None else JointSignal(effort.t[rows], effort.value[rows]),
    )


def halves(train: Recording) -> tuple[Recording, Recording]:
    rows = np.arange(measured_of(train).t.size)
    return alone(train, rows[1::2]), alone(train, rows[0::2])


SOCKETS = 0.05
"""Distance of the sockets [m], as their drawing has it."""
CALLIPER = 1e-4
"""Its uncertainty [m]: what a calliper tells of a printed part."""
ARMS = {
    'panda_1': ('panda_nominal.urdf', 'panda_link0', 'ball_link'),
    'panda_2': ('panda_nominal.urdf', 'panda_link0', 'ball_link'),
    'kuka_14': ('kuka_iiwa14', None, None),
}
"""Robot file in the data's directory, or bundled robot, and its ends."""
HALF_PI = float(np.pi / 2.0)
"""A right angle [rad]."""
LEAN = float(np.radians(15.0))
"""Lean of the S axes of the two-armed Motoman to either side [rad]."""
GRAVITY = 9.80665
"""Acceleration of gravity [m/s^2]."""
POINTS_HZ = 10.0
"""Rate at which the tracker of the swinging UR5 measures."""
FIRST_POINT = -0.063
"""Time of its first point on the joints' clock [s], as published."""


@dataclass(frozen=True, eq=False)
class Source:
    robot: Robot
    """The nominal model."""
    recording: Recording
    """Everything that was recorded of it."""
    align: tuple[str, ...] = ('base', 'tool')
    """Frames that are not known."""


def tracked(data: Path, name: str) -> Source:
    """Return one of the two arms under a laser tracker."""
    robot = name.partition('_')[0]
    recording = stations(robot, data / name)
    rows = np.arange(HOME[robot], measured_of(recording).t.size)
    return Source(catalog.load(robot), replace(alone(recording, rows), name=name))


def servo(data: Path) -> Source:
    """Return a servo axis: reference, and what was measured along it, zero across; raises DataError."""
    path = data / 'emps' / 'DATA_EMPS.mat'
    if not path.is_file():
        raise DataError(f"'{path}' is missing; docs/transfer.md says where the data come from")
    try:
        content = loadmat(path)
        t, wanted, measured = (np.ravel(content[key]) for key in ('t', 'qg', 'qm'))
    except (KeyError, ValueError, NotImplementedError, OSError) as error:
        raise DataError(f"'{path}' is not the recording of the servo axis: {error}") from None
    position = np.zeros((t.size, 3))
    position[:, 2] = measured
    joint = {'name': 'axis', 'type': 'prismatic'}
    return Source(
        Robot.from_mapping({'name': 'servo axis', 'joints': [joint]}),
        Recording('servo axis', JointMotion(t, wanted[:, None]), Measurements(t, position)),
        (),
    )


def sockets(data: Path, arm: str) -> Source:
    """Return an arm whose ball rested in sockets, at all its places."""
    here = data / 'mukca'
    recording = touches(here, arm, places_of(here, arm))
    return Source(socket_robot(here, arm), recording, align=('tool',))


def socket_robot(data: Path, arm: str) -> Robot:
    """Return the nominal robot of one of `ARMS`."""
    spec, base, tip = ARMS[arm]
    return load_robot(data / spec if spec.endswith('.urdf') else spec, base, tip)


def places_of(data: Path, arm: str) -> tuple[str, ...]:
    """Return the places where an arm was measured, by name; raises DataError where there are none."""
    folder = data / arm
    places = sorted(item.name for item in folder.glob('*') if (item / 'hole_0.csv').is_file())
    if not places:
        raise DataError(f"'{folder}' holds no place with hole_0.csv; --data names its parent")
    return tuple(places)


def touches(data: Path, arm: str, places: Sequence[str]) -> Recording:
    postures = {
        f'{place}/{socket}': np.loadtxt(
            data / arm / place / f'hole_{socket}.csv', delimiter=',', ndmin=2
        )
        for place in places
        for socket in (0, 1)
    }
    ties = tuple(Tie((f'{place}/0', f'{place}/1'), SOCKETS, CALLIPER) for place in places)
    labels = tuple(name for name, rows in postures.items() for _ in rows)
    q = np.concatenate(list(postures.values()))
    touched = Contacts(Artefact(tuple(map(Contact, postures)), ties), labels)
    motion = JointMotion(np.arange(float(len(q))), q, static=True)
    return Recording(arm, motion, contacts=touched)


def positioner(data: Path) -> Source:
    """Return a two-axis positioner under a fixed camera."""
    rows = _table(data / 'positioner' / 'measurements.csv')
    joints = [_row('tilt', 0.0, 0.0, -HALF_PI, 0.0), _row('turn', 0.0, -0.475, 0.0, -HALF_PI)]
    q = np.stack([rows['tilt [rad]'], rows['turn [rad]']], axis=1)
    robot = Robot.from_mapping({'name': 'positioner', 'joints': joints})
    return Source(robot, _stations('positioner', q, rows, rows['time [s]']))


def iiwa(data: Path) -> Source:
    """Return the seven-axis arm without load; what moves it is the load of its own links."""
    rows = _table(data / 'iiwa7_0kg' / 'stations.csv')
    lengths, twists = (0.34, 0.0, 0.4, 0.0, 0.4, 0.0, 0.126), (-1, 1, 1, -1, -1, 1, 0)
    names = [f'joint_{k + 1}' for k in range(7)]
    joints = [
        _row(name, 0.0, d, sign * HALF_PI, 0.0)
        for name, d, sign in zip(names, lengths, twists, strict=True)
    ]
    masses = (2.7, 2.7, 2.7, 2.7, 1.7, 1.6, 1.4)
    # Centres are those of the larger arm of the same make, in frames of other twists: near the axes.
    links = [{'mass': m, 'com': [0.0, 0.0, 0.0]} for m in masses]
    robot = Robot.from_mapping({'name': 'iiwa7', 'joints': joints, 'links': links})
    q = np.stack([rows[f'{name} [rad]'] for name in names], axis=1)
    return Source(robot, _stations('iiwa7', q, rows, None))


def motoman(data: Path, *, masses: bool) -> Source:
    """Return the left welding arm of two on one base, under a tracker."""
    with (data / 'motoman_left' / 'left_hand.csv').open(newline='') as stream:
        lines = {row['pose']: row for row in csv.DictReader(stream) if row['leica_x [m]']}
    names = [f'left_{k}' for k in 'SLURBT']
    q = np.array([[float(row[f'{name} [rad]']) for name in names] for row in lines.values()])
    place = np.array(
        [[float(row[f'leica_{k} [m]']) for k in 'xyz'] for row in lines.values()], dtype=np.float64
    )
    table = (
        (0.15, 1.4159, -HALF_PI, 0.0),
        (0.614, 0.0, np.pi, -HALF_PI),
        (0.2, 0.0, -HALF_PI, 0.0),
        (0.0, -0.64, HALF_PI, 0.0),
        (0.03, 0.0, HALF_PI, -HALF_PI),
        (0.0, 0.2, 0.0, 0.0),
    )
    mapping: dict[str, Any] = {
        'name': 'ma1400',
        'joints': [_row(name, *row) for name, row in zip(names, table, strict=True)],
        # The S axis leans to one side of the plumb line; turns about it are the base's.
        'gravity': [0.0, GRAVITY * float(np.sin(LEAN)), -GRAVITY * float(np.cos(LEAN))],
    }
    if masses:  # of 130 kg that the whole arm weighs
        each = ((50.0, -0.1), (25.0, -0.3), (30.0, -0.05), (15.0, 0.0), (4.0, 0.0), (3.0, 0.0))
        mapping['links'] = [{'mass': m, 'com': [x, 0.0, 0.0]} for m, x in each]
    t = np.arange(float(len(q)))
    motion = JointMotion(t, q, static=True)
    return Source(
        Robot.from_mapping(mapping), Recording('motoman', motion, Measurements(t, place))
    )


def swinging(data: Path) -> Source:
    """Return the UR5 that swings under a tracker, its points counted evenly as they were measured."""
    here = data / 'ur5_bursts'
    joints, points = _table(here / 'joints.csv'), _table(here / 'points.csv')
    names = [name for name in joints if name.endswith('joint [rad]')]
    robot = catalog.load('ur5')
    q = np.stack([joints[name] for name in names], axis=1)
    motion = JointMotion(joints['stamp [s]'], q)
    place = np.stack([points[f'{k} [m]'] for k in 'xyz'], axis=1)
    t = FIRST_POINT + np.arange(len(place)) / POINTS_HZ
    inside = (t >= motion.t[0]) & (t <= motion.t[-1])
    return Source(robot, Recording('swinging', motion, Measurements(t[inside], place[inside])))


def _stations(name: str, q: Array, rows: dict[str, Array], t: Array | None) -> Recording:
    place = np.stack([rows[f'{k} [m]'] for k in 'xyz'], axis=1)
    turn = Rotation.from_quat(np.stack([rows[f'q{k}'] for k in 'xyzw'], axis=1)).as_matrix()
    t = np.arange(float(len(q))) if t is None else t
    return Recording(name, JointMotion(t, q, static=True), Measurements(t, place, turn))


def _row(name: str, a: float, d: float, alpha: float, theta: float) -> dict[str, Any]:
    return {'name': name, 'a': a, 'd': d, 'alpha': alpha, 'theta_offset': theta}


def _table(path: Path) -> dict[str, Array]:
    if not path.is_file():
        raise DataError(f"'{path}' is missing; docs/real_arms.md says where the data come from")
    with path.open(newline='') as stream:
        lines = list(csv.reader(stream))
    values = np.array([[float(cell) for cell in line] for line in lines[1:]])
    return {head.strip(): values[:, k] for k, head in enumerate(lines[0])}
