# Copyright 2026 weld_twin contributors
# SPDX-License-Identifier: Apache-2.0
"""
The moving arm with its gaps and springs free, as one MuJoCo tree under gravity and load.

Motor sides follow their course with full feed-forward; their own tracking error counts for
nothing, because gap and spring are joints of their own and only these are read.

- A gap has soft edges; its width is set so that under the friction that drags the link through
  it, the full travel is the width stated.
- The link of a joint with play is held by dry friction and by a counterbalance that carries most
  of its load, as play of a definite width requires; a gap under its full weight would never open.
- A spring hardens, has a damper, and feels the inertia of the links beyond it, which the effect's
  definition leaves out: little in slow motion, a third of the deflection in violent motion.
"""

from typing import Any

import mujoco
import numpy as np
from scipy.interpolate import CubicSpline

from . import exponentials, mujoco_model
from .compliance import HARDENING, Compliant

Course = tuple[np.ndarray, np.ndarray, np.ndarray]
"""Position, velocity and acceleration of the motor sides, each (N, n), `STEP` apart."""

STEP = 1e-3
"""Step [s] of the simulation."""
DAMPING = 0.1
"""Damping ratio of a spring with the links beyond it."""
EDGE_SHARE = 0.02
"""Share of the width that the edges of a gap give."""
UNBALANCED = 0.2
"""Share of the load that a counterbalance leaves to the gap."""
GRIP = 2.0
"""Friction over the largest torque that would move a link by itself."""
FASTEST = 0.5
"""Square of the fastest swing, in radians to a step."""
COARSE = 0.02
"""Spacing [s] at which torques are computed; they change with the pose, which is slow."""
SOFTEST = 10.0
"""Least stiffness of the edge of a gap, in 1/(step^2 inverse weight): a softer one rings."""
STIFFEST = 9e3
"""Largest stiffness of the edge, in the same unit; MuJoCo allows 1e4."""


def moving(
    parts: Compliant, t: np.ndarray, motor: CubicSpline, wrench: np.ndarray | None
) -> np.ndarray:
    """Return gaps and springs of the moving arm, shape (N, n) [rad or m], at times `STEP` apart."""
    q: np.ndarray = motor(t)
    if parts.richness <= 0.0:
        return parts.at_rest(q, wrench)
    tree = Tree(parts, (q, motor(t, 1), motor(t, 2)), wrench)
    path = mujoco_model.simulate(tree.model, *tree.drive(), tree.pull(wrench))
    out = np.zeros_like(q)
    for dof, i in (*tree.gaps.items(), *tree.springs.items()):
        out[:, i] += path[:, dof]
    return out


