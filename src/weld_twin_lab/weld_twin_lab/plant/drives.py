# Copyright 2026 weld_twin contributors
# SPDX-License-Identifier: Apache-2.0
"""
The drives: servo loops and shaking flywheels, in MuJoCo.

Each joint's drive is a rotor so heavy, through its gear, that the arm does not push it about;
the drives are therefore simulated apart from the arm and before it.

servo_lag
    A position loop round a velocity loop without feed-forward. Its lag on a ramp is exactly the
    time constant; the velocity loop adds a second, faster pole (`LOOP_SHARE` of the time
    constant), which an ideal first-order lag does not have.
vibration
    A flywheel on a spring and damper, carried by the rotor: x'' + 2 zeta w x' + w^2 x = -qdd. The
    spring hardens with the swing.
"""

import mujoco
import numpy as np
from scipy.interpolate import CubicSpline

from . import mujoco_model
from .exponentials import Course, Entry
from .flaws import Causes

STEP = 5e-4
"""Step [s] of the simulation; a flywheel of 50 Hz gets forty to a period."""
LOOP_SHARE = 0.1
"""Time constant of the velocity loop, as a share of that of the position loop."""
HARDENING = 0.1
"""Share by which a flywheel's spring is stiffer at the largest swing expected."""


def displacement(causes: Causes, course: Course, richness: float) -> CubicSpline | None:
    """Return how far motors are from the command over time [rad or m]; None where drives are right."""
    lag = causes.per_joint('servo_lag', 'time_constant')
    shaking = list(causes.of('vibration'))
    if course.command.static or not (lag.any() or shaking):
        return None
    t = mujoco_model.grid(course.command.t[0], course.command.t[-1], STEP)
    q, qdd = course.q(t), course.q(t, 2)
    gap = np.zeros_like(q)
    rotors = sorted(set(np.flatnonzero(lag)) | {causes.joint(item['joint']) for item in shaking})
    for i in rotors:
        own = [item for item in shaking if causes.joint(item['joint']) == i]
        swing = [np.abs(qdd[:, i]).max() / _omega(item) ** 2 for item in own]
        model = _rotor(lag[i], own, swing, richness)
        force = np.zeros((len(t), model.nv))
        start, velocity = np.zeros((2, model.nv))
        start[0] = q[0, i]
        if lag[i]:
            force[:, 0] = model.jnt_stiffness[0] * q[:, i]
        else:
            force[:, 0], velocity[0] = mujoco_model.follow(q[:, i], STEP)
        path = mujoco_model.simulate(model, start, velocity, force)
        if lag[i]:
            gap[:, i] += path[:, 0] - q[:, i]
        for item, x in zip(own, path[:, 1:].T, strict=True):
            gap[:, i] += float(item['gain']) * x
    return CubicSpline(t, gap)


def _omega(item: Entry) -> float:
    return 2.0 * np.pi * float(item['frequency'])


def _rotor(
    lag: float, shaking: list[Entry], swing: list[float], richness: float
) -> mujoco.MjModel:
    """Return the rotor of one drive, carrying one flywheel for each vibration."""
    spec = mujoco.MjSpec()
    spec.option.timestep = STEP
    spec.option.gravity = [0.0, 0.0, 0.0]
    rotor = _wheel(spec.worldbody)
    options = mujoco_model.follower()
    if lag:
        loop = 1.0 / (LOOP_SHARE * richness * lag + 1e-6)
        options |= {
            'stiffness': [mujoco_model.HEAVY * loop / lag, 0.0, 0.0],
            'damping': [mujoco_model.HEAVY * loop, 0.0, 0.0],
        }
    rotor.add_joint(axis=[0, 0, 1], **options)
    for item, reach in zip(shaking, swing, strict=True):
        k = _omega(item) ** 2
        cubic = HARDENING * richness * k / max(reach, 1e-9) ** 2
        _wheel(rotor).add_joint(
            axis=[0, 0, 1],
            stiffness=[k, 0.0, cubic],
            damping=[2.0 * float(item['damping']) * _omega(item), 0.0, 0.0],
        )
    return spec.compile()


def _wheel(parent: mujoco.MjsBody) -> mujoco.MjsBody:
    """Return a body with 1 kg m^2 about its axis."""
    body = parent.add_body(mass=1.0, inertia=[1.0, 1.0, 1.0])
    body.explicitinertial = True
    return body
