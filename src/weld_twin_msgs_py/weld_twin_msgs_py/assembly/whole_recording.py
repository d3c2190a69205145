# Copyright 2026 weld_twin contributors
# SPDX-License-Identifier: Apache-2.0
"""Streams of rows to a `Recording`, of static stations or of a motion."""

from collections.abc import Mapping
from typing import NamedTuple

import numpy as np

from weld_twin_core.arm.robot import Robot
from weld_twin_core.arrays import Array
from weld_twin_core.bursts import ONE_CLOCK, apart
from weld_twin_core.errors import DataError
from weld_twin_core.pose_noise import PoseNoise, alike, positive
from weld_twin_core.recording import (
    JointMotion,
    JointSignal,
    Measurements,
    Recording,
    Signal,
    backward_rates,
)

from .intake import PLAIN, Role, rotations

SPARSE = 0.5
"""Joint states further apart than this [s] say nothing of the motion between them."""
FAST = 10.0
"""Speed [rad/s or m/s] no arm reaches, for robots whose limits are not known."""
JUMP = 0.1
"""Joint states nearer than this [rad or m] may be late ones of the same arm."""
NEAR = 0.2
"""Share of such a jump from which it came back: each of two arms moves on little between two states."""
STRAY = 2
"""Joint states that a driver may garble."""
EVERY_OTHER, NEARLY_ALL = 0.4, 0.9
"""Share of the jumps that come back: of two arms in turn each second one does, less what falls out; of
stations all do, less a tenth, for an arm may go home now and then."""
AT_REST = 0.01
"""Speed [rad/s or m/s] that controllers still tell of an arm that stands."""
TOGETHER = 0.1
"""Share of the way to the next joint state within which a measurement belongs to its own, where some
joint states have none: a stream that runs beside lies anywhere."""


def looks_static(robot: Robot, motion: JointMotion, measured: Measurements | None) -> bool:
    """
    Return whether every joint state is a station at rest.

    Between stations the arm goes for long, or faster than it can by the stamps. Where something was
    measured, it was measured once at a joint state; where nothing was, no velocity tells of a motion.
    """
    if measured is None:
        if motion.qd is not None and (abs(motion.qd) > AT_REST).any():
            return False
    elif not _once_each(motion, measured):
        return False
    if motion.t.size == 1:
        return True
    steps = np.diff(motion.t)
    speeds = abs(np.diff(motion.q, axis=0)) / steps[:, None]
    goes = (speeds > AT_REST).any(axis=1)
    if goes.any():  # else it stands all the time, and readings at one station say nothing
        steps, speeds = steps[goes], speeds[goes]
    if np.median(steps) >= SPARSE:
        return True
    return bool((speeds > _fastest(robot)).any(axis=1).mean() > 0.5)


def _fastest(robot: Robot) -> Array:
    """Return speeds that no joint of a robot reaches, shape (n,) [rad/s or m/s]."""
    return 1.5 * np.where(np.isfinite(robot.max_velocity), robot.max_velocity, FAST)


def _refuse_two_arms(name: str, robot: Robot, motion: JointMotion, *, stations: bool) -> None:
    """
    Refuse joint states of two arms in turn, or of an arm and of a publisher that makes them up.

    They jump farther than the arm can by then, and at once back to near where they came from:
    every other jump or more. Of stations whose stamps mean nothing, nearly all must: an arm may go
    home between any two.
    """

    def away(start: np.ndarray, stop: np.ndarray) -> Array:
        way = motion.q[stop] - motion.q[start]
        turns = np.round(way / (2.0 * np.pi))
        return np.asarray(abs(way - np.where(robot.prismatic, 0.0, 2.0 * np.pi * turns)))

    every, steps = np.arange(motion.t.size), np.diff(motion.t)[:, None]
    way = away(every[:-1], every[1:])
    jumps = np.flatnonzero((way > np.maximum(_fastest(robot) * steps, JUMP)).any(axis=1))
    first, last = jumps[:-1], jumps[1:] + 1
    near = away(first, last).max(axis=1) < NEAR * way[first].max(axis=1)
    back = int((near & (motion.t[last] - motion.t[first] < SPARSE)).sum())
    if back > max(STRAY, (NEARLY_ALL if stations else EVERY_OTHER) * first.size):
        raise DataError(
            f'the joint states of {name} jump to another posture and back {back} times, faster than '
            'the arm moves: two publishers share their topic, such as those of two arms, or a '
            'joint_state_publisher beside the driver; end one of them, or give each its topic'
        )


