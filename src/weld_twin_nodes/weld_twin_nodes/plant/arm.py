# SPDX-FileCopyrightText: weld_twin contributors
# SPDX-License-Identifier: Apache-2.0
"""
What gives between motors and links: gear play and joint springs, under gravity and load.

At rest (static stations, or richness 0) the springs are in equilibrium with the load torque of
the pose they sag to, and the gaps follow the textbook play. In motion with richness > 0, the arm
is a MuJoCo tree whose motor sides follow their course with full feed-forward and whose gaps and
springs are free:

- a gap has soft edges; its width is set so that under the friction that drags the link through
  it, the full travel is the width stated;
- the link of a joint with play is held by dry friction and by a counterbalance that carries most
  of its load, as play of a definite width requires; a gap under its full weight would never open;
- a spring hardens, has a damper, and feels the inertia of the links beyond it.
"""

from collections.abc import Mapping

import mujoco
import numpy as np
from scipy.interpolate import CubicSpline

from weld_twin_nodes.plant import geometry, model, rollout
from weld_twin_nodes.plant.effects import Causes
from weld_twin_nodes.plant.geometry import Arm

STEP = 1e-3
HARDENING = 0.03      # share of a spring's stiffness gained at the largest load
DAMPING = 0.1         # damping ratio of a spring with the links beyond it
EDGE_SHARE = 0.01     # share of the width that the edges of a gap give
UNBALANCED = 0.2      # share of the load a counterbalance leaves to the gap
GRIP = 1.5            # friction over the largest torque that would move a link by itself
COARSE = 0.02         # s, spacing at which torques are worth computing


class Compliant:
    """
    The joints that give.

    Parameters
    ----------
    robot : mapping
        The robot file.
    arm : Arm
    causes : Causes
    richness : float

    """

    def __init__(self, robot: Mapping, arm: Arm, causes: Causes, richness: float) -> None:
        extra = [(float(item['mass']), np.array(item.get('com', [0.0] * 3), dtype=float))
                 for item in causes.of('payload')]
        self.robot, self.arm, self.richness = robot, arm, richness
        self.load = model.load_from(robot, extra)
        self.width = causes.per_joint('backlash', 'width')
        self.compliance = causes.per_joint('joint_compliance', 'compliance')
        self.statics = model.Statics(model.rigid(robot, arm, self.load))

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
        peak = np.abs(self.compliance * tau).max(axis=0) + 1e-12
        for _ in range(4):
            stiffening = 1.0 + HARDENING * self.richness * (give / peak) ** 2
            give = self.compliance * tau / stiffening
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
        return gap + self.sag(q + gap, wrench)

    def moving(self, t: np.ndarray, motor: CubicSpline, wrench: np.ndarray | None) -> np.ndarray:
        """
        Return gaps and springs of the moving arm.

        Parameters
        ----------
        t : array, shape (N,) [s]
            Evenly spaced by `STEP`.
        motor : CubicSpline
            Motor sides over time, values (n,).
        wrench : array, shape (N, 6), optional

        Returns
        -------
        array, shape (N, n) [rad or m]

        """
        q = motor(t)
        if self.richness <= 0.0:
            return self.at_rest(q, wrench)
        course = (q, motor(t, 1), motor(t, 2))
        tree = _Tree(self, course, wrench)
        path = rollout.run(tree.model, tree.start(), tree.velocity(), tree.force(),
                           tree.pull(wrench))
        out = np.zeros_like(q)
        for slot, i in (*tree.gaps.items(), *tree.springs.items()):
            out[:, i] += path[:, slot]
        return out


