# Copyright 2026 weld_twin contributors
# SPDX-License-Identifier: Apache-2.0
"""What a sensitivity study is asked: robot, seam or recording, tolerances, how much to run."""

from dataclasses import dataclass, field
from functools import cached_property
from typing import Any

import numpy as np

from weld_twin_core.arm.robot import Robot
from weld_twin_core.arrays import Array
from weld_twin_core.effects import Effect
from weld_twin_core.motion.paths import Path, Torch
from weld_twin_core.recording import Recording
from weld_twin_core.sensitivity import (
    Study,
    Tolerance,
    WeldTolerance,
    planned_study,
    recorded_study,
)
from weld_twin_core.sensitivity.seam_study import POINTS

PROFILES = ('smooth', 'aggressive')
RECORDED = 'recorded'


@dataclass(frozen=True)
class Effort:
    """How much is run: Sobol base samples, Monte Carlo runs, Morris trajectories, placements."""

    samples: int = 1024
    runs: int = 20_000
    trajectories: int = 50
    placements: int = 32
    seed: int = 0


@dataclass(frozen=True, eq=False)
class Setting:
    """The question."""

    robot: Robot
    tolerances: tuple[Tolerance, ...]
    seam: str  # what the seam or the bag is called
    path: Path | None = None  # none where a recording is studied
    recording: Recording | None = None
    torch: Torch = field(default_factory=Torch)
    points: int = POINTS
    known: tuple[Effect, ...] = ()
    normal: Array | None = None  # shape (3,), out of the work, for a recording
    weld: WeldTolerance = field(default_factory=WeldTolerance)
    effort: Effort = field(default_factory=Effort)

    @cached_property
    def studies(self) -> dict[str, Study]:
        """Return the motions studied by name: the profiles, or the one recorded."""
        if self.recording is not None:
            study = recorded_study(
                self.robot,
                self.recording,
                points=self.points,
                normal=self.normal,
                known=self.known,
            )
            return {RECORDED: study}
        return {profile: self.planned(profile) for profile in PROFILES}

    def planned(self, profile: str, points: int | None = None) -> Study:
        """Return the study of the seam travelled by a time law."""
        assert self.path is not None
        return planned_study(
            self.robot,
            self.path,
            profile,
            points=points or self.points,
            torch=self.torch,
            known=self.known,
        )

    def describe(self) -> dict[str, Any]:
        """Return what the study was asked, as plain data."""
        first = next(iter(self.studies.values()))
        return {
            'robot': self.robot.name,
            'tool': self.robot.to_mapping()['tool'],
            'seam': self.seam,
            'length_m': first.length,
            'path_points': first.samples,
            'profiles': list(self.studies),
            'samples': self.effort.samples,
            'runs': self.effort.runs,
            'trajectories': self.effort.trajectories,
            'placements': self.effort.placements,
            'seed': self.effort.seed,
            'across_m': self.weld.across_m,
            'stickout_m': self.weld.stickout_m,
            'known': [effect.to_mapping() for effect in self.known],
            'tolerances': [tolerance.to_mapping() for tolerance in self.tolerances],
        }


def recorded_deviations(study: Study) -> Array | None:
    """Return measured minus nominal position in seam axes, shape (N, 3) [m], where measured."""
    measured = study.recording.measured
    if measured is None:
        return None
    index = np.searchsorted(measured.t, study.t)
    return study.on_seam(measured.position[index] - study.nominal.position)
