# Copyright 2026 weld_twin contributors
# SPDX-License-Identifier: Apache-2.0
"""
What gives between motors and links, at rest: gear play and joint springs.

A spring is in equilibrium with the load torque of the pose it sags to; gravity pulls the link
down, so a positive compliance sags. A gap follows the textbook play. The same arm in motion is
in `tree`.

A hose goes straight from its hook, fixed to the base, to the flange. Its balancer gives it the stated
tension at the stated length, and a little more where it is drawn out further. Half of its own weight
hangs at the flange.

A pedestal can turn about the base's x, then about its y, on two springs. MuJoCo tells what weighs on
these hinges, and the lean is where springs and weights are in balance, at the posture leaned already.
Springs harden, and a moving arm shakes its pedestal as well: both by the richness.
"""

from functools import cached_property

import numpy as np
from scipy.interpolate import CubicSpline

from . import exponentials, mujoco_model
from .exponentials import Arm, Entry, Motion
from .flaws import Causes

HARDENING = 0.03
"""Share of a spring's stiffness gained from no load to the rated one."""
RATING_POSES = 200
"""Poses drawn to find the largest load torque, which the rated load is."""


class Compliant:
    """The joints of a robot file that give."""

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


STRETCH = 0.5
"""Share by which the tension grows when the hose is twice as long: balancers keep it steady."""
WEIGHT = 0.2
"""Weight of half the hose over its tension."""


def pull(causes: Causes, arm: Arm, q: np.ndarray) -> np.ndarray | None:
    """Return the pull of the hoses as a wrench on the tool, tool frame, (N, 6) [N, N m], or None."""
    hoses = list(causes.of('hose_pull'))
    if not hoses:
        return None
    flange = exponentials.flange(arm, exponentials.home(arm), q)
    force = np.zeros((len(q), 3))
    for item in hoses:
        way = np.asarray(item['hook'], dtype=float) - flange.position
        far = np.linalg.norm(way, axis=1, keepdims=True)
        share = 1.0 + STRETCH * (far / float(item['length']) - 1.0)
        force += float(item['tension']) * share * way / far
        force[:, 2] -= WEIGHT * float(item['tension'])
    tool = exponentials.compose(flange, arm.tool)
    moment = np.cross(flange.position - tool.position, force)
    return np.hstack([np.einsum('nji,nj->ni', tool.rotation, part) for part in (force, moment)])


def with_hoses(
    causes: Causes, arm: Arm, q: np.ndarray, wrench: np.ndarray | None
) -> np.ndarray | None:
    """Return a wrench on the tool, (N, 6) or None, with what the hoses add to it."""
    more = pull(causes, arm, q)
    if more is None:
        return wrench
    return more if wrench is None else wrench + more


ROUNDS = 4
"""Times that the balance is sought anew; each takes away all but a thousandth."""
COARSE = 0.02
"""Spacing [s] at which the lean is computed; it changes with the posture, which is slow."""


class Pedestal:
    """The springs under an arm with its load."""

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
        Return how the base of a moving arm has turned at times t, in its own frame.

        grid: evenly spaced, shape (N,) [s]; wrenches are given there.
        """
        coarse = np.arange(0, len(grid), max(1, round(COARSE / float(grid[1] - grid[0]))))
        at = grid[coarse]
        # The two hinges under the arm stand still.
        still = np.zeros((len(at), 2))
        q, qd, qdd = (np.hstack([still, motor(at, order)]) for order in range(3))
        shaken = -self.parts.richness * self._statics.drive_torque(q, qd, qdd)[:, :2]
        load = None if wrench is None else wrench[coarse]
        return _turned(CubicSpline(at, self._balance(q[:, 2:], load, shaken))(t))

    @cached_property
    def _statics(self) -> mujoco_model.Statics:
        own = self.parts
        return mujoco_model.Statics(mujoco_model.rigid(own.robot, own.arm, own.load, leaning=True))

    def _balance(self, q: np.ndarray, wrench: np.ndarray | None, shaken: np.ndarray) -> np.ndarray:
        """Return the lean about x and y, shape (N, 2) [rad]."""
        lean = np.zeros((len(q), 2))
        for _ in range(ROUNDS):
            moment = self._statics.torque(np.hstack([lean, q]), wrench)[:, :2] + shaken
            peak = np.abs(self.compliance * moment).max(axis=0) + 1e-15
            lean = self.compliance * moment / self.parts.stiffening(lean, peak)
        return lean


def _turned(lean: np.ndarray) -> Motion:
    return exponentials.compose(
        exponentials.turn('x', lean[:, 0]), exponentials.turn('y', lean[:, 1])
    )
