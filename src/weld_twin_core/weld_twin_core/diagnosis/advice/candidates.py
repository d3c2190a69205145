# SPDX-FileCopyrightText: weld_twin contributors
# SPDX-License-Identifier: Apache-2.0
"""Measurements that could be made next: a motion, what is changed in the cell, the cost."""

from __future__ import annotations

from collections.abc import Iterator
from dataclasses import dataclass, replace

import numpy as np

from ...arm.robot import Robot
from ...arm.rotation import transform
from ...arrays import Array
from ...cubics import hermite, spline_slopes
from ...recording import JointMotion, Recording, Signal
from ...sequences import halton
from ..algebra.problem import Model, Problem

NAME = 'next measurement'
STATIONS = 60
"""Stations of a proposed measurement: a judgement of what somebody is ready to measure."""
STEP = 0.02
"""Approach of a station from either side [rad, m]."""
REACH = 1.3
"""The recorded range of every joint is widened by this factor, within its limits."""
LEAST = 0.35
"""Half the range [rad, m] that is used at least."""
MASS = 5.0
"""Load [kg] hung on the flange: a judgement; springs show, and most arms can carry it."""
LONGER = 0.2
"""Length [m] added to the tool: a turn of 0.1 mrad then moves its tip by 0.02 mm more."""
PRESS = 50.0
"""Force [N] on the tool: a judgement; a hand can press so hard."""
PASSES = (1.0, 0.5, 0.25)
"""Speeds of a sweep, as shares of the fastest."""
FASTEST = 0.5
"""Share of the joints' velocity limits that a sweep uses."""
EXTRA = 25.0
"""Cost [min] of a sweep where so far only stations were measured."""
RATE = 100.0
"""Samples per second that a sweep is predicted with."""


@dataclass(frozen=True, eq=False)
class Candidate:
    """
    A measurement that could be made.

    Attributes
    ----------
    kind, sentence : str
    cost : float [min]
    recording : Recording
        The motion, with side signals, without measurements.
    model : Model
        As the cell will be, without found effects; one base.
    new_base, new_tool : bool
        Whether the instrument or the tool is set up anew, so that its frame is not known.

    """

    kind: str
    sentence: str
    cost: float
    recording: Recording
    model: Model
    new_base: bool = False
    new_tool: bool = False


