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

import numpy as np

from . import exponentials
from .exponentials import Entry, Motion
from .flaws import Here, flaw

STUCK_AFTER = 0.3
"""Share of the wind-up that a jump leaves."""
SLOW = 0.01
"""Joint speed [rad/s] below which friction gives way smoothly."""
HIGH_SPOT = 0.1
"""Share of the lean of a bearing that comes twice per turn."""
FLANK_TORQUE = 0.1
"""Share of the recording's largest load at which the flank is certain, where no torque is given."""


@flaw('joint')
def friction_wander(entry: Entry, here: Here) -> np.ndarray:
    """Return lost motion of wandering size."""
    t, q = here.t, here.q[:, here.causes.joint(entry['joint'])]
    level = _wander(t, float(entry['time_constant']), here.rng)
    rate = np.gradient(q, t) if len(t) > 1 else np.zeros(1)
    return np.asarray(float(entry['amplitude']) * level * np.tanh(rate / SLOW))


@flaw('joint')
def loaded_play(entry: Entry, here: Here) -> np.ndarray:
    """Return the flank that the load pulls a gear to."""
    load = here.torque()[:, here.causes.joint(entry['joint'])]
    sure = float(entry.get('torque') or FLANK_TORQUE * np.abs(load).max()) + 1e-12
    return np.asarray(0.5 * float(entry['width']) * np.tanh(load / sure))


@flaw('joint')
def dress_pack(entry: Entry, here: Here) -> np.ndarray:
    """Return how far a hose pulls the joint back."""
    q = here.q[:, here.causes.joint(entry['joint'])]
    middle = float(entry.get('middle', np.mean(q)))
    reach = float(entry.get('reach', np.ptp(q) / 2.0)) + 1e-12
    return np.asarray(-float(entry['amplitude']) * ((q - middle) / reach) ** 3)


@flaw('joint')
def stick_slip(entry: Entry, here: Here) -> np.ndarray:
    """Return the lag of a link that sticks until the wind-up jumps it forward."""
    q, amplitude = here.q[:, here.causes.joint(entry['joint'])], float(entry['amplitude'])
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


@flaw('axis')
def bearing_tilt(entry: Entry, here: Here) -> np.ndarray:
    """Return the lean of an axis as its bearing turns."""
    turned = here.q[:, here.causes.joint(entry['joint'])] + float(entry.get('phase', 0.0))
    return np.asarray(float(entry['tilt']) * (np.cos(turned) + HIGH_SPOT * np.cos(2.0 * turned)))


def _come(entry: Entry, t: np.ndarray) -> np.ndarray:
    """Return a displaced frame, switched or warmed in over (M,) times, shape (M, 6)."""
    if 'time' in entry:
        share = (t >= float(entry['time'])).astype(float)
    else:
        share = 1.0 - np.exp(-t / float(entry['time_constant']))
    off = [*entry.get('xyz', (0.0, 0.0, 0.0)), *entry.get('rotvec', (0.0, 0.0, 0.0))]
    return np.asarray(share[:, None] * np.asarray(off, dtype=float))


@flaw('base')
def column_bend(entry: Entry, here: Here) -> np.ndarray:
    """Return how the base leans over as the column warms up."""
    return _come(entry, here.t)


@flaw('tool')
def tool_slip(entry: Entry, here: Here) -> np.ndarray:
    """Return how the tool slips in its holder."""
    return _come(entry, here.t)


@flaw('stand')
def station_step(entry: Entry, here: Here, pose: Motion) -> Motion:
    """Return the pose in a measuring frame that was knocked."""
    off = _come(entry, here.t)
    return exponentials.compose(exponentials.from_rotvec(off[:, 3:], off[:, :3]), pose)


@flaw('sight')
def quadratic_scale(entry: Entry, here: Here, pose: Motion) -> Motion:
    """Return the pose stretched with its own length."""
    arm = pose.position - np.asarray(entry.get('origin', (0.0, 0.0, 0.0)), dtype=float)
    far = np.linalg.norm(arm, axis=-1, keepdims=True)
    return pose._replace(position=pose.position + float(entry['coefficient']) * far * arm)