class _Tree:
    """The MuJoCo arm of one recording, and the forces that drive it."""

    def __init__(self, parts: Compliant, course: tuple, wrench: np.ndarray | None) -> None:
        self.parts, self.course = parts, course
        self.coarse = np.arange(0, len(course[0]), max(1, round(COARSE / STEP)))
        few = [None if rows is None else rows[self.coarse] for rows in (*course, wrench)]
        self.tau = parts.statics.torque(few[0], few[3])
        self.inertial = parts.statics.drive_torque(*few[:3])
        self.inertia = parts.statics.inertia(few[0][::10]).min(axis=0)
        self.first_sag = parts.sag(few[0][:1], None if few[3] is None else few[3][:1])[0]
        self._build()

    def _build(self) -> None:
        parts, spec = self.parts, mujoco.MjSpec()
        spec.option.timestep = STEP
        # heavy motor sides swell the inertia that MuJoCo scales its tolerance with
        spec.option.tolerance = 1e-15
        at = geometry.home(parts.arm)
        motors, gaps, springs, slot = {}, {}, {}, 0
        for i, body in enumerate(model.add_links(spec, parts.robot, parts.arm, parts.load)):
            model.add_hinge(body, parts.arm, at, i, f'motor{i}', **rollout.follower())
            motors[slot], slot = i, slot + 1
            if parts.width[i] > 0.0:
                self._add_gap(spec, body, at, i)
                gaps[slot], slot = i, slot + 1
            if parts.compliance[i] > 0.0:
                model.add_hinge(body, parts.arm, at, i, f'spring{i}', **self._spring(i))
                springs[slot], slot = i, slot + 1
        self.model, self.gaps, self.springs = spec.compile(), gaps, springs
        self.motors = motors
        self._soften()

    def _light(self, i: int) -> float:
        """Return the inertia [kg m^2] that keeps the spring of a joint within the step."""
        if self.parts.compliance[i] <= 0.0:
            return 0.0
        return max(0.0, STEP ** 2 / (0.2 * self.parts.compliance[i]) - self.inertia[i])

    def _spring(self, i: int) -> dict:
        k = 1.0 / self.parts.compliance[i]
        peak = np.abs(self.tau[:, i]).max() / k + 1e-12
        light = self._light(i)
        damper = 2.0 * DAMPING * np.sqrt(k * (self.inertia[i] + light))
        cubic = HARDENING * self.parts.richness * k / peak ** 2
        return {'stiffness': [k, 0.0, cubic], 'damping': [damper, 0.0, 0.0], 'armature': light}

    def friction(self, i: int) -> float:
        """Return the dry friction [N m] that makes the link stay where it was left."""
        own = np.abs(self.inertial[:, i]) + UNBALANCED * np.abs(self.tau[:, i])
        gear = self._gear(i) * np.abs(self.course[2][:, i]).max()
        return GRIP * (own.max() + gear) + 1e-3 * self.inertia[i]

    def _gear(self, i: int) -> float:
        """Return the inertia [kg m^2] of the wheel between gap and spring."""
        return 0.05 * self.inertia[i] + self._light(i)

    def _add_gap(self, spec: mujoco.MjSpec, body, at: geometry.Home, i: int) -> None:
        half = 0.5 * self.parts.width[i] * (1.0 - 2.0 * self._edge())
        model.add_hinge(body, self.parts.arm, at, i, f'gap{i}', armature=self._gear(i),
                        limited=mujoco.mjtLimited.mjLIMITED_TRUE, range=[-half, half])
        # dry friction against the link before: on motor plus gap, the gear's output
        hold = spec.add_tendon(name=f'hold{i}', frictionloss=self.friction(i),
                               solref_friction=[2.0 * STEP, 1.0],
                               solimp_friction=[0.9999, 0.9999, 1e-3, 0.5, 2.0])
        hold.wrap_joint(f'motor{i}', 1.0)
        hold.wrap_joint(f'gap{i}', 1.0)

    def _edge(self) -> float:
        return EDGE_SHARE * self.parts.richness

    def _soften(self) -> None:
        """Give the edges of the gaps the softness that yields `EDGE_SHARE` under friction."""
        for slot, i in self.gaps.items():
            give = self._edge() * self.parts.width[i]
            wanted = self.friction(i) / give * self.model.dof_invweight0[slot]
            # MuJoCo's stiffness of a limit of constant impedance d: 1/((1-d) tc^2 invweight)
            ratio = min(wanted * (2.0 * STEP) ** 2, 9e3)
            impedance = np.clip(1.0 - 1.0 / max(ratio, 1.2), 0.2, 0.9999)
            self.model.jnt_solref[slot] = [2.0 * STEP, 1.0]
            self.model.jnt_solimp[slot] = [impedance, impedance, 1e-3, 0.5, 2.0]

    def start(self) -> np.ndarray:
        """Return the start: motors on course, gaps centred, springs in equilibrium."""
        out = np.zeros(self.model.nv)
        for slot, i in self.motors.items():
            out[slot] = self.course[0][0, i]
        for slot, i in self.springs.items():
            out[slot] = self.first_sag[i]
        return out

    def velocity(self) -> np.ndarray:
        """Return the starting velocity: motors on course, the rest at rest."""
        out = np.zeros(self.model.nv)
        for slot, i in self.motors.items():
            out[slot] = self.course[1][0, i]
        return out

    def force(self) -> np.ndarray:
        """Return the feed-forward of the motors and the counterbalance of the gaps, (N, nv)."""
        q, qd, qdd = self.course
        out = np.zeros((len(q), self.model.nv))
        for slot, i in self.motors.items():
            out[:, slot] = rollout.follow(q[:, i], qd[:, i], qdd[:, i])
        everywhere = np.arange(len(q))
        for slot, i in self.gaps.items():
            carried = np.interp(everywhere, self.coarse, self.tau[:, i])
            out[:, slot] = -(1.0 - UNBALANCED) * carried
        return out

    def pull(self, wrench: np.ndarray | None) -> np.ndarray | None:
        """Return the tool wrench as forces on the bodies in the base frame, (N, nbody, 6)."""
        if wrench is None or not wrench.any():
            return None
        arm = self.parts.arm
        turn = geometry.flange(arm, geometry.home(arm), self.course[0]).rotation
        turn = turn @ arm.tool.rotation
        out = np.zeros((len(wrench), self.model.nbody, 6))
        tool = self.model.body('tool').id
        out[:, tool, :3] = np.einsum('...ij,...j->...i', turn, wrench[:, :3])
        out[:, tool, 3:] = np.einsum('...ij,...j->...i', turn, wrench[:, 3:])
        return out