class Tree:
    """The MuJoCo arm of one recording with a wrench (N, 6), and the forces that drive it."""

    def __init__(self, parts: Compliant, course: Course, wrench: np.ndarray | None) -> None:
        self.parts, self.course = parts, course
        self.coarse = np.arange(0, len(course[0]), max(1, round(COARSE / STEP)))
        q, qd, qdd = (rows[self.coarse] for rows in course)
        load = None if wrench is None else wrench[self.coarse]
        self.tau = parts.statics.torque(q, load)
        self.inertial = parts.statics.drive_torque(q, qd, qdd)
        self.inertia = parts.statics.inertia(q[::10]).min(axis=0)
        self.first_sag = parts.sag(q[:1], None if load is None else load[:1])[0]
        self._build()

    def _build(self) -> None:
        parts, spec = self.parts, mujoco.MjSpec()
        spec.compiler.degree = False
        spec.option.timestep = STEP
        # heavy motor sides swell the inertia that MuJoCo scales its tolerance with
        spec.option.tolerance = 1e-15
        at = exponentials.home(parts.arm)
        motors, gaps, springs, dof = {}, {}, {}, 0
        for i, body in enumerate(mujoco_model.add_links(spec, parts.robot, parts.arm, parts.load)):
            mujoco_model.add_hinge(body, parts.arm, at, i, f'motor{i}', **mujoco_model.follower())
            motors[dof], dof = i, dof + 1
            if parts.width[i] > 0.0:
                self._add_gap(spec, body, at, i)
                gaps[dof], dof = i, dof + 1
            if parts.compliance[i] > 0.0:
                mujoco_model.add_hinge(body, parts.arm, at, i, f'spring{i}', **self._spring(i))
                springs[dof], dof = i, dof + 1
        self.model, self.gaps, self.springs = spec.compile(), gaps, springs
        self.motors = motors
        self._soften()

    def _light(self, i: int) -> float:
        """
        Return the inertia [kg m^2] of a spring's own parts.

        No mode of the arm can then swing faster than the step can follow, whatever the links.
        """
        return float(STEP**2 / (FASTEST * self.parts.compliance[i]))

    def _spring(self, i: int) -> dict[str, Any]:
        k = 1.0 / self.parts.compliance[i]
        moving = (np.abs(self.tau[:, i]) + np.abs(self.inertial[:, i])).max()
        peak = max(self.parts.rated[i], moving) / k + 1e-12
        idle = float(self.parts.stiffening(np.zeros(()), np.ones(())))
        light = self._light(i)
        damper = 2.0 * DAMPING * np.sqrt(k * (self.inertia[i] + light))
        cubic = HARDENING * self.parts.richness * k / peak**2
        return {
            'stiffness': [idle * k, 0.0, cubic],
            'damping': [damper, 0.0, 0.0],
            'armature': light,
        }

    def friction(self, i: int) -> float:
        """Return the dry friction [N m] that makes the link stay where it was left."""
        own = np.abs(self.inertial[:, i]) + UNBALANCED * np.abs(self.tau[:, i])
        gear = self._gear(i) * np.abs(self.course[2][:, i]).max()
        return float(GRIP * (own.max() + gear) + 1e-3 * self.inertia[i])

    def _gear(self, i: int) -> float:
        """Return the inertia [kg m^2] of the wheel between gap and spring."""
        return float(0.05 * self.inertia[i])

    def _add_gap(
        self, spec: mujoco.MjSpec, body: mujoco.MjsBody, at: exponentials.Home, i: int
    ) -> None:
        half = 0.5 * self.parts.width[i] * (1.0 - 2.0 * self._edge())
        mujoco_model.add_hinge(
            body,
            self.parts.arm,
            at,
            i,
            f'gap{i}',
            armature=self._gear(i),
            limited=mujoco.mjtLimited.mjLIMITED_TRUE,
            range=[-half, half],
        )
        # dry friction against the link before: on motor plus gap, the gear's output
        hold = spec.add_tendon(
            name=f'hold{i}',
            frictionloss=self.friction(i),
            solref_friction=[2.0 * STEP, 1.0],
            solimp_friction=[0.9999, 0.9999, 1e-3, 0.5, 2.0],
        )
        hold.wrap_joint(f'motor{i}', 1.0)
        hold.wrap_joint(f'gap{i}', 1.0)

    def _edge(self) -> float:
        return EDGE_SHARE * self.parts.richness

    def _soften(self) -> None:
        """Give the edges of the gaps the softness that yields `EDGE_SHARE` under friction."""
        for dof, i in self.gaps.items():
            give = self._edge() * self.parts.width[i]
            wanted = self.friction(i) / give * self.model.dof_invweight0[dof]
            # MuJoCo's stiffness of a limit of constant impedance d: 1/((1-d) tc^2 invweight)
            ratio = np.clip(wanted * (2.0 * STEP) ** 2, SOFTEST, STIFFEST)
            impedance = 1.0 - 1.0 / ratio
            # an edge softer than that is slower instead: a low impedance rings at this step
            slow = max(1.0, np.sqrt(SOFTEST / (wanted * (2.0 * STEP) ** 2)))
            self.model.jnt_solref[dof] = [2.0 * STEP * slow, 1.0]
            self.model.jnt_solimp[dof] = [impedance, impedance, 1e-3, 0.5, 2.0]

    def drive(self) -> tuple[np.ndarray, np.ndarray, np.ndarray]:
        """
        Return the start and the forces: position (nv,), velocity (nv,), force (N, nv).

        Motors are on course and fed forward, gaps centred and counterbalanced, springs in
        equilibrium and spared the links' inertia as far as richness falls short of 1.
        """
        q = self.course[0]
        spared = max(0.0, 1.0 - self.parts.richness)
        force = np.zeros((len(q), self.model.nv))
        position, velocity = np.zeros((2, self.model.nv))
        for dof, i in self.motors.items():
            position[dof] = q[0, i]
            force[:, dof], velocity[dof] = mujoco_model.follow(q[:, i], STEP)
        for dof, i in self.gaps.items():
            force[:, dof] = -(1.0 - UNBALANCED) * self._fine(self.tau[:, i])
        for dof, i in self.springs.items():
            position[dof] = self.first_sag[i]
            force[:, dof] = spared * self._fine(self.inertial[:, i])
        return position, velocity, force

    def _fine(self, torque: np.ndarray) -> np.ndarray:
        """Return a torque known at the coarse samples at all of them, shape (N,)."""
        return np.asarray(np.interp(np.arange(len(self.course[0])), self.coarse, torque))

    def pull(self, wrench: np.ndarray | None) -> np.ndarray | None:
        """Return the tool wrench as forces on the bodies in the base frame, (N, nbody, 6)."""
        if wrench is None or not wrench.any():
            return None
        arm = self.parts.arm
        turn = exponentials.flange(arm, exponentials.home(arm), self.course[0]).rotation
        turn = turn @ arm.tool.rotation
        out = np.zeros((len(wrench), self.model.nbody, 6))
        tool = self.model.body('tool').id
        out[:, tool, :3] = np.einsum('...ij,...j->...i', turn, wrench[:, :3])
        out[:, tool, 3:] = np.einsum('...ij,...j->...i', turn, wrench[:, 3:])
        return out
