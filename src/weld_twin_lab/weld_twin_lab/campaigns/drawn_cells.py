# Copyright 2026 weld_twin contributors
# SPDX-License-Identifier: Apache-2.0
"""Arms with drawn causes, what a diagnosis learns of them, and the goals they are given."""

from __future__ import annotations

from collections.abc import Iterable, Iterator
from typing import Any, NamedTuple

import numpy as np

from weld_twin_core.arm.catalog import load
from weld_twin_core.arm.chain import forward
from weld_twin_core.arm.robot import Robot
from weld_twin_core.arm.rotation import rotation_matrix
from weld_twin_core.arrays import Array
from weld_twin_core.diagnosis import diagnose
from weld_twin_core.effects import Effect, effects_from_list
from weld_twin_core.errors import DataError
from weld_twin_core.motion.inverse.newton import polish
from weld_twin_core.recording import JointMotion, Measurements, Recording
from weld_twin_core.twin.goal_motion import Goal, course
from weld_twin_core.twin.twin import Twin
from weld_twin_report.report.diagnosis_files import diagnosis_text

NOTHING = 'nothing'
"""The change that is none."""
CHANGES = ('clock jumped', 'load changed', 'wrong model', 'tracker lost')
HOMES: dict[str, tuple[float, ...]] = {
    'ur5': (0.1, -1.2, 1.5, -1.8, -1.5, 0.3),
    'ur10e': (0.2, -1.3, 1.6, -1.9, -1.4, 0.2),
    'kuka_kr16_2': (0.1, -1.3, 1.5, 0.3, 0.8, 0.2),
    'abb_irb1600': (0.1, 0.3, 0.1, 0.4, 0.8, 0.3),
    'fanuc_m10ia': (0.2, 0.3, 0.2, 0.3, -0.9, 0.2),
    'abb_irb120': (0.1, 0.3, 0.1, 0.3, 0.9, 0.2),
}
"""Six arms, each in a posture from which its joints can go either way."""
RECORDED = 0.6
"""How far from there joints are recorded [rad]."""
INSIDE, OUTSIDE = 0.35, 0.95
"""How far from there goals begin [rad]: among what was recorded, and not."""
FAR = 0.15
"""Share of the goals that begin where nothing was recorded."""
SECONDS, RATE = 40.0, 50.0
"""Length and rate of what a diagnosis learns from [s, 1/s]."""
NOISE = (2e-5, 1e-4)
"""Standard deviation of a measured coordinate there [m]: a laser tracker, a good camera."""
REST = (5e-6, 5e-5)
"""Size of what joints are off by besides their causes [rad], from arm to arm: a gear of a new robot is
within 0.03 mrad of even, an encoder within 0.01. Links are off by as much at half a metre."""
LEVER = 0.5
"""Length of a link [m] that turns the one into the other."""
FINE = (5, 20)
"""Least and largest order of an error of a gear that bends faster than a model follows [1/rev]."""
FINE_SHARE = 0.3
"""Part of the size that this error has: teeth are cut finer than wheels are centred."""
TRIES = 200
"""Goals that are drawn for an arm before it is given up: many are out of its reach."""


class Arm(NamedTuple):
    name: str
    seed: int
    """Decides what it is off by, what is learned of it, and its goals."""
    changed: bool
    """Whether its cell is changed after the goals."""

    def of(self, rows: Iterable[dict[str, Any]]) -> list[dict[str, Any]]:
        return [row for row in rows if (row['robot'], row['arm']) == (self.name, self.seed)]


class Known(NamedTuple):
    """What became of goals, of changes, and of goals without a cell, so far."""

    rows: list[dict[str, Any]]
    changes: list[dict[str, Any]]
    without: list[dict[str, Any]]


class DrawnGoal(NamedTuple):
    goal: Goal
    inside: bool


class Learned(NamedTuple):
    text: str
    """The diagnosis.json."""
    noise: float
    """Standard deviation of a coordinate of the instrument that it was learned with [m]."""


