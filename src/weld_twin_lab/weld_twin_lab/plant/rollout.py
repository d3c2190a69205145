# Copyright 2026 weld_twin contributors
# SPDX-License-Identifier: Apache-2.0
"""Run a MuJoCo model open loop under given forces, in C, in bounded memory."""

from typing import Any

import mujoco
import mujoco.rollout
import numpy as np

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
    Return what makes a follower hinge pass through every sample of its course.

    q: course [rad or m], shape (N,).
    step: [s]

    Returns
    -------
    force : array, shape (N,)
        Feed-forward of the second difference, which is what MuJoCo's integrator needs, and what
        holds the spring of the servo.
    velocity : float
        To start with.

    """
    acceleration = np.diff(q, 2, prepend=q[0], append=q[-1]) / step**2
    acceleration[0], acceleration[-1] = acceleration[1], acceleration[-2]
    velocity = (q[1] - q[0]) / step - step * acceleration[0]
    return HEAVY * (acceleration + SERVO**2 * q), velocity


def run(
    model: mujoco.MjModel,
    start: np.ndarray,
    velocity: np.ndarray,
    force: np.ndarray,
    pull: np.ndarray | None = None,
) -> np.ndarray:
    """
    Return the joint positions at every step, the start included.

    start, velocity: shape (nv,).
    force: generalised force held over the step that begins at each sample, shape (N, nv).
    pull: force and torque on each body at its centre of mass, world frame, shape (N, nbody, 6).

    Returns
    -------
    array, shape (N, nv)

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