def _once_each(motion: JointMotion, measured: Measurements) -> bool:
    """Return whether each measurement comes nearest to a joint state of its own."""
    if not 0 < measured.t.size <= motion.t.size:
        return False
    if motion.t.size == 1:
        return True
    own = motion.nearest(measured.t)
    if np.unique(own).size < own.size:
        return False
    steps = np.diff(motion.t)
    reach = np.concatenate([steps[:1], np.minimum(steps[:-1], steps[1:]), steps[-1:]])[own]
    share = 0.5 if measured.t.size == motion.t.size else TOGETHER
    return bool((abs(measured.t - motion.t[own]) <= share * reach).all())


LATE_WRENCH = 1.0
"""
A wrench that begins within this time [s] of the joint states was there from the start.

Its first sample is awaited then, and what was measured before it is left out. One that begins
later was switched on later.
"""


class Samples(NamedTuple):
    """Stamps, shape (N,) [int64 ns], strictly increasing, and rows, shape (N, width)."""

    ns: np.ndarray
    rows: Array


def assembled(
    name: str,
    robot: Robot,
    streams: Mapping[Role, Samples],
    *,
    wrench_frame: str = 'tool',
    static: bool | None = False,
    one_clock: bool = True,
    notes: tuple[str, ...] = (),
) -> Recording:
    """
    Return the recording that streams make; it counts from the first joint state.

    streams: rows as `Intake` gives them, the joints among them. Poses are used before points.
    static: whether the joint states are stations at rest; None looks at the stamps.
    one_clock: refuse measurements that have no time in common with the joint states.
    """
    epoch = int(streams[Role.JOINTS].ns[0])
    motion, effort = _motion(robot, streams[Role.JOINTS])
    measured, more = _measurements(streams, epoch)
    notes += more
    if not static:
        whole = looks_static(robot, motion, measured)
        _refuse_two_arms(name, robot, motion, stations=whole)
        static = whole if static is None else static
    if static:
        motion = JointMotion(motion.t, motion.q, static=True)
        notes += (f'{motion.t.size} static stations: the motion between them is not known',)
    elif measured is not None and one_clock:
        refuse_apart(motion, measured)
    wrench = streams.get(Role.WRENCH)
    if wrench is not None and not static:
        wrench, measured, said = _unloaded_before(wrench, epoch, measured)
        notes += said
    return Recording(
        name,
        motion,
        measured,
        _signal(wrench, epoch, static),
        wrench_frame,
        _signal(streams.get(Role.TEMPERATURE), epoch, static),
        epoch,
        notes,
        effort=effort,
    )


def _signal(samples: Samples | None, epoch: int, static: bool) -> Signal | None:
    """Return a side signal; stations have no timing, so none of them holds until the next."""
    if samples is None:
        return None
    rows = samples.rows[:, 0] if samples.rows.shape[1] == 1 else samples.rows
    return Signal(seconds(samples.ns, epoch), rows, held=not static)


def seconds(ns: np.ndarray, epoch: int) -> Array:
    """Return stamps [ns] as seconds since an epoch [ns]."""
    return np.asarray((ns - epoch) * 1e-9)


