# SPDX-FileCopyrightText: weld_twin contributors
# SPDX-License-Identifier: Apache-2.0
"""A few samples of the data as stations, on which a suspicion is tried quickly."""

from __future__ import annotations

from dataclasses import dataclass, replace

import numpy as np

from ...arm.robot import Robot
from ...arrays import Array
from ...effects.joint_offset import JointOffset
from ...errors import DataError
from ...recording import JointMotion, Measurements, Recording
from ..algebra.fit import fit, robust_scale
from ..algebra.problem import Model, Problem
from ..frames.alignment import refined, rough_frames

SAMPLES = 60
FRAMES = frozenset({'base', 'tool'})


@dataclass(frozen=True, eq=False)
class Snapshot:
    """Stations of every recording and the model they are compared with."""

    recordings: tuple[Recording, ...]
    model: Model

    @property
    def problem(self) -> Problem:
        """Return the snapshot as a problem with both frames free."""
        return Problem(self.recordings, FRAMES)

    @property
    def robot(self) -> Robot:
        """Return the robot compared with."""
        return self.model.robot

    def with_joints(self, matrix: Array, offset: Array) -> Snapshot:
        """Return the snapshot with other joint positions: q matrix' + offset."""
        out = []
        for r in self.recordings:
            q = r.joints.q @ matrix.T + offset
            out.append(replace(r, joints=replace(r.joints, q=q, qd=None)))
        return replace(self, recordings=tuple(out))

    def with_measured(self, *, scale: float = 1.0, mirror: bool = False) -> Snapshot:
        """Return the snapshot with scaled or mirrored positions; a mirror drops orientation."""
        factor = scale * np.array([1.0, -1.0 if mirror else 1.0, 1.0])
        out = []
        for r in self.recordings:
            seen = measured(r)
            turn = None if mirror else seen.rotation
            out.append(
                r.with_measured(replace(seen, position=seen.position * factor, rotation=turn))
            )
        return replace(self, recordings=tuple(out))

    def with_turns(self, turns: list[Array | None]) -> Snapshot:
        """Return the snapshot with other measured rotations, or none."""
        pairs = zip(self.recordings, turns, strict=True)
        out = [r.with_measured(replace(measured(r), rotation=turn)) for r, turn in pairs]
        return replace(self, recordings=tuple(out))

    def with_robot(self, robot: Robot) -> Snapshot:
        """Return the snapshot compared with another robot that carries the same tool."""
        tooled = robot.with_frames(tool=self.robot.T_flange_tool)
        return replace(self, model=replace(self.model, robot=tooled))

    def rough_gap(self) -> float:
        """Return the median gap [m] after a quick fit of both frames."""
        return gap(self.problem, rough_frames(self.problem, self.model))

    def framed(self) -> Model:
        """Return the model with both frames fitted."""
        starts = (self.model, rough_frames(self.problem, self.model, thorough=True))
        trials = [refined(self.problem, start) for start in starts]
        return min(trials, key=lambda model: gap(self.problem, model))

    def offset(self) -> Model:
        """Return the model with both frames and a constant offset of every joint fitted."""
        model = self.framed()
        joints = tuple(JointOffset(name) for name in self.robot.joint_names)
        trial = model.with_found(joints)
        precision = np.ones(len(joints))
        for _ in range(3):
            scale = robust_scale(self.problem, self.problem.residuals(trial))
            trial = fit(self.problem, trial, scale, precision, iterations=8).model
        return trial


def snapshot(problem: Problem, model: Model, motions: list[Array]) -> Snapshot:
    """Return evenly spread samples of every recording as stations."""
    share = max(12, SAMPLES // len(problem.recordings))
    out = []
    for recording, q in zip(problem.recordings, motions, strict=True):
        seen = measured(recording)
        index = np.unique(np.linspace(0, seen.t.size - 1, share).round().astype(int))
        joints = JointMotion(seen.t[index], q[index], static=True)
        out.append(replace(recording, joints=joints, measured=seen.take(index)))
    return Snapshot(tuple(out), replace(model, found=()))


def gap(problem: Problem, model: Model) -> float:
    """Return the median distance between measured and twin [m]."""
    parts = problem.residuals(model)
    return float(np.median(np.concatenate([np.linalg.norm(p[:3], axis=0) for p in parts])))


def measured(recording: Recording) -> Measurements:
    """
    Return what was measured.

    Raises
    ------
    DataError
        Nothing was.

    """
    if recording.measured is None:
        raise DataError(f'{recording.name} holds no measured poses or points')
    return recording.measured
