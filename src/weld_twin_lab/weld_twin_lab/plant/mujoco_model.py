# Copyright 2026 weld_twin contributors
# SPDX-License-Identifier: Apache-2.0
"""
The arm as a MuJoCo model: rigid links, payload, and what gives between motor and link.

Each joint is one to three coaxial hinges (or slides) of the same link, in series: the motor, a
gap if the gear has play, a spring if it gives. Gap and spring are thus read as positions of
their own, free of the motor's tracking error. World is the robot base.
"""

from dataclasses import dataclass
from typing import Any

import mujoco
import mujoco.rollout
import numpy as np
from scipy.spatial.transform import Rotation

from . import exponentials
from .exponentials import Arm, Entry, Motion

CHUNK = 30000
"""Steps simulated at once; a state of some hundred numbers then takes tens of megabytes."""
HEAVY = 1e4
"""Inertia [kg m^2] of a motor side, so large that it feels nothing of what it drives."""
SERVO = 200.0
"""Stiffness [rad/s] of the spring that keeps a motor side on its course."""


def grid(start: float, end: float, step: float) -> np.ndarray:
    """Return evenly spaced times from start to the end or just past it [s]."""
    return start + step * np.arange(int(np.ceil((end - start) / step - 1e-9)) + 1)


def follower() -> dict[str, Any]:
    """
    Return the hinge options of a motor side that follows a course given by `follow`.

    It has no damper: MuJoCo takes dampers into its step but not into its constraint forces, and
    on a mass this heavy the difference would rattle the gaps.
    """
    return {'armature': HEAVY, 'stiffness': [HEAVY * SERVO**2, 0.0, 0.0]}


def follow(q: np.ndarray, step: float) -> tuple[np.ndarray, np.ndarray]:
    """
    Return the force (N,) and first velocity by which a follower hinge passes all samples of a course.

    The force is the feed-forward of the second difference, which is what MuJoCo's integrator needs, and
    what holds the spring of the servo.
    """
    acceleration = np.diff(q, 2, prepend=q[0], append=q[-1]) / step**2
    acceleration[0], acceleration[-1] = acceleration[1], acceleration[-2]
    velocity = (q[1] - q[0]) / step - step * acceleration[0]
    return HEAVY * (acceleration + SERVO**2 * q), velocity


def simulate(
    model: mujoco.MjModel,
    start: np.ndarray,
    velocity: np.ndarray,
    force: np.ndarray,
    pull: np.ndarray | None = None,
) -> np.ndarray:
    """
    Return the joint positions at every step, the start included, shape (N, nv).

    force: generalised force held over the step that begins at each sample, shape (N, nv).
    pull: force and torque on each body at its centre of mass, world frame, shape (N, nbody, 6).
    """
    data = mujoco.MjData(model)
    data.qpos[:], data.qvel[:] = start, velocity
    spec = int(mujoco.mjtState.mjSTATE_QFRC_APPLIED)
    if pull is not None:
        spec |= int(mujoco.mjtState.mjSTATE_XFRC_APPLIED)
        force = np.concatenate([force, pull.reshape(len(pull), -1)], axis=1)
    full = mujoco.mjtState.mjSTATE_FULLPHYSICS
    state = np.empty(mujoco.mj_stateSize(model, full))
    mujoco.mj_getState(model, data, state, full)
    out = [np.array(start, dtype=float)[None]]
    for first in range(0, len(force) - 1, CHUNK):
        control = np.ascontiguousarray(force[first : min(first + CHUNK, len(force) - 1)])
        states, _ = mujoco.rollout.rollout(
            model, data, state[None], control[None], control_spec=spec
        )
        # after a warning the rollout stands still, which would look like a recording
        if not np.isfinite(states).all() or any(entry.number for entry in data.warning):
            raise FloatingPointError('the simulated arm came apart; effects out of range?')
        out.append(states[0, :, 1 : 1 + model.nv].copy())
        state = states[0, -1].copy()
    return np.concatenate(out)


MASSLESS = 1e-6
"""Mass [kg] of a body that has none; MuJoCo wants some on every moving body."""
GYRATION = 0.3
"""Radius of gyration of a link whose inertia is not known, over its length."""
SMALL = 0.03
"""Least radius of gyration [m]."""
STANDARD_GRAVITY = (0.0, 0.0, -9.80665)
"""Of a robot file that does not say [m/s^2]."""


@dataclass(frozen=True, eq=False)
class Load:
    """What the flange carries besides the tool."""

    mass: float
    """[kg]"""
    com: np.ndarray
    """Centre of mass in the tool frame, shape (3,) [m]."""


def load_from(robot: Entry, extra: list[tuple[float, np.ndarray]]) -> Load:
    """Return the declared payload and the undeclared ones (mass, com) as one."""
    entry = robot.get('payload') or {}
    parts = [(float(entry.get('mass', 0.0)), np.array(entry.get('com', [0.0] * 3), dtype=float))]
    parts += extra
    mass = sum(part[0] for part in parts)
    if mass < 0.0:
        raise ValueError(f'the payload must not weigh less than nothing, got {mass} kg')
    moment = sum((part[0] * part[1] for part in parts), start=np.zeros(3))
    return Load(mass, moment / mass if mass > 0.0 else np.zeros(3))


