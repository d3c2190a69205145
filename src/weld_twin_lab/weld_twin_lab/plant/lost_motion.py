# Copyright 2026 weld_twin contributors
# SPDX-License-Identifier: Apache-2.0
"""
Friction in a drive and hysteresis in a gear, contact by contact.

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
"""

import numpy as np
from scipy.spatial.transform import Rotation

from . import exponentials
from .exponentials import Entry
from .flaws import Here, flaw

PRESLIDING = 3e-4
"""Travel [rad] over which bristles bend."""
STRIBECK, SLOW = 0.15, 0.02
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
    fade = np.exp(-((speed / SLOW) ** 2))
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
