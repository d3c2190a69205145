# SPDX-FileCopyrightText: weld_twin contributors
# SPDX-License-Identifier: Apache-2.0
"""Run a MuJoCo model open loop under given forces, in C, in bounded memory."""

import mujoco
import mujoco.rollout
import numpy as np

CHUNK = 30000
HEAVY = 1e4     # kg m^2; a motor side this heavy feels nothing of what it drives
SERVO = 200.0   # rad/s, bandwidth of a motor side that merely follows


def grid(start: float, end: float, step: float) -> np.ndarray:
    """Return evenly spaced times from start to the end or just past it [s]."""
    return start + step * np.arange(int(np.ceil((end - start) / step - 1e-9)) + 1)


def follower() -> dict:
    """Return the hinge options of a motor side that follows a course given by `follow`."""
    return {'armature': HEAVY, 'stiffness': [HEAVY * SERVO ** 2, 0.0, 0.0],
            'damping': [2.0 * HEAVY * SERVO, 0.0, 0.0]}


def follow(q: np.ndarray, qd: np.ndarray, qdd: np.ndarray) -> np.ndarray:
    """Return the force that makes a follower hinge follow: feed-forward of all three."""
    return HEAVY * (qdd + 2.0 * SERVO * qd + SERVO ** 2 * q)


def run(model: mujoco.MjModel, start: np.ndarray, velocity: np.ndarray,
        force: np.ndarray, pull: np.ndarray | None = None) -> np.ndarray:
    """
    Return the joint positions at every step, the start included.

    Parameters
    ----------
    model : MjModel
    start, velocity : array, shape (nv,)
    force : array, shape (N, nv)
        Generalised force held over the step that begins at each sample.
    pull : array, shape (N, nbody, 6), optional
        Force and torque on each body at its centre of mass, world frame.

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
        control = np.ascontiguousarray(force[first:min(first + CHUNK, len(force) - 1)])
        states, _ = mujoco.rollout.rollout(model, data, state[None], control[None],
                                           control_spec=spec)
        out.append(states[0, :, 1:1 + model.nv].copy())
        state = states[0, -1].copy()
    path = np.concatenate(out)
    if not np.isfinite(path).all():
        raise FloatingPointError('the simulated arm came apart; the effects are out of range')
    return path
