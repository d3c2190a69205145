# Copyright 2026 weld_twin contributors
# SPDX-License-Identifier: Apache-2.0
"""Small cells: a robot that follows a motion, measured by an instrument that stands anywhere."""

from dataclasses import replace

import numpy as np

from weld_twin_core import JointMotion, Measurements, Recording, Twin
from weld_twin_core.arm.rotation import rotation_matrix, transform
from weld_twin_core.diagnosis.algebra.problem import Model, Problem


def moving(robot, rng, seconds=20.0, rate=125.0, size=0.4):
    """Return a smooth motion of all joints from rest, around the middle of the workspace."""
    t = np.arange(0.0, seconds, 1.0 / rate)
    middle = np.clip(rng.uniform(-1.0, 1.0, robot.n), robot.lower + 0.5, robot.upper - 0.5)
    frequency = rng.uniform(0.1, 0.35, (3, robot.n))
    phase = rng.uniform(0.0, 2.0 * np.pi, (3, robot.n))
    waves = np.sin(2.0 * np.pi * frequency * t[:, None, None] + phase).sum(axis=1) / 2.0
    waves *= (1.0 - np.exp(-((t / 1.0) ** 3)))[:, None]
    q = np.clip(middle + size * waves, robot.lower, robot.upper)
    return JointMotion(t, q)


def stations(robot, rng, count=120, size=1.0):
    """Return stations at rest, spread about the middle of the joint range."""
    middle = np.clip(np.zeros(robot.n), robot.lower + size, robot.upper - size)
    q = middle + rng.uniform(-size, size, (count, robot.n))
    return JointMotion(np.arange(float(count)), np.clip(q, robot.lower, robot.upper), static=True)


def anywhere(rng, reach):
    """Return a frame turned at random and up to a reach away."""
    return transform(rotation_matrix(rng.normal(size=3) * 3.0), rng.uniform(-reach, reach, 3))


def recorded(robot, motion, rng, effects=(), sigma=2e-5, points=False, rate=60.0, name='run'):
    """Return a recording of a robot with effects, measured with white noise."""
    t = motion.t
    if not motion.static:
        t = np.arange(motion.t[0] + 0.004, motion.t[-1], 1.0 / rate)
    poses = Twin(robot, effects).poses(Recording(name, motion), t)
    noise = rng.normal(size=(2, *poses.position.shape)) * sigma
    position, turn = poses.position + noise[0], rotation_matrix(2.0 * noise[1])
    measured = Measurements(t, position, None if points else turn @ poses.rotation)
    return Recording(name, motion, measured)


def asked(robot, *recordings, align=('base', 'tool')):
    """Return the problem and the nominal model of it."""
    problem = Problem(tuple(recordings), frozenset(align))
    return problem, Model(robot, tuple(robot.T_world_base for _ in recordings))


def remeasured(recording, **fields):
    """Return the recording with other fields of its measurements."""
    return recording.with_measured(replace(recording.measured, **fields))


def rejointed(recording, q):
    """Return the recording with other joint positions."""
    return replace(recording, joints=replace(recording.joints, q=q))
