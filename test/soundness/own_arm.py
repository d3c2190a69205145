# Copyright 2026 weld_twin contributors
# SPDX-License-Identifier: Apache-2.0
"""An arm of six axes with a chain of its own, by 4 x 4 matrices, that shares nothing with the twin."""

from dataclasses import dataclass, field, replace

import numpy as np
from scipy.spatial.transform import Rotation

import weld_twin_core as wt

NAMES = ('s', 'l', 'u', 'r', 'b', 't')
A = np.array([0.16, 0.58, 0.13, 0.0, 0.0, 0.0])
D = np.array([0.45, 0.0, 0.0, 0.64, 0.0, 0.11])
ALPHA = np.array([-1, 0, -1, 1, -1, 0]) * np.pi / 2
THETA = np.array([0.0, -np.pi / 2, 0.0, 0.0, 0.0, 0.0])
MIDDLE = np.array([0.1, 0.2, 0.3, -0.2, 0.8, 0.1])


@dataclass(frozen=True)
class Arm:
    """What the arm really is: its constants, and where base and tool are, shape (4, 4)."""

    a: np.ndarray = field(default_factory=A.copy)
    d: np.ndarray = field(default_factory=D.copy)
    alpha: np.ndarray = field(default_factory=ALPHA.copy)
    theta: np.ndarray = field(default_factory=THETA.copy)
    base: np.ndarray = field(default_factory=lambda: np.eye(4))
    tool: np.ndarray = field(default_factory=lambda: np.eye(4))

    def off(self, **errors):
        """Return the same with errors added to some constants, by name and joint."""
        return replace(self, **{k: getattr(self, k) + np.asarray(v) for k, v in errors.items()})

    def reaches(self, q):
        """Return the poses of the tool, shape (M, 4, 4)."""
        T = np.broadcast_to(self.base, (len(q), 4, 4))
        for i in range(6):
            turn = np.tile(np.eye(4), (len(q), 1, 1))
            about = np.outer(q[:, i] + self.theta[i], [0.0, 0.0, 1.0])
            turn[:, :3, :3] = Rotation.from_rotvec(about).as_matrix()
            link = np.eye(4)
            link[:3, :3] = Rotation.from_rotvec([self.alpha[i], 0.0, 0.0]).as_matrix()
            link[:3, 3] = self.a[i], 0.0, self.d[i]
            T = T @ turn @ link
        return T @ self.tool


def frame(xyz, rotvec=(0.0, 0.0, 0.0)):
    """Return a frame, shape (4, 4)."""
    out = np.eye(4)
    out[:3, 3], out[:3, :3] = xyz, Rotation.from_rotvec(rotvec).as_matrix()
    return out


def model():
    """Return the nominal arm as the twin has it."""
    rows = zip(NAMES, A, D, ALPHA, THETA, strict=True)
    keys = ('name', 'a', 'd', 'alpha', 'theta_offset')
    joints = [
        {**dict(zip(keys, row, strict=True)), 'lower': -3.0, 'upper': 3.0, 'max_velocity': 3.0}
        for row in rows
    ]
    return wt.Robot.from_mapping({'name': 'own', 'joints': joints})


def stations(rng, count=40, size=0.7):
    """Return postures spread about the middle, shape (count, 6)."""
    return MIDDLE + rng.uniform(-size, size, (count, 6))


def motion(rate=100.0, seconds=16.0):
    """Return stamps and a brisk motion of all joints."""
    t = np.arange(0.0, seconds, 1.0 / rate)
    pace, phase = np.array([0.9, 0.7, 1.1, 1.3, 0.8, 1.2]), np.arange(6.0)
    return t, MIDDLE + 0.35 * np.sin(pace * t[:, None] + phase)


def measured(arm, t, q, rng, *, noise=3e-5, turns=True, at_rest=True, name='rec', stamps=None):
    """Return a recording with noise of an instrument [m], twice as much in a turn [rad / m]."""
    poses = arm.reaches(q)
    position = poses[:, :3, 3] + noise * rng.standard_normal((len(q), 3))
    small = Rotation.from_rotvec(2.0 * noise * rng.standard_normal((len(q), 3))).as_matrix()
    rotation = small @ poses[:, :3, :3] if turns else None
    seen = wt.Measurements(t if stamps is None else stamps, position, rotation)
    return wt.Recording(name, wt.JointMotion(t, q, static=at_rest), seen)
