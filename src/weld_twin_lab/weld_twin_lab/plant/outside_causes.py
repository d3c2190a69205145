# Copyright 2026 weld_twin contributors
# SPDX-License-Identifier: Apache-2.0
"""
Causes beside the textbook: most of them no library knows, and a diagnosis should say unknown.

`bearing_tilt` and `loaded_play` have names in the library by now, with formulas of their own.

| effect | parameters | what happens |
|---|---|---|
| bearing_tilt | joint, tilt rad, phase rad | the axis leans by tilt cos(q + phase), unevenly |
| station_step | time s, xyz m, rotvec rad | the measuring frame is knocked at a time |
| tool_slip | time s, xyz m, rotvec rad | the tool slips in its holder at a time |
| quadratic_scale | coefficient 1/m, origin m | p - origin stretches with its own length |
| column_bend | rotvec rad, time_constant s | the base leans over as the column warms up |
| stick_slip | joint, amplitude rad | the link sticks, then jumps after the motor |
| friction_wander | joint, amplitude rad, time_constant s | lost motion of wandering size |
| loaded_play | joint, width rad, torque N m | the gear lies on the flank its load pulls it to |
| dress_pack | joint, amplitude rad | a hose pulls, harder towards the ends of the joint's range |

Times count from the recording's first stamp.
"""

from collections.abc import Callable

import numpy as np

from . import screws
from .screws import Motion
from .textbook_effects import Causes

STUCK_AFTER = 0.3
"""Share of the wind-up that a jump leaves."""
SLOW = 0.01
"""Joint speed [rad/s] below which friction gives way smoothly."""
HIGH_SPOT = 0.1
"""Share of the lean of a bearing that comes twice per turn."""
FLANK_TORQUE = 0.1
"""Share of the recording's largest load at which the flank is certain, where no torque is given."""
JOINT_LEVEL = frozenset({'stick_slip', 'friction_wander', 'loaded_play', 'dress_pack'})
OUTSIDE = JOINT_LEVEL | {
    'bearing_tilt',
    'station_step',
    'tool_slip',
    'quadratic_scale',
    'column_bend',
}


def on_joints(
    causes: Causes,
    t: np.ndarray,
    q: np.ndarray,
    torque: Callable[[], np.ndarray],
    rng: np.random.Generator,
) -> np.ndarray:
    """
    Return the displacement of the links, shape (N, n) [rad or m].

    t: shape (N,) [s].
    q: motor side, shape (N, n); a sequence in time.
    torque: gives the load torque, shape (N, n); asked only where needed.
    """
    out = np.zeros_like(q)
    for item in causes.items:
        if item['effect'] not in JOINT_LEVEL:
            continue
        i = causes.joint(item['joint'])
        if item['effect'] == 'stick_slip':
            out[:, i] += _stick_slip(q[:, i], float(item['amplitude']))
        elif item['effect'] == 'friction_wander':
            level = _wander(t, float(item['time_constant']), rng)
            rate = np.gradient(q[:, i], t) if len(t) > 1 else np.zeros(1)
            out[:, i] += float(item['amplitude']) * level * np.tanh(rate / SLOW)
        elif item['effect'] == 'loaded_play':
            load = torque()[:, i]
            sure = float(item.get('torque') or FLANK_TORQUE * np.abs(load).max()) + 1e-12
            out[:, i] += 0.5 * float(item['width']) * np.tanh(load / sure)
        else:
            middle = float(item.get('middle', np.mean(q[:, i])))
            reach = float(item.get('reach', np.ptp(q[:, i]) / 2.0)) + 1e-12
            out[:, i] -= float(item['amplitude']) * ((q[:, i] - middle) / reach) ** 3
    return out


def _stick_slip(q: np.ndarray, amplitude: float) -> np.ndarray:
    """Return the lag of a link that sticks until the wind-up jumps it forward."""
    out, link = np.empty_like(q), q[0]
    for k, motor in enumerate(q):
        if abs(motor - link) > amplitude:
            link = motor - STUCK_AFTER * amplitude * np.sign(motor - link)
        out[k] = link - motor
    return out


def _wander(t: np.ndarray, time_constant: float, rng: np.random.Generator) -> np.ndarray:
    """Return a stationary random walk of unit variance (Ornstein-Uhlenbeck) at the times."""
    keep = np.exp(-np.diff(t, prepend=t[0]) / time_constant)
    kick = np.sqrt(1.0 - keep**2) * rng.standard_normal(len(t))
    out, level = np.empty(len(t)), rng.standard_normal()
    for k in range(len(t)):
        level = keep[k] * level + kick[k]
        out[k] = level
    return out


def wobble(causes: Causes, q: np.ndarray) -> np.ndarray | None:
    """Return the lean of each axis, shape (M, n) [rad], or None."""
    lean = np.zeros_like(q)
    for item in causes.of('bearing_tilt'):
        i = causes.joint(item['joint'])
        turned = q[:, i] + float(item.get('phase', 0.0))
        lean[:, i] += float(item['tilt']) * (np.cos(turned) + HIGH_SPOT * np.cos(2.0 * turned))
    return lean if lean.any() else None


def frame_error(causes: Causes, effect: str, t: np.ndarray) -> Motion:
    """Return the sum over entries of a displaced frame, switched or warmed in over (M,) times."""
    xyz, rotvec = np.zeros((2, len(t), 3))
    for item in causes.of(effect):
        if 'time' in item:
            share = (t >= float(item['time'])).astype(float)
        else:
            share = 1.0 - np.exp(-t / float(item['time_constant']))
        xyz += share[:, None] * np.asarray(item.get('xyz', (0.0, 0.0, 0.0)), dtype=float)
        rotvec += share[:, None] * np.asarray(item.get('rotvec', (0.0, 0.0, 0.0)), dtype=float)
    return screws.from_rotvec(rotvec, xyz)


def on_instrument(causes: Causes, pose: Motion, t: np.ndarray) -> Motion:
    """Return the pose as a knocked and distorting instrument has it."""
    pose = screws.compose(frame_error(causes, 'station_step', t), pose)
    position = pose.position
    for item in causes.of('quadratic_scale'):
        arm = pose.position - np.asarray(item.get('origin', (0.0, 0.0, 0.0)), dtype=float)
        far = np.linalg.norm(arm, axis=-1, keepdims=True)
        position = position + float(item['coefficient']) * far * arm
    return pose._replace(position=position)
