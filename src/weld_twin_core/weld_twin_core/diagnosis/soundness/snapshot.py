# Copyright 2026 weld_twin contributors
# SPDX-License-Identifier: Apache-2.0
"""A few samples of the data as stations, on which a suspicion is tried quickly."""

from __future__ import annotations

from collections.abc import Iterable, Sequence
from dataclasses import dataclass, replace
from functools import cached_property
from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray

from ...arm.robot import Robot
from ...arm.rotation import rotation_vector
from ...arrays import Array, spread_over
from ...effects.effect import Effect
from ...effects.geometry import (
    BasePose,
    JointOffset,
    LinkLength,
    LinkOffset,
    LinkTwist,
    RootPose,
    ToolPose,
)
from ...effects.plausible import ranges
from ...recording import JointMotion, Recording
from ..algebra.fit import effect_precision, fit, robust_scale
from ..algebra.problem import Anchor, Model, Problem, Scale
from ..frames.alignment import initial_frames, refined, rough_frames, tracks
from ..limits import CLEAR, ENOUGH, FAR, LARGE, MOST, SAMPLES, STEPS, TINY, WIDER
from .lengths import distance, middle_of_each, swept
from .mending import Given, Mend

FRAMES = frozenset({'base', 'tool'})
KINDS = (JointOffset, LinkLength, LinkOffset, LinkTwist)
"""Errors that a plausible arm has on every joint."""
LENGTHS = ('link_length', 'link_offset')
"""The lengths of a link; those of another arm differ in several, so they count together."""
SOFT = LARGE / CLEAR
"""Noise [m, rad] that trial fits assume at least, so that what an arm can have keeps its weight."""
BEYOND = 1.0
"""Reading [rad, m] beyond a joint's range that no controller gives, whatever its zero."""


@dataclass(frozen=True, eq=False)
class Snapshot:
    """Stations of every recording and the model they are compared with."""

    recordings: tuple[Recording, ...]
    model: Model
    align: frozenset[str] = FRAMES
    """Frames that may be anywhere; the others are off by what a frame can be off by."""
    read: tuple[Array, ...] = ()
    """Joints as they were read, before anything was undone."""

    @property
    def problem(self) -> Problem:
        return Problem(self.recordings, FRAMES, changes=self.model.changes)

    @property
    def robot(self) -> Robot:
        return self.model.robot

    def mended(self, mend: Mend) -> Snapshot:
        out = mend(Given(self.recordings, self.robot, self.align))
        model = replace(self.model, robot=out.robot)
        if (out.robot.T_world_base != self.robot.T_world_base).any():
            model = replace(model, bases=(out.robot.T_world_base,) * len(model.bases))
        if out.robot.joint_names != self.robot.joint_names:
            # What is known of a joint, or differs at it, means nothing on another robot.
            frames = tuple(c for c in model.changes if c.effect.site is None)
            model = replace(model, known=(), changes=frames)
        return Snapshot(out.recordings, model, out.align, self._read)

    @property
    def _read(self) -> tuple[Array, ...]:
        return self.read or tuple(r.joints.q for r in self.recordings)

    @cached_property
    def swept(self) -> tuple[NDArray[np.bool_], ...]:
        """Return the samples in which each joint moved that rests in most others."""
        same = sum(map(len, self._read)) == sum(r.joints.t.size for r in self.recordings)
        return swept(self._read if same else [r.joints.q for r in self.recordings])

    @cached_property
    def spread(self) -> float:
        """Return how far the measured positions spread, RMS [m]."""
        return _spread([recording.seen.position for recording in self.recordings])

    @cached_property
    def collapsed(self) -> float:
        """Return by what factor measurements spread less than motion lets them: a point, no gap."""
        twins = [
            self.model.twin(k).poses(recording, recording.seen.t).position
            for k, recording in enumerate(self.recordings)
        ]
        return max(1.0, _spread(twins) / (CLEAR * max(self.spread, TINY)))

    def shrunk(self, before: Snapshot) -> float:
        """Return by what factor the measurements spread less than before, or 1."""
        return max(1.0, before.spread / max(self.spread, TINY))

    @property
    def turned(self) -> bool:
        return all(r.seen.rotation is not None for r in self.recordings)

    @property
    def possible(self) -> bool:
        """Return whether no joint is read far beyond its range."""
        reads = np.concatenate([r.joints.q for r in self.recordings])
        low, high = self.robot.lower - BEYOND, self.robot.upper + BEYOND
        return bool(((reads >= low) & (reads <= high)).all())

    def gap(self, model: Model) -> float:
        parts = self.problem.residuals(model)
        return middle_of_each([distance(part) for part in parts], self.swept)

    @cached_property
    def _roughly(self) -> dict[bool, Model]:
        return {}

    def aligned(self, align: frozenset[str]) -> Model:
        """Return the model with only these frames fitted, wherever they are."""
        if not align:
            return self.model
        problem = replace(self.problem, align=align)
        return refined(problem, initial_frames(problem, self.model))

    @cached_property
    def given(self) -> Model:
        return self.aligned(self.align)

    @cached_property
    def remaining(self) -> float:
        """Return the median gap [m] that those frames leave."""
        return self.gap(self.given)

    @cached_property
    def framed(self) -> Model:
        """Return the model with both frames fitted, wherever they are."""
        starts = (self.model, *rough_models([self], thorough=True))
        return min((refined(self.problem, start) for start in starts), key=self.gap)

    def bent(
        self,
        errors: Sequence[Effect],
        wider: Array | float,
        noise: float = np.inf,
        *,
        near: bool = True,
    ) -> Model:
        """
        Return the model after a robust fit of its frames, believed near those given, and of errors.

        wider: how many times as large as those of machines at large they may be, shape (K,) or ().
        noise: at most so much of what is left counts as noise [m].
        """
        # What is open to free frames, on few stations, is as it was given.
        as_given = near and self.align != FRAMES and self.remaining < FAR
        model = (self.given if as_given else self.framed).with_found(tuple(errors))
        problem = self.problem
        if near:
            believed = Anchor(self.model.bases, self.robot.T_flange_tool, FRAMES - self.align)
            problem = replace(problem, anchor=believed)
        precision = effect_precision(model) / np.square(wider)
        least = Scale(SOFT, SOFT, problem.unit_scale().weights)
        for _ in range(MOST):
            scale = robust_scale(problem, problem.residuals(model), least)
            scale = replace(scale, position=min(scale.position, noise))
            model = fit(problem, model, scale, precision, iterations=STEPS).model
        return model

    @cached_property
    def arm(self) -> Arm:
        """Return the frames and a plausible arm that fit best, and how far off they leave it."""
        errors = of_joints(self.robot, KINDS)
        trial = self.bent(errors, WIDER)
        if self._displaced(trial) > 1.0:  # a frame that is elsewhere may be anywhere
            trial = self.bent(errors, WIDER, near=False)
        strain = _strain(self.robot, trial.found)
        return Arm(trial, self.gap(trial), strain, self._displaced(trial))

    def _displaced(self, model: Model) -> float:
        """Return how far frames are off those that were given, in units of the most they can be."""
        steps: list[tuple[type[BasePose | ToolPose], Array]] = []
        if 'base' not in self.align:
            pairs = zip(self.model.bases, model.bases, strict=True)
            steps += [(BasePose, np.linalg.inv(given) @ fitted) for given, fitted in pairs]
        if 'tool' not in self.align:
            tool = np.linalg.inv(self.robot.T_flange_tool) @ model.robot.T_flange_tool
            steps.append((ToolPose, tool))
        errors = [kind(tuple(s[:3, 3]), tuple(rotation_vector(s[:3, :3]))) for kind, s in steps]
        return float(_strain(self.robot, errors).max(initial=0.0))


