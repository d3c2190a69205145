# Copyright 2026 weld_twin contributors
# SPDX-License-Identifier: Apache-2.0
"""
The plant: the cell as it really is, standing in for one on the shop floor.

Order of things: command -> servo and flywheel (`drives`) -> gearing (`flaws`) -> gap and spring
under load (`tree`, `compliance`) -> geometry as built (`exponentials`) -> tool under load ->
instrument and clocks (`tracker`). Nothing here is shared with the twin that is to diagnose it.
"""

import json
from collections.abc import Callable, Sequence
from dataclasses import dataclass
from functools import cached_property, lru_cache, partial
from typing import Any

import numpy as np
from scipy.interpolate import CubicSpline

from . import compliance, drives, exponentials, flaws, mujoco_model, tree
from . import tracker as sensors
from .compliance import Compliant, Pedestal
from .exponentials import Arm, Command, Course, Entry, Motion, PlantRecording
from .flaws import Causes, Here
from .tracker import Tracker

KNOWN = flaws.known()
KEPT = 4
"""Cells kept with what was simulated of them: a study records one motion with the same flaws several
times, once for each instrument, and MuJoCo would say the same each time."""


@dataclass(frozen=True, eq=False)
class _Cell:
    """One robot with its flaws and one command."""

    robot: Entry
    arm: Arm
    causes: Causes
    course: Course
    richness: float

    @property
    def start(self) -> float:
        """The recording's first stamp [s]."""
        return float(self.course.command.t[0])

    @cached_property
    def compliant(self) -> Compliant:
        """What gives between motors and links."""
        return Compliant(self.robot, self.arm, self.causes, self.richness)

    @cached_property
    def lost(self) -> CubicSpline | None:
        """How far the motors are from the command, over time."""
        return drives.displacement(self.causes, self.course, self.richness)

    @cached_property
    def grid(self) -> np.ndarray:
        """The instants at which the moving arm is simulated [s]."""
        times = self.course.command.t
        return mujoco_model.grid(times[0], times[-1], tree.STEP)

    @cached_property
    def geared(self) -> np.ndarray:
        """The positions behind the gears at these instants, shape (N, n)."""
        motor = self.course.q(self.grid) + (0.0 if self.lost is None else self.lost(self.grid))
        return np.asarray(motor + flaws.gearing(self.causes, motor))

    @cached_property
    def pull(self) -> np.ndarray | None:
        """The wrench on the tool there, hoses with it, shape (N, 6)."""
        return self.with_hoses(self.geared, self.course.wrench(self.grid))

    def with_hoses(self, q: np.ndarray, wrench: np.ndarray | None) -> np.ndarray | None:
        """Return a wrench on the tool at positions q with what the hoses add to it."""
        return compliance.with_hoses(self.causes, self.arm, q, wrench)

    @cached_property
    def torque(self) -> np.ndarray:
        """The load torque there, shape (N, n)."""
        return self.compliant.torque(self.geared, self.pull)

    @cached_property
    def sprung(self) -> np.ndarray | float:
        """What gaps and springs give there, shape (N, n)."""
        if self.compliant.rigid:
            return 0.0
        motor = CubicSpline(self.grid, self.geared)
        return tree.moving(self.compliant, self.grid, motor, self.pull)

    @cached_property
    def pedestal(self) -> Pedestal:
        return Pedestal(self.compliant, self.causes)

    def seen(self, t: np.ndarray, rng: np.random.Generator) -> Motion:
        """
        Return `true_poses`, worked out once for the same instants and the same chance.

        A recording with noise, the same without, and the same again are asked for one by one.
        """
        chance = rng.bit_generator
        key = t.tobytes(), repr(chance.state)
        if key not in self._seen:
            pose = true_poses(self, t, rng)
            self._seen[key] = pose, chance.state
        pose, chance.state = self._seen[key]
        return pose

    @cached_property
    def _seen(self) -> dict[tuple[bytes, str], tuple[Motion, Any]]:
        return {}

    def here(self, t: np.ndarray, q: np.ndarray, rng: np.random.Generator, **more: Any) -> Here:
        """Return what a flaw sees at true times (M,) [s] and motor positions (M, n)."""
        return Here(self.causes, self.arm, t - self.start, q, self.richness, rng, **more)

    def leaned(self, t: np.ndarray) -> Motion:
        """Return how the base has turned at true times (M,) [s], in its own frame."""
        if self.pedestal.stiff:
            return exponentials.identity()
        command = self.course.command
        if command.static:
            q = command.q + flaws.gearing(self.causes, command.q)
            at = np.searchsorted(command.t, t)
            return self.pedestal.at_rest(q[at], self.course.wrench(t))
        motor = CubicSpline(self.grid, self.geared)
        return self.pedestal.moving(self.grid, motor, self.course.wrench(self.grid), t)


def run(
    robot: Entry,
    effects: Sequence[Entry],
    command: Command,
    tracker: Tracker,
    rng: np.random.Generator,
    richness: float = 1.0,
) -> PlantRecording:
    """
    Move a robot with flaws and record it.

    robot: a robot file, as docs/conventions.md has it.
    effects: the flaws, as in an effects file; also those that no library knows.
    richness: how far the physics of servo, gap, spring and flywheel goes beyond the textbook form
    of the effect: 0 is the textbook, 1 a plausible machine.
    """
    if not 0.0 <= richness <= 3.0:
        raise ValueError(f'richness must be within 0 and 3, got {richness}')
    described = json.dumps(
        [robot, list(effects)], default=lambda value: np.asarray(value).tolist()
    )
    return _record(_cell(described, command, richness), tracker, rng)