def drawn_causes(robot: Robot, rng: np.random.Generator) -> list[dict[str, Any]]:
    """Return three causes of a usual size, two constants and one that hangs on the posture or way."""
    joints = robot.joint_names
    signs = rng.choice([-1.0, 1.0], 2)
    first: dict[str, Any] = {'effect': 'joint_offset', 'joint': joints[int(rng.integers(1, 4))]}
    first['offset'] = float(signs[0] * rng.uniform(4e-4, 1.2e-3))
    second: dict[str, Any] = {'effect': 'link_twist', 'joint': joints[int(rng.integers(0, 4))]}
    second['dalpha'] = float(signs[1] * rng.uniform(3e-4, 8e-4))
    at = joints[int(rng.integers(0, 3))]
    others: list[dict[str, Any]] = [
        {'effect': 'backlash', 'joint': at, 'width': float(rng.uniform(3e-4, 8e-4))},
        {
            'effect': 'transmission_ripple',
            'joint': at,
            'amplitude': float(rng.uniform(2e-4, 5e-4)),
            'order': 2.0,
            'phase': float(rng.uniform(-1.5, 1.5)),
        },
        {'effect': 'joint_compliance', 'joint': joints[1], 'compliance': rng.uniform(3e-6, 8e-6)},
    ]
    if not np.any(robot.mass):
        others.pop()
    return [first, second, others[int(rng.integers(len(others)))]]


def drawn_rest(robot: Robot, rng: np.random.Generator) -> list[dict[str, Any]]:
    """Return what every joint and link of a real arm is off by besides: no cause worth a name."""
    size = float(np.exp(rng.uniform(*np.log(REST))))
    out: list[dict[str, Any]] = []
    for joint in robot.joint_names:
        out += [
            {'effect': 'joint_offset', 'joint': joint, 'offset': float(rng.normal(scale=size))},
            {'effect': 'link_twist', 'joint': joint, 'dalpha': float(rng.normal(scale=size))},
            {'effect': 'link_length', 'joint': joint, 'da': LEVER * float(rng.normal(scale=size))},
        ]
        fine = float(rng.integers(FINE[0], FINE[1] + 1))
        out += [
            {
                'effect': 'transmission_ripple',
                'joint': joint,
                'amplitude': share * abs(float(rng.normal(scale=size))),
                'order': order,
                'phase': float(rng.uniform(-np.pi, np.pi)),
            }
            for order, share in ((1.0, 1.0), (2.0, 1.0), (fine, FINE_SHARE))
        ]
    return out


def learned(robot: Robot, causes: list[dict[str, Any]], rng: np.random.Generator) -> Learned:
    t = np.arange(0.0, SECONDS, 1.0 / RATE)
    pace = rng.uniform(0.5, 1.3, robot.n)
    turn = rng.uniform(0.0, 2.0 * np.pi, robot.n)
    q = np.array(HOMES[robot.name]) + RECORDED * np.sin(np.outer(t, pace) + turn)
    commanded = Recording('learning', JointMotion(t, np.clip(q, robot.lower, robot.upper)))
    real = Twin(robot, effects_from_list(causes, robot)).poses(commanded)
    noise = float(rng.choice(NOISE))
    errors = rng.normal(scale=noise, size=real.position.shape)
    seen = Measurements(t, real.position + errors, real.rotation)
    diagnosis = diagnose([commanded.with_measured(seen)], robot, experiment=False)
    return Learned(diagnosis_text(diagnosis, ()), noise)


def right_and_wrong(arm: Arm) -> tuple[Learned, Learned | None]:
    """Return what is learned of an arm, and of one of its kind with other causes if it is changed."""
    robot, causes, rng = cell_of(arm.name, arm.seed)
    right = learned(robot, causes, rng)
    return right, learned(robot, drawn_causes(robot, rng), rng) if arm.changed else None