def candidates(problem: Problem, model: Model) -> Iterator[Candidate]:
    """Yield what could be measured next."""
    now = replace(model, bases=model.bases[:1], found=())
    spread = _spread(problem, model.robot, STATIONS)
    yield from _as_it_is(problem, now, spread)
    yield from _changed(problem, now, spread[: STATIONS // 3])


def _as_it_is(problem: Problem, now: Model, spread: Array) -> Iterator[Candidate]:
    """Yield measurements that leave the cell as it is."""
    still = all(r.joints.static for r in problem.recordings)
    yield Candidate(
        'speed_sweep',
        'Run one path forth and back at three speeds and record joints and tool all the way.',
        EXTRA if still else 5.0,
        _with_sides(problem, sweep(problem, now.robot)),
        now,
    )
    yield Candidate(
        'stations',
        f'Measure {len(spread)} stations at rest, spread over a wider part of the workspace.',
        15.0,
        _stations(problem, spread),
        now,
    )
    both = spread[: len(spread) // 4]
    yield Candidate(
        'bidirectional',
        f'Measure {len(both)} stations at rest, each approached from both sides of every joint.',
        20.0,
        _stations(problem, _both_sides(both)),
        now,
    )
    again = np.concatenate([spread[:5]] * (len(spread) // 5))
    yield Candidate(
        'warm_up',
        'Measure five stations again and again for an hour while the arm warms up.',
        60.0,
        _stations(problem, again, 60.0, rise=15.0),
        now,
    )


def _changed(problem: Problem, now: Model, few: Array) -> Iterator[Candidate]:
    """Yield the same stations with something changed in the cell."""
    robot, recording = now.robot, _stations(problem, few)
    words = f'Measure {len(few)} stations'
    if any(r.wrench is not None for r in problem.recordings):
        yield Candidate(
            'press',
            f'{words} while the tool is pressed with {PRESS:g} N along x, y and z in turn.',
            25.0,
            _pressed(recording),
            now,
        )
    heavy = replace(robot, payload_mass=robot.payload_mass + MASS)
    yield Candidate(
        'payload_swap',
        f'{words} with {MASS:g} kg more on the flange, entered as payload.',
        30.0,
        recording,
        replace(now, robot=heavy),
    )
    longer = robot.T_flange_tool @ transform(np.eye(3), np.array([0.0, 0.0, LONGER]))
    yield Candidate(
        'longer_tool',
        f'{words} with a tool {LONGER * 1e3:g} mm longer.',
        40.0,
        recording,
        replace(now, robot=robot.with_frames(tool=longer)),
        new_tool=True,
    )
    base = transform(np.eye(3), np.array([1.5, 0.5, 0.0])) @ now.bases[0]
    yield Candidate(
        'moved_instrument',
        f'Move the instrument by 1.5 m. {words}.',
        45.0,
        recording,
        replace(now, bases=(base,)),
        new_base=True,
    )


def _stations(problem: Problem, q: Array, seconds: float = 15.0, rise: float = 0.0) -> Recording:
    """Return stations every so many seconds, while it grows warmer by a rise [K]."""
    t = seconds * np.arange(len(q), dtype=np.float64)
    recording = _with_sides(problem, JointMotion(t, q, static=True))
    if recording.temperature is None:
        return recording
    ramp = recording.temperature.value[0] + np.linspace(0.0, rise, t.size)
    return replace(recording, temperature=Signal(t, ramp))


def _with_sides(problem: Problem, joints: JointMotion) -> Recording:
    """Return a recording of a motion, as warm and as loaded as those at hand were on average."""
    ends = joints.t[[0, -1]]
    warm = [r.temperature.value.mean() for r in problem.recordings if r.temperature is not None]
    load = [
        (r.wrench.value.mean(axis=0), r.wrench_frame)
        for r in problem.recordings
        if r.wrench is not None
    ]
    heat = Signal(ends, np.full(2, np.mean(warm))) if warm else None
    if not load:
        return Recording(NAME, joints, temperature=heat)
    wrench = Signal(ends, np.stack([load[0][0]] * 2))
    return Recording(NAME, joints, wrench=wrench, wrench_frame=load[0][1], temperature=heat)


def widened(problem: Problem, robot: Robot) -> tuple[Array, Array]:
    """
    Return the least and the most of every joint that a proposal uses, shape (n,) each.

    The recorded range, a little wider, within the limits.

    Parameters
    ----------
    problem : Problem
    robot : Robot

    """
    q = np.concatenate([r.joints.q for r in problem.recordings])
    middle = 0.5 * (q.min(axis=0) + q.max(axis=0))
    half = np.maximum(REACH * 0.5 * np.ptp(q, axis=0), LEAST)
    inset = np.where(np.isfinite(robot.upper - robot.lower), STEP, 0.0)
    low = np.maximum(middle - half, robot.lower + inset)
    high = np.maximum(np.minimum(middle + half, robot.upper - inset), low)
    return np.asarray(low), np.asarray(high)


def _spread(problem: Problem, robot: Robot, count: int) -> Array:
    """Return stations that fill the range evenly, shape (count, n)."""
    low, high = widened(problem, robot)
    unit = halton(robot.n, count)
    return np.asarray(low + unit * (high - low))


def _both_sides(stations: Array) -> Array:
    """Return every station after a step up to it and after a step down to it."""
    approach = np.array([[-STEP], [0.0], [STEP], [0.0]])
    return np.asarray(np.repeat(stations, 4, axis=0) + np.tile(approach, (len(stations), 1)))


def sweep(problem: Problem, robot: Robot) -> JointMotion:
    """Return one path forth and back at three speeds, from rest to rest."""
    low, high = widened(problem, robot)
    turn = np.linspace(0.0, 1.0, 7)
    joint = np.arange(robot.n)
    phase = turn[:, None] * (1 + joint % 3) + joint / 7.0
    waves = np.sin(2.0 * np.pi * phase)
    knots = 0.5 * (low + high) + 0.25 * (high - low) * waves
    slopes = spline_slopes(turn, knots)
    fine = hermite(turn, knots, slopes, np.linspace(0.0, 1.0, 500))[1]
    finite = np.where(np.isfinite(robot.max_velocity), robot.max_velocity, 1.0)
    # s = (1 - cos)/2 is pi/2 times faster than its mean.
    fastest = 0.5 * np.pi * float((np.abs(fine) / finite).max()) / FASTEST
    shares, times, start = [], [], 0.0
    for speed in PASSES:
        span = 2.0 * fastest / speed
        t = np.arange(0.0, span, 1.0 / RATE)
        shares.append(0.5 * (1.0 - np.cos(2.0 * np.pi * t / span)))
        times.append(start + t)
        start += t[-1] + 1.0 / RATE
    return JointMotion(
        np.concatenate(times), hermite(turn, knots, slopes, np.concatenate(shares))[0]
    )


def _pressed(recording: Recording) -> Recording:
    t = recording.joints.t
    force = np.zeros((t.size, 6))
    force[np.arange(t.size), np.arange(t.size) % 3] = PRESS
    return replace(recording, wrench=Signal(t, force), wrench_frame='base')
