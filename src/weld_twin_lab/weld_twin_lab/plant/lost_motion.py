# Copyright 2026 weld_twin contributors
# SPDX-License-Identifier: Apache-2.0
"""
Lost motion in drives and gears, contact by contact; and causes beside the textbook.

friction
    Bristles between the rubbing parts bend over `PRESLIDING` and break away into Coulomb friction,
    a little higher at slow speed (Stribeck). A loop without integral action yields to the friction
    with a lag of its own, and creep lets the bend go while the joint rests.
hysteresis
    Tooth contacts side by side (Iwan): each is a spring behind a dry slider, and they let go one
    after the other, the last after twice the travel. A reversal has to bend each of them back, so
    small swings make small closed loops.
gear_ratio_by_direction
    Two flanks, each cut on a circle of its own that is a little off the axis: the nearer the end of
    the travel, the less the ratio is off. Teeth cross one after the other, the last after `CROSSED`.

Most of the others no library knows, and a diagnosis should say unknown. `bearing_tilt` and
`loaded_play` have names in the library by now, with formulas of their own.

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
from scipy.spatial.transform import Rotation

from . import exponentials
from .exponentials import Entry, Motion
from .flaws import Here, flaw

PRESLIDING = 3e-4
"""Travel [rad] over which bristles bend."""
STRIBECK, CREEPING = 0.15, 0.02
"""Share by which friction is higher at breakaway, and the speed [rad/s] at which that fades."""
CREEP, STILL = 0.05, 1e-3
"""Time [s] in which bristles at rest let go, and the speed [rad/s] that is none."""
LOOP = 0.004
"""Lag [s] of a loop that yields to friction."""
CROSSED = 1.5e-4
"""Half the travel [rad] after which the last of the teeth is on the other flank."""
ROUND = 4.0
"""Radius [rad] of the curve that the error of a flank follows."""
CONTACTS = 10
"""Tooth contacts; their shares are alike and their travels evenly spread."""


@flaw('joint')
def friction(entry: Entry, here: Here) -> np.ndarray:
    """Return the wind-up of a drive that rubs."""
    uneven, q = float(entry.get('asymmetry', 0.0)), here.q[:, here.causes.joint(entry['joint'])]
    return -float(entry['windup']) * _rubbing(here.t, q, uneven, here.richness)


@flaw('joint')
def hysteresis(entry: Entry, here: Here) -> np.ndarray:
    """Return the wind-up of a gear whose teeth let go one after the other."""
    q = here.q[:, here.causes.joint(entry['joint'])]
    return -float(entry['amplitude']) * _contacts(q, float(entry['travel']))


@flaw('joint')
def gear_ratio_by_direction(entry: Entry, here: Here) -> np.ndarray:
    """Return the error of the flank in contact."""
    q = here.q[:, here.causes.joint(entry['joint'])]
    return 0.5 * float(entry['difference']) * _flanks(q, here.richness)


def _flanks(q: np.ndarray, richness: float) -> np.ndarray:
    """Return the error of the flank in contact, over that of the ratio, shape (N,) [rad]."""
    bend = ROUND / max(richness, 1e-3)
    return np.asarray(_contacts(q, 0.5 * CROSSED) * bend * np.sin(q / bend))


def _rubbing(t: np.ndarray, q: np.ndarray, uneven: float, richness: float) -> np.ndarray:
    """Return the friction that a loop has yielded to, over that of Coulomb, shape (N,)."""
    dt = np.diff(t, prepend=t[0])
    step = np.diff(q, prepend=q[0])
    speed = np.abs(np.divide(step, dt, out=np.zeros_like(step), where=dt > 0.0))
    way = np.sign(step)
    fade = np.exp(-((speed / CREEPING) ** 2))
    target = way * (1.0 + uneven * way) * (1.0 + STRIBECK * richness * fade)
    bend = np.exp(-np.abs(step) / PRESLIDING)
    rest = np.exp(-dt / CREEP * np.exp(-((speed / STILL) ** 2)))
    follow = -np.expm1(-dt / (LOOP * max(richness, 1e-3)))
    force = yielded = 0.0
    out = []
    # Plain numbers: an entry of an array costs several times as much as what is done with it.
    for b, w, r, f in zip(*(each.tolist() for each in (bend, target, rest, follow)), strict=True):
        force = (force * b + w * (1.0 - b)) * r
        yielded += f * (force - yielded)
        out.append(yielded)
    return np.array(out)


def _contacts(q: np.ndarray, travel: float) -> np.ndarray:
    """Return the mean of the contacts' forces over what they let go at, shape (N,)."""
    gives = 2.0 * travel * (np.arange(CONTACTS) + 0.5) / CONTACTS
    bent, least = np.zeros(CONTACTS), -gives
    out = np.empty((q.size, CONTACTS))
    for row, step in zip(out, np.diff(q, prepend=q[0]).tolist(), strict=True):
        np.add(bent, step, out=bent)
        np.maximum(bent, least, out=bent)
        np.minimum(bent, gives, out=bent)
        row[:] = bent
    return np.asarray((out / gives).mean(axis=1))


@flaw('tool')
def wear(entry: Entry, here: Here) -> np.ndarray:
    """
    Return the tool's tip as wear has drawn it back along its z.

    The rate is that of the first second, and falls off with the time constant `slower` [s].
    """
    back, slower = np.zeros((len(here.t), 6)), float(entry.get('slower', 1e6))
    back[:, 2] = float(entry['rate']) * slower * np.expm1(-here.t / slower)
    return back


FLAT = 0.4
"""Share by which a bracket of sheet metal bends less about its second axis."""
ROUNDS = 3
"""Times that the balance is sought anew; the bar turns by a milliradian, so two would do."""


@flaw('tool')
def tool_sag(entry: Entry, here: Here) -> np.ndarray:
    """
    Return how the torch has turned about its bracket, and its tip with it.

    bend: way of the tip [m] where the torch is level.
    lever: from the bracket to the tip, in the tool frame, shape (3,) [m].
    """
    lever = np.asarray(entry['lever'], dtype=float)
    length = np.linalg.norm(lever)
    soft = float(entry['bend']) / length * np.array([1.0, 1.0 - FLAT * here.richness, 1.0])
    flange = exponentials.flange(here.arm, exponentials.home(here.arm), here.q)
    weight = -exponentials.compose(flange, here.arm.tool).rotation[..., 2, :]
    turn = np.zeros((len(here.q), 3))
    for _ in range(ROUNDS):
        bar = Rotation.from_rotvec(turn).apply(lever)
        turn = soft * np.cross(bar / length, weight)
    return np.hstack([Rotation.from_rotvec(turn).apply(lever) - lever, turn])


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
