# Copyright 2026 weld_twin contributors
# SPDX-License-Identifier: Apache-2.0
"""
A pedestal that leans: two more hinges under the arm's tree, each on a spring.

The arm stands on a body that can turn about the base's x, then about its y. MuJoCo tells what
weighs on these hinges, and the lean is where springs and weights are in balance, at the posture
leaned already. Springs harden, and a moving arm shakes its pedestal as well: both by the richness.
"""

from functools import cached_property

import mujoco
import numpy as np
from scipy.interpolate import CubicSpline

from . import exponentials, mujoco_model, screws
from .compliance import HARDENING, Compliant
from .screws import Motion
from .textbook_effects import Causes

ROUNDS = 4
"""Times that the balance is sought anew; each takes away all but a thousandth."""
COARSE = 0.02
"""Spacing [s] at which the lean is computed; it changes with the posture, which is slow."""


class Pedestal:
    """
    The springs under an arm.

    parts: the arm with its load.
    """

    def __init__(self, parts: Compliant, causes: Causes) -> None:
        self.parts = parts
        self.compliance = causes.total('pedestal_tilt', 'compliance', 2)

    @property
    def stiff(self) -> bool:
        """Whether nothing leans."""
        return not self.compliance.any()

    def at_rest(self, q: np.ndarray, wrench: np.ndarray | None) -> Motion:
        """Return how the base has turned at postures (N, n), in its own frame."""
        return _turned(self._balance(q, wrench, np.zeros((len(q), 2))))

    def moving(
        self, grid: np.ndarray, motor: CubicSpline, wrench: np.ndarray | None, t: np.ndarray
    ) -> Motion:
        """
        Return how the base of a moving arm has turned, in its own frame.

        grid: evenly spaced, shape (N,) [s]; wrenches are given there.
        motor: joint positions over time.
        wrench: shape (N, 6).
        t: when the lean is wanted, shape (M,) [s].
        """
        coarse = np.arange(0, len(grid), max(1, round(COARSE / float(grid[1] - grid[0]))))
        at = grid[coarse]
        q, qd, qdd = (_under(motor(at, order)) for order in range(3))
        shaken = -self.parts.richness * self._statics.drive_torque(q, qd, qdd)[:, :2]
        load = None if wrench is None else wrench[coarse]
        return _turned(CubicSpline(at, self._balance(q[:, 2:], load, shaken))(t))

    @cached_property
    def _statics(self) -> mujoco_model.Statics:
        return mujoco_model.Statics(self._model())

    def _model(self) -> mujoco.MjModel:
        parts, spec = self.parts, mujoco.MjSpec()
        foot = spec.worldbody.add_body(name='pedestal')
        mujoco_model.weigh(foot, mujoco_model.MASSLESS, np.zeros(3), 1e-9)
        for name, axis in (('x', [1, 0, 0]), ('y', [0, 1, 0])):
            foot.add_joint(name=name, type=mujoco.mjtJoint.mjJNT_HINGE, axis=axis)
        at = exponentials.home(parts.arm)
        links = mujoco_model.add_links(spec, parts.robot, parts.arm, parts.load, foot)
        for i, body in enumerate(links):
            mujoco_model.add_hinge(body, parts.arm, at, i, f'joint{i}')
        return spec.compile()

    def _balance(self, q: np.ndarray, wrench: np.ndarray | None, shaken: np.ndarray) -> np.ndarray:
        """Return the lean about x and y, shape (N, 2) [rad]."""
        lean = np.zeros((len(q), 2))
        for _ in range(ROUNDS):
            moment = self._statics.torque(np.hstack([lean, q]), wrench)[:, :2] + shaken
            peak = np.abs(self.compliance * moment).max(axis=0) + 1e-15
            gain = HARDENING * self.parts.richness
            lean = self.compliance * moment / (1.0 - 0.5 * gain + gain * (lean / peak) ** 2)
        return lean


def _under(q: np.ndarray) -> np.ndarray:
    """Return joint values with two hinges under them that stand still, shape (N, 2 + n)."""
    return np.hstack([np.zeros((len(q), 2)), q])


def _turned(lean: np.ndarray) -> Motion:
    return screws.compose(screws.turn('x', lean[:, 0]), screws.turn('y', lean[:, 1]))
