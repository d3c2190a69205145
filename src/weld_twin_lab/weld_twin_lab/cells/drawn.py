# Copyright 2026 weld_twin contributors
# SPDX-License-Identifier: Apache-2.0
"""Cells drawn at random: an arm, a cell with track and positioner, two arms; and their postures."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from typing import Any

import numpy as np

from weld_twin_core.arm import catalog
from weld_twin_core.arm.robot import Robot
from weld_twin_core.arrays import Array

from ..blind.cause_sizes import Cause
from ..plant.plant import run
from ..plant.plant_recording import Command
from ..plant.screws import Motion, compose, from_quaternion, inverse
from ..plant.tracker import Tracker

KINDS = ('arm', 'track and positioner', 'two arms')
ARMS = ('ur5', 'ur10', 'kuka_iiwa14')
"""Arms of standard rows of which link masses are known, so that springs can act."""
QUARTER = float(np.sqrt(0.5))
"""Sine of half a right angle."""
RAIL = {'name': 'rail', 'type': 'prismatic', 'alpha': -np.pi / 2, 'lower': -1.5, 'upper': 1.5}
ALONG = {'xyz': [0.0, 0.0, 0.3], 'quat_xyzw': [0.5, 0.5, 0.5, 0.5]}
"""Foot of a rail that runs along x and carries an upright arm."""
TABLE: dict[str, Any] = {
    'base': {'xyz': [0.2, 1.1, 0.6], 'quat_xyzw': [0.0, QUARTER, 0.0, QUARTER]},
    'tool': {'xyz': [0.1, 0.05, 0.1]},
    'joints': [
        {'name': 'tilt', 'a': 0.05, 'd': 0.2, 'alpha': -np.pi / 2, 'lower': -1.5, 'upper': 1.5},
        {'name': 'turn', 'd': 0.15, 'lower': -3.1, 'upper': 3.1},
    ],
    'links': [{'mass': 120.0, 'com': [0.05, 0.0, 0.0]}, {'mass': 60.0, 'com': [0.05, 0.0, 0.0]}],
}
"""A positioner that tilts about a level axis and turns."""
SWING = 1.1
"""How far [rad] joints of an arm move to either side of a posture with a bent elbow."""
READY = (0.3, -1.2, 1.3, 0.4, 1.0, 0.2, 0.3)
"""That posture [rad]."""


def cell(kind: str, seed: int) -> dict[str, Any]:
    """
    Return the robot file of a cell.

    kind: one of `KINDS`.
    seed: decides which arms.
    """
    arm = catalog.load(ARMS[seed % len(ARMS)]).to_mapping()
    arm['tool'] = {'xyz': [0.02, -0.03, 0.15]}
    if kind == 'track and positioner':
        links = [{'mass': 200.0, 'com': [0.0, 0.0, 0.0]}, *arm['links']]
        return {
            **arm,
            'base': ALONG,
            'joints': [RAIL, *arm['joints']],
            'links': links,
            'workpiece': TABLE,
        }
    if kind == 'two arms':
        other = catalog.load(ARMS[(seed + 1) % len(ARMS)]).to_mapping()
        joints = [{**joint, 'name': f'left_{joint["name"]}'} for joint in other['joints']]
        tool = {'xyz': [0.0, 0.02, 0.12]}
        base = {'xyz': [0.2, 1.3, 0.0]}
        second = {'base': base, 'tool': tool, 'joints': joints, 'links': other['links']}
        return {**arm, 'workpiece': second}
    return arm


def postures(robot: Robot, count: int, rng: np.random.Generator, swing: float = SWING) -> Array:
    """Return postures, shape (M, n) [rad or m]: arms about `READY`, all else wherever it reaches."""
    low, high = np.empty(robot.n), np.empty(robot.n)
    at = 0
    for k in _outwards(robot):
        if robot.joint_names[k] in ('rail', 'tilt', 'turn'):
            low[k], high[k] = robot.lower[k], robot.upper[k]
            continue
        ready = READY[at % len(READY)]
        low[k] = max(ready - swing, robot.lower[k])
        high[k] = min(ready + swing, robot.upper[k])
        at += 1
    return np.asarray(rng.uniform(low, high, (count, robot.n)))


def _outwards(robot: Robot) -> list[int]:
    """Return the joints from the foot of each branch to its end."""
    return [*range(robot.behind)[::-1], *range(robot.behind, robot.n)]


def really(
    data: Mapping[str, Any],
    names: Sequence[str],
    causes: Sequence[Cause],
    q: Array,
    rng: np.random.Generator,
) -> Motion:
    """
    Return the torch as the plant has it, seen from the workpiece where there is one.

    data: the robot file.
    names: joints in the order of ``q``.
    causes: what is wrong, each with the joint that it is of.
    q: shape (M, n) [rad or m].
    """
    arm = {key: value for key, value in data.items() if key != 'workpiece'}
    torch = _branch(arm, names, causes, q, rng)
    if 'workpiece' not in data:
        return torch
    foot = {'name': 'workpiece', 'gravity': data['gravity'], **data['workpiece']}
    return compose(inverse(_branch(foot, names, causes, q, rng)), torch)


def _branch(
    data: dict[str, Any],
    names: Sequence[str],
    causes: Sequence[Cause],
    q: Array,
    rng: np.random.Generator,
) -> Motion:
    own = [joint['name'] for joint in data['joints']]
    columns = [list(names).index(name) for name in own]
    here = [cause for cause in causes if cause.get('joint', own[0]) in own]
    command = Command(1.0 + np.arange(float(len(q))), q[:, columns], static=True)
    made = run(data, here, command, Tracker(), rng)
    assert made.quaternion is not None
    return from_quaternion(made.quaternion, made.position)