@lru_cache(maxsize=KEPT)
def _cell(described: str, command: Command, richness: float) -> _Cell:
    robot, effects = json.loads(described)
    arm = exponentials.arm_from(robot)
    if command.q.shape[1] != len(arm.names):
        raise ValueError(
            f'the command moves {command.q.shape[1]} joints, the robot has {len(arm.names)}'
        )
    causes = flaws.causes_from(effects, arm, KNOWN)
    return _Cell(robot, arm, causes, Course(command), richness)


def _record(cell: _Cell, instrument: Tracker, rng: np.random.Generator) -> PlantRecording:
    command, static = cell.course.command, cell.course.command.static
    if static:
        # a lost station is lost on both sides: one joint state, one measurement each
        t = t_joint = command.t[sensors.kept(len(command.t), instrument.drop, rng)]
        stamps, joint_stamps = t.copy(), t.copy()
    else:
        t = sensors.instants(command.t, instrument.rate, instrument.drop, rng)
        stamps = sensors.stamped(t, instrument.jitter, rng)
        t_joint = sensors.instants(command.t, instrument.joint_rate, instrument.joint_drop, rng)
        joint_stamps = sensors.stamped(t_joint, instrument.joint_jitter, rng)
    pose = cell.seen(t, rng)
    floors = [float(item['sigma']) for item in cell.causes.of('measurement_noise')]
    sigma = float(np.linalg.norm([instrument.sigma, *floors]))
    position, quaternion = sensors.observe(instrument, pose, sigma, rng)
    wrench_t, wrench = sensors.wrench_stream(instrument, cell.course, rng)
    temperature_t, temperature = sensors.temperature_stream(instrument, cell.course, rng)
    late = float(cell.causes.total('time_delay', 'delay')) + instrument.clock_offset
    gained = sensors.gained(cell.causes, t - cell.start, cell.richness)
    return PlantRecording(
        t_joint=joint_stamps,
        q=cell.course.q(t_joint),
        qd=cell.course.q(t_joint, 1) if instrument.velocity else None,
        t_measured=stamps + late + gained,
        position=position,
        quaternion=quaternion,
        wrench_t=wrench_t,
        wrench=wrench,
        temperature_t=temperature_t,
        temperature=temperature,
        static=static,
    )


def true_poses(cell: _Cell, t: np.ndarray, rng: np.random.Generator) -> Motion:
    """Return the tool as the measuring frame has it at true times (M,) [s], free of noise."""
    q, motor = _link_side(cell, t, rng)
    causes, arm, since = cell.causes, cell.arm, t - cell.start
    rows = flaws.rows_as_built(causes, arm, since, cell.course.temperature(t))
    base, tool = flaws.frames(causes, arm)
    here = cell.here(t, motor, rng, wrench=cell.course.wrench(t))
    lean = flaws.on_joints(here, 'axis')
    base = exponentials.compose(base, flaws.frame('base', here), cell.leaned(t))
    tool = exponentials.compose(tool, flaws.frame('tool', here))
    flange = exponentials.flange(
        arm, exponentials.home(arm, rows), q, lean if lean.any() else None
    )
    pose = exponentials.compose(base, flange, tool)
    pose = flaws.yielding(causes, pose, here.wrench)
    return flaws.measured(causes, flaws.seen(here, pose, 'hand', 'stand', 'sight'), since)


def _link_side(
    cell: _Cell, t: np.ndarray, rng: np.random.Generator
) -> tuple[np.ndarray, np.ndarray]:
    """Return the links' and the motors' positions at times t, each (M, n)."""
    motor = cell.course.q(t) + (0.0 if cell.lost is None else cell.lost(t))
    geared = motor + flaws.gearing(cell.causes, motor)
    rounding = flaws.rounding(cell.causes, motor)
    give: np.ndarray | float
    if cell.course.command.static:
        give = _at_rest(cell, rng)[np.searchsorted(cell.course.command.t, t)]
    else:
        give = _in_motion(cell, rng)(t)
    return geared + rounding + give, motor


def _at_rest(cell: _Cell, rng: np.random.Generator) -> np.ndarray:
    """Return what gives at every station, in the order they are visited, shape (N, n)."""
    command, compliant = cell.course.command, cell.compliant
    q = command.q + flaws.gearing(cell.causes, command.q)
    wrench = cell.with_hoses(q, command.wrench)
    give = np.zeros_like(q) if compliant.rigid else compliant.at_rest(q, wrench)
    torque = partial(compliant.torque, q, wrench)
    return np.asarray(give + flaws.on_joints(cell.here(command.t, q, rng, torque=torque)))


def _in_motion(
    cell: _Cell, rng: np.random.Generator
) -> Callable[[np.ndarray], np.ndarray | float]:
    """Return what gives as a function of time."""
    if cell.compliant.rigid and not flaws.any_on_joints(cell.causes):
        return lambda _: 0.0
    here = cell.here(cell.grid, cell.geared, rng, torque=lambda: cell.torque)
    give = flaws.on_joints(here) + cell.sprung
    spline: Callable[[np.ndarray], np.ndarray] = CubicSpline(cell.grid, give)
    return spline