class Arm(NamedTuple):
    """
    A plausible arm fitted to a snapshot, and the median distance [m] that it leaves.

    ``strain``, (K,), is every error in units of the most that an arm can have; ``displaced`` how far
    the frames are off those that were given, in the same units.
    """

    model: Model
    gap: float
    strain: Array
    displaced: float

    @property
    def bent(self) -> float:
        """Return how much is wrong with the arm: gap or strain in units of their limits."""
        lengths = np.array([error.name in LENGTHS for error in self.model.found])
        together = float(np.sqrt((self.strain[lengths] ** 2).sum()))
        return max(self.gap / LARGE, together, float(self.strain.max()))

    @property
    def off(self) -> float:
        return max(self.bent, self.displaced)


def of_joints(robot: Robot, kinds: Iterable[type[Effect]]) -> tuple[Effect, ...]:
    """Return errors of no size yet: these kinds of every joint, and where a positioner stands."""
    own = [kind(name) for kind in kinds for name in robot.joint_names]  # type: ignore[call-arg]
    return (*own, *([RootPose()] if robot.behind else []))


def _strain(robot: Robot, errors: Sequence[Effect]) -> Array:
    return np.array([np.abs(e.vector() / ranges(robot, e)[1]).max() for e in errors])


def snapshot(problem: Problem, model: Model, motions: list[Array]) -> Snapshot:
    """Return evenly spread samples as stations, joints at them (M, n), about a model without effects."""
    share, out = max(ENOUGH, SAMPLES // len(problem.recordings)), []
    for recording, q in zip(problem.recordings, motions, strict=True):
        seen = recording.seen
        index = spread_over(seen.t.size, share)
        joints = JointMotion(seen.t[index], q[index], static=True)
        out.append(replace(recording, joints=joints, measured=seen.take(index)))
    return Snapshot(tuple(out), replace(model, found=()), problem.align)


def rough_models(shots: Sequence[Snapshot], *, thorough: bool = False) -> list[Model]:
    """Return models after a quick fit of both frames, of many tools if ``thorough``; alike at once."""
    shapes: dict[tuple[object, ...], list[Snapshot]] = {}
    for shot in shots:
        if thorough not in shot._roughly:
            shapes.setdefault((shot.turned, *shot.problem.samples), []).append(shot)
    for alike in shapes.values():
        trials = [(tracks(shot.problem, shot.model), shot.model) for shot in alike]
        for shot, model in zip(alike, rough_frames(trials, thorough=thorough), strict=True):
            # Where orientations were measured there is one start.
            shot._roughly.update(dict.fromkeys((thorough, thorough or shot.turned), model))
    return [shot._roughly[thorough] for shot in shots]


def _spread(parts: Sequence[Array]) -> float:
    centred = np.concatenate([part - part.mean(axis=0) for part in parts])
    return float(np.sqrt((centred**2).sum(axis=1).mean()))