def arms_of(goals: int, each: int, seed: int) -> list[Arm]:
    """Return arms that have so many goals each, all kinds in turn; the first of a kind is changed."""
    kinds = [*HOMES]
    return [Arm(kinds[k % len(kinds)], seed + k, k < len(kinds)) for k in range(-(-goals // each))]


def drawn_goal(robot: Robot, rng: np.random.Generator) -> DrawnGoal:
    """Return a straight or bent seam, there or there and back; raises DataError where none will do."""
    home, inside = np.array(HOMES[robot.name]), bool(rng.random() >= FAR)
    bare = robot.with_frames(base=np.eye(4))
    for _ in range(TRIES):
        begin = home + rng.uniform(-INSIDE, INSIDE, robot.n)
        if not inside:
            joint = int(rng.integers(0, 5))
            begin[joint] = home[joint] + rng.choice([-1.0, 1.0]) * OUTSIDE
        goal = _along(bare, begin, rng)
        if goal is None:
            continue
        way = course(goal, np.linspace(goal.t[0], goal.t[-1], 200))
        if (way.q < robot.lower).any() or (way.q > robot.upper).any():
            continue
        if inside and np.abs(way.q - home).max() > RECORDED:
            continue
        return DrawnGoal(goal, inside)
    raise DataError(f'no goal drawn for {robot.name} can be travelled')


def _along(bare: Robot, begin: Array, rng: np.random.Generator) -> Goal | None:
    """Return the goal of a seam that begins in a posture; None where the arm does not follow."""
    length, speed = rng.uniform(0.05, 0.25), rng.uniform(0.02, 0.08)
    count, back = int(rng.integers(15, 60)), bool(rng.random() < 0.3)
    way, bow = rng.normal(size=(2, 3))
    way, bow = way / np.linalg.norm(way), 0.2 * bow / np.linalg.norm(bow)
    span = 1.6 * length / speed
    t = np.linspace(0.0, span, count)
    s = 0.5 - 0.5 * np.cos(np.pi * t / span)
    if back:
        s = 0.5 - 0.5 * np.cos(2.0 * np.pi * t / span)
    start = forward(bare, begin)
    poses = np.repeat(start[None], count, axis=0)
    poses[:, :3, 3] += length * (s[:, None] * way + (s * (1.0 - s))[:, None] * bow)
    poses[:, :3, :3] = rotation_matrix(0.2 * s[:, None] * bow) @ poses[:, :3, :3]
    q = np.empty((count, bare.n))
    at = begin
    for k in range(count):
        (at,), remaining = polish(bare, at[None], poses[k : k + 1])
        if np.abs(remaining).max() > 1e-10:
            return None
        q[k] = at
    if np.abs(np.diff(q, axis=0)).max() > 0.2:
        return None
    qd: Array = np.asarray(np.gradient(q, t, axis=0, edge_order=2))
    qd[0] = qd[-1] = 0.0
    return Goal(t, q, qd) if rng.random() < 0.7 else Goal(t, q)


def goals_of(of: Arm, first: int, count: int) -> Iterator[DrawnGoal]:
    """Yield goals of an arm, counted from 0; each is the same whichever were drawn before it."""
    robot, kind = load(of.name), sorted(HOMES).index(of.name)
    for k in range(first, first + count):
        yield drawn_goal(robot, np.random.default_rng([of.seed, kind, k]))


def cell_of(name: str, seed: int) -> tuple[Robot, list[dict[str, Any]], np.random.Generator]:
    """Return an arm, all that it is off by, and what draws all else of its cell."""
    rng = np.random.default_rng([seed, sorted(HOMES).index(name)])
    robot = load(name)
    return robot, drawn_causes(robot, rng) + drawn_rest(robot, rng), rng


def true_effects(robot: Robot, causes: list[dict[str, Any]]) -> tuple[Effect, ...]:
    return tuple(effects_from_list(causes, robot))
