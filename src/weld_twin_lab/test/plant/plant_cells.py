# Copyright 2026 weld_twin contributors
# SPDX-License-Identifier: Apache-2.0
"""Robots, motions and an independent forward kinematics for the tests of the plant."""

import numpy as np
from scipy.spatial.transform import Rotation

from weld_twin_core.arm.catalog import load
from weld_twin_lab.plant.exponentials import Command
from weld_twin_lab.plant.plant import run
from weld_twin_lab.plant.tracker import Tracker


def rows_of(robot):
    """Return the rows of a bundled arm without its limits, joints named j0 and on."""
    keys = {'a': robot.a, 'alpha': robot.alpha, 'd': robot.d, 'theta_offset': robot.theta}
    rows = [{key: float(value[k]) for key, value in keys.items()} for k in range(robot.n)]
    return [{'name': f'j{k}', **row} for k, row in enumerate(rows)]


# Frames of base and tool are made up, and so is the zero of the last joint.
ARM, PANDA = load('ur5'), rows_of(load('franka_panda'))
UR5 = {
    'name': 'ur5',
    'convention': 'standard',
    'gravity': [0.0, 0.0, -9.80665],
    'base': {'xyz': [0.1, 0.2, 0.3], 'quat_xyzw': [0.0, 0.0, 0.38268343, 0.92387953]},
    'tool': {'xyz': [0.02, 0.0, 0.15], 'quat_xyzw': [0.0, 0.25881905, 0.0, 0.96592583]},
    'joints': [*rows_of(ARM)[:5], {**rows_of(ARM)[5], 'theta_offset': 0.3}],
    'links': ARM.to_mapping()['links'],
    'payload': {'mass': 2.0, 'com': [0.0, 0.01, 0.05]},
}
# The rows of a Panda on a made-up linear track.
TURN = {'a': 0.0, 'alpha': -np.pi / 2.0, 'd': 0.2, 'theta_offset': np.pi / 2.0}
PANDA_ON_TRACK = {
    'name': 'panda_on_track',
    'convention': 'modified',
    'tool': {'xyz': [0.0, 0.0, 0.1], 'quat_xyzw': [0.0, 0.0, -0.38268343, 0.92387953]},
    'joints': [
        {'name': 'track', 'type': 'prismatic', **TURN},
        {**PANDA[0], 'alpha': np.pi / 2.0},
        *PANDA[1:],
    ],
    'links': [
        {'mass': mass, 'com': [0.01, 0.02, -0.05]}
        for mass in (8.0, 4.97, 0.65, 3.23, 3.59, 1.23, 1.67, 0.74)
    ],
}
ROBOTS = {'standard': UR5, 'modified': PANDA_ON_TRACK}
EXACT = Tracker()


def _about(axis, angle):
    turn, (i, j) = np.eye(4), ((1, 2), (2, 0), (0, 1))[axis]
    turn[i, i] = turn[j, j] = np.cos(angle)
    turn[j, i] = np.sin(angle)
    turn[i, j] = -np.sin(angle)
    return turn


def _along(axis, length):
    shift = np.eye(4)
    shift[axis, 3] = length
    return shift


def _pose(entry):
    entry = entry or {}
    pose = np.eye(4)
    pose[:3, :3] = Rotation.from_quat(entry.get('quat_xyzw', [0, 0, 0, 1])).as_matrix()
    pose[:3, 3] = entry.get('xyz', [0, 0, 0])
    return pose


def dh_links(robot, q, built=None):
    """Return the links in the base frame, by 4 x 4 products; built: {joint: {key: error}}."""
    at, out = np.eye(4), []
    for joint, value in zip(robot['joints'], q, strict=True):
        row = {'beta': 0.0, **joint}
        for key, error in (built or {}).get(joint['name'], {}).items():
            row[key] = row[key] + error
        slides = joint.get('type') == 'prismatic'
        theta = row['theta_offset'] + (0.0 if slides else value)
        d = row['d'] + (value if slides else 0.0)
        own, along = _about(2, theta) @ _along(2, d), _along(0, row['a'])
        about = _about(0, row['alpha']) @ _about(1, row['beta'])
        standard = robot['convention'] == 'standard'
        at = at @ (own @ along @ about if standard else about @ along @ own)
        out.append(at)
    return out


def dh_pose(robot, q, built=None):
    """Return the tool in the world, a 4 x 4 matrix."""
    return _pose(robot.get('base')) @ dh_links(robot, q, built)[-1] @ _pose(robot.get('tool'))


def dh_positions(robot, q, built=None):
    """Return tool positions in the world, shape (N, 3) [m]."""
    return np.array([dh_pose(robot, row, built)[:3, 3] for row in q])


def potential(robot, q, payload=None):
    """Return the potential energy of links and payload in the base frame [J]."""
    g = np.array(robot.get('gravity', [0.0, 0.0, -9.80665]))
    frames, energy = dh_links(robot, q), 0.0
    for frame, link in zip(frames, robot['links'], strict=True):
        energy -= link['mass'] * g @ (frame @ [*link['com'], 1.0])[:3]
    tool = frames[-1] @ _pose(robot.get('tool'))
    declared = robot.get('payload', {'mass': 0.0, 'com': [0, 0, 0]})
    for mass, com in ((declared['mass'], declared['com']), payload or (0.0, [0, 0, 0])):
        energy -= mass * g @ (tool @ [*com, 1.0])[:3]
    return energy


def gravity_torque(robot, q, payload=None):
    """Return the torque with which gravity turns each joint, -dV/dq, shape (n,) [N m]."""
    step, out = 1e-5, np.zeros(len(q))
    for i in range(len(q)):
        move = step * np.eye(len(q))[i]
        out[i] = -(potential(robot, q + move, payload) - potential(robot, q - move, payload)) / (
            2.0 * step
        )
    return out


def stations(robot, count, seed=0, **rest):
    """Return scattered poses at rest."""
    q = np.random.default_rng(seed).uniform(-1.2, 1.2, (count, len(robot['joints'])))
    return Command(10.0 * np.arange(count) + 100.0, q, static=True, **rest)


def weave(robot, duration=20.0, rate=125.0, frequency=0.15, reach=0.5, **rest):
    """Return a smooth motion that starts at rest and reverses every joint."""
    t = np.arange(0.0, duration, 1.0 / rate)
    rise = np.clip(t, 0.0, 1.0)
    rise = rise**3 * (10.0 - 15.0 * rise + 6.0 * rise**2)
    count = len(robot['joints'])
    middle = np.resize([0.3, -1.2, 1.4, -1.7, -1.5, 0.2], count)
    tones = frequency * (1.0 + 0.3 * np.arange(count))
    q = middle + reach * rise[:, None] * np.sin(2.0 * np.pi * np.outer(t, tones))
    return Command(t, q, **rest)


def record(robot, effects, command, tracker=EXACT, seed=0, richness=1.0):
    """Run the plant with a seed."""
    return run(robot, effects, command, tracker, np.random.default_rng(seed), richness)


def joint_displacement(robot, effects, command, name, richness=1.0):
    """Return how far one joint is from the command [rad], from the tool's position alone."""
    got = record(robot, effects, command, richness=richness).position
    clean = record(robot, [], command).position
    step = 1e-6
    moved = record(robot, [{'effect': 'joint_offset', 'joint': name, 'offset': step}], command)
    lever = (moved.position - clean) / step
    return np.sum((got - clean) * lever, axis=1) / np.sum(lever**2, axis=1)