def _motion(robot: Robot, joints: Samples) -> tuple[JointMotion, JointSignal | None]:
    """Return the joint stream, with steps for velocities that lack, and its efforts if read."""
    t, n = seconds(joints.ns, int(joints.ns[0])), robot.n
    q, qd, effort = joints.rows[:, :n], joints.rows[:, n : 2 * n], joints.rows[:, 2 * n :]
    effort_signal = JointSignal(t, effort) if effort.size else None
    untold = np.isnan(qd).any(axis=1, keepdims=True)
    if untold.all():
        return JointMotion(t, q), effort_signal
    return JointMotion(t, q, np.where(untold, backward_rates(t, q), qd)), effort_signal


def _measurements(
    streams: Mapping[Role, Samples], epoch: int
) -> tuple[Measurements | None, tuple[str, ...]]:
    noise, said = None, tuple[str, ...]()
    if Role.POSE in streams:
        ns, rows = streams[Role.POSE]
        rotation, sigma = rotations(rows), rows[:, 7]
        noise, said = _noise(rows[:, PLAIN:].reshape(len(rows), -1, 6))
    elif Role.POINT in streams:
        ns, rows = streams[Role.POINT]
        rotation, sigma = None, np.full(ns.size, np.nan)
    else:
        return None, ()
    if Role.SIGMA in streams:
        sigma = _matched_sigma(ns, streams[Role.SIGMA], sigma)
    known = None if np.isnan(sigma).any() else sigma
    return Measurements(seconds(ns, epoch), rows[:, :3], rotation, known, noise), said


def _noise(covariance: Array) -> tuple[PoseNoise | None, tuple[str, ...]]:
    """Return how sure poses are in every direction, and what is to be said of it."""
    if covariance.shape[1] != 6 or not covariance.any() or alike(covariance):
        return None, ()
    if not positive(covariance).all():
        count = int((~positive(covariance)).sum())
        return None, (
            f'the covariance of {count} of {len(covariance)} poses is none of all six '
            'coordinates; how sure poses are in each direction is not taken into account',
        )
    return PoseNoise.of(covariance), ()


def _matched_sigma(ns: np.ndarray, given: Samples, sigma: Array) -> Array:
    """Return the sigma of the same stamp, its axes joined by their mean square."""
    at = np.clip(np.searchsorted(given.ns, ns), 0, given.ns.size - 1)
    same = given.ns[at] == ns
    return np.where(same, np.sqrt((given.rows[at] ** 2).mean(axis=1)), sigma)


def refuse_apart(motion: JointMotion, measured: Measurements) -> None:
    """Two clocks with nothing in common would silently pair everything with one joint state."""
    spans = [(float(t[0]), float(t[-1])) for t in (motion.t, measured.t)]
    sentence = apart(*spans)
    if sentence is not None:
        raise DataError(f'{sentence}. {ONE_CLOCK}')


def _unloaded_before(
    wrench: Samples, epoch: int, measured: Measurements | None
) -> tuple[Samples, Measurements | None, tuple[str, ...]]:
    """
    Return the wrench with no load before its first sample, and what can be compared with it.

    A live twin knows no load before it hears of one. What was measured meanwhile would show the
    load as a deviation.
    """
    late = (int(wrench.ns[0]) - epoch) * 1e-9
    if late <= 0.0:
        return wrench, measured, ()
    start = Samples(np.array([epoch], dtype=np.int64), np.zeros((1, 6)))
    whole = Samples(*(np.concatenate(pair) for pair in zip(start, wrench, strict=True)))
    if late > LATE_WRENCH:
        said = f'the wrench begins {late:.3f} s after the joint states; no load is taken before'
        return whole, measured, (said,)
    if measured is None:
        return whole, None, ()
    later = np.flatnonzero(measured.t >= late)
    count = measured.t.size - later.size
    if not count or not later.size:
        return whole, measured, ()
    said = f'{count} measurements from before the first wrench are left out'
    return whole, measured.take(later), (said,)
