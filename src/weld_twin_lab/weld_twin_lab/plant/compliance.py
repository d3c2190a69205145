# Copyright 2026 weld_twin contributors
# SPDX-License-Identifier: Apache-2.0
"""
What gives between motors and links, at rest: gear play and joint springs.

A spring is in equilibrium with the load torque of the pose it sags to; gravity pulls the link
down, so a positive compliance sags. A gap follows the textbook play. The same arm in motion is
in `tree`.
"""

from functools import cached_property

import numpy as np

from . import mujoco_model
from .exponentials import Arm
from .plant_recording import Entry
from .textbook_effects import Causes

HARDENING = 0.03
"""Share of a spring's stiffness gained from no load to the rated one."""
RATING_POSES = 200
"""Poses drawn to find the largest load torque, which the rated load is."""


class Compliant:
    """
    The joints that give.

    robot: the robot file.
    """

    def __init__(self, robot: Entry, arm: Arm, causes: Causes, richness: float) -> None:
        extra = [
            (float(item['mass']), np.array(item.get('com', [0.0] * 3), dtype=float))
            for item in causes.of('payload')
        ]
        self.robot, self.arm, self.richness = robot, arm, richness
        self.load = mujoco_model.load_from(robot, extra)
        self.width = causes.per_joint('backlash', 'width')
        self.compliance = causes.per_joint('joint_compliance', 'compliance')

    @cached_property
    def statics(self) -> mujoco_model.Statics:
        """The rigid arm; built only when a torque is asked for."""
        return mujoco_model.Statics(mujoco_model.rigid(self.robot, self.arm, self.load))

    @cached_property
    def rated(self) -> np.ndarray:
        """Return the largest load torque over poses of the whole range, shape (n,) [N m]."""
        poses = np.random.default_rng(0).uniform(-np.pi, np.pi, (RATING_POSES, len(self.width)))
        torque = self.torque(np.where(self.arm.sliding, 0.0, poses), None)
        return np.asarray(np.abs(torque).max(axis=0))

    def stiffening(self, deflection: np.ndarray, peak: np.ndarray) -> np.ndarray:
        """Return stiffness over the stated one: softer at no load, harder at the peak."""
        gain = HARDENING * self.richness
        return np.asarray(1.0 - 0.5 * gain + gain * (deflection / peak) ** 2)

    @property
    def rigid(self) -> bool:
        """Whether nothing gives."""
        return not (self.width.any() or self.compliance.any())

    def torque(self, q: np.ndarray, wrench: np.ndarray | None) -> np.ndarray:
        """Return the load torque on the joints at rest, shape (N, n) [N m]."""
        return self.statics.torque(q, wrench)

    def sag(self, q: np.ndarray, wrench: np.ndarray | None) -> np.ndarray:
        """Return the deflection of the springs in equilibrium, shape (N, n) [rad or m]."""
        give = np.zeros_like(q)
        if not self.compliance.any():
            return give
        tau = self.torque(q, wrench)
        peak = self.compliance * np.maximum(self.rated, np.abs(tau).max(axis=0)) + 1e-12
        for _ in range(4):
            give = self.compliance * tau / self.stiffening(give, peak)
            tau = self.torque(q + give, wrench)
        return give

    def play(self, q: np.ndarray) -> np.ndarray:
        """Return the textbook play of the gaps over a sequence, centred at first, (N, n)."""
        half = 0.5 * self.width
        link = q[0].copy()
        out = np.empty_like(q)
        for k, row in enumerate(q):
            link = np.clip(link, row - half, row + half)
            out[k] = link - row
        return out

    def at_rest(self, q: np.ndarray, wrench: np.ndarray | None) -> np.ndarray:
        """Return gaps and springs over a sequence of poses at rest, shape (N, n)."""
        gap = self.play(q)
        return np.asarray(gap + self.sag(q + gap, wrench))