def add_links(
    spec: mujoco.MjSpec, robot: Entry, arm: Arm, load: Load, foot: mujoco.MjsBody | None = None
) -> list[mujoco.MjsBody]:
    """Add links, tool and payload on a foot or the floor, no joints; return the link bodies."""
    spec.option.gravity = list(robot.get('gravity', STANDARD_GRAVITY))
    at = exponentials.home(arm)
    parent, before, bodies = foot or spec.worldbody, exponentials.identity(), []
    for i, pose in enumerate(at.links):
        parent = _add_body(
            parent, f'link{i}', exponentials.compose(exponentials.inverse(before), pose)
        )
        before = pose
        _add_mass(parent, robot, i, float(np.hypot(arm.rows.a[i], arm.rows.d[i])))
        bodies.append(parent)
    tool = _add_body(parent, 'tool', arm.tool)
    # the wrench acts at a body's centre of mass, so the tool needs one, at its tip
    weigh(tool, MASSLESS, np.zeros(3), 1e-9)
    if load.mass > 0.0:
        weigh(
            _add_body(tool, 'payload', exponentials.identity()),
            load.mass,
            load.com,
            load.mass * SMALL**2,
        )
    return bodies


def _add_body(parent: mujoco.MjsBody, name: str, pose: Motion) -> mujoco.MjsBody:
    x, y, z, w = Rotation.from_matrix(pose.rotation).as_quat()
    return parent.add_body(name=name, pos=pose.position, quat=[w, x, y, z])


def _add_mass(body: mujoco.MjsBody, robot: Entry, i: int, reach: float) -> None:
    links = robot.get('links') or []
    link = links[i] if i < len(links) else {}
    mass = max(float(link.get('mass', 0.0)), MASSLESS)
    inertia = mass * max(GYRATION * reach, SMALL) ** 2 + 1e-6
    weigh(body, mass, np.array(link.get('com', [0.0, 0.0, 0.0]), dtype=float), inertia)


def weigh(body: mujoco.MjsBody, mass: float, com: np.ndarray, inertia: float) -> None:
    """Give a body its mass [kg], its centre (3,) [m] and its inertia about each axis [kg m^2]."""
    body.explicitinertial = True
    body.mass, body.ipos, body.inertia = mass, com, np.full(3, inertia)


def add_hinge(
    body: mujoco.MjsBody, arm: Arm, at: exponentials.Home, i: int, name: str, **options: Any
) -> mujoco.MjsJoint:
    link = at.links[i]
    axis = at.v[i] if arm.sliding[i] else at.omega[i]
    kind = mujoco.mjtJoint.mjJNT_SLIDE if arm.sliding[i] else mujoco.mjtJoint.mjJNT_HINGE
    anchor = exponentials.compose(
        exponentials.inverse(link), Motion(np.eye(3), at.point[i])
    ).position
    return body.add_joint(name=name, type=kind, axis=link.rotation.T @ axis, pos=anchor, **options)


def rigid(robot: Entry, arm: Arm, load: Load, *, leaning: bool = False) -> mujoco.MjModel:
    """Return the arm with one hinge a joint and nothing that gives; two more if its pedestal leans."""
    spec = mujoco.MjSpec()
    foot = spec.worldbody.add_body(name='pedestal') if leaning else None
    if foot is not None:
        weigh(foot, MASSLESS, np.zeros(3), 1e-9)
        for name, axis in (('x', [1, 0, 0]), ('y', [0, 1, 0])):
            foot.add_joint(name=name, type=mujoco.mjtJoint.mjJNT_HINGE, axis=axis)
    at = exponentials.home(arm)
    for i, body in enumerate(add_links(spec, robot, arm, load, foot)):
        add_hinge(body, arm, at, i, f'joint{i}')
    return spec.compile()


class Statics:
    """Torques of the rigid arm at rest, and its inertia."""

    def __init__(self, model: mujoco.MjModel) -> None:
        self.model, self._data = model, mujoco.MjData(model)
        self._tool = model.body('tool').id

    def torque(self, q: np.ndarray, wrench: np.ndarray | None = None) -> np.ndarray:
        """Return the load torque on each joint, (N, n), with a wrench on the tool, its frame, (N, 6)."""
        data, tau = self._data, np.empty_like(q)
        for k, row in enumerate(q):
            data.qpos[:] = row
            mujoco.mj_fwdPosition(self.model, data)
            mujoco.mj_fwdVelocity(self.model, data)
            tau[k] = -data.qfrc_bias
            if wrench is not None and wrench[k].any():
                turn = data.xmat[self._tool].reshape(3, 3)
                mujoco.mj_applyFT(
                    self.model,
                    data,
                    turn @ wrench[k, :3],
                    turn @ wrench[k, 3:],
                    data.xpos[self._tool],
                    self._tool,
                    tau[k],
                )
        return tau

    def inertia(self, q: np.ndarray) -> np.ndarray:
        """Return the diagonal of the mass matrix, shape (N, n) [kg m^2 or kg]."""
        out = np.empty_like(q)
        full = np.empty((self.model.nv, self.model.nv))
        for k, row in enumerate(q):
            self._data.qpos[:] = row
            mujoco.mj_fwdPosition(self.model, self._data)
            mujoco.mj_fullM(self.model, self._data, full)
            out[k] = np.diag(full)
        return out

    def drive_torque(self, q: np.ndarray, qd: np.ndarray, qdd: np.ndarray) -> np.ndarray:
        """Return the torque the motors owe to the links' inertia alone, shape (N, n)."""
        out = np.empty_like(q)
        data = self._data
        for k in range(len(q)):
            data.qpos[:], data.qvel[:], data.qacc[:] = q[k], qd[k], qdd[k]
            mujoco.mj_inverse(self.model, data)
            out[k] = data.qfrc_inverse
            data.qvel[:] = 0.0
            data.qacc[:] = 0.0
            mujoco.mj_inverse(self.model, data)
            out[k] -= data.qfrc_inverse
        data.qvel[:] = 0.0
        return out
