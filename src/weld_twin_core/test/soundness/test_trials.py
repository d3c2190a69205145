# Copyright 2026 weld_twin contributors
# SPDX-License-Identifier: Apache-2.0
"""Many mix-ups are tried at once, and each as if it were tried alone."""

from dataclasses import replace
from itertools import islice

import pytest
from measured_cells import anywhere, recorded, stations

from weld_twin_core.arm.catalog import load
from weld_twin_core.diagnosis.algebra.problem import Model, Problem
from weld_twin_core.diagnosis.frames.alignment import TOGETHER
from weld_twin_core.diagnosis.soundness.snapshot import FRAMES, rough_models, snapshot
from weld_twin_core.diagnosis.soundness.suspicions import suspicions
from weld_twin_core.effects import JointOffset


def shot_of(robot, rng, points, count=1):
    """Return stations of an arm with wrong zeros that stands elsewhere, as a snapshot."""
    tool = anywhere(rng, 0.1)
    bent = [JointOffset(name, 2e-3 * rng.standard_normal()) for name in robot.joint_names]
    recordings = tuple(
        recorded(
            robot.with_frames(base=anywhere(rng, 2.0), tool=tool),
            stations(robot, rng, 30),
            rng,
            effects=bent,
            points=points,
        )
        for _ in range(count)
    )
    model = Model(robot, tuple(robot.T_world_base for _ in recordings))
    motions = [r.joints.q for r in recordings]
    return snapshot(Problem(recordings, FRAMES), model, motions)


@pytest.mark.parametrize('points', [False, True])
def test_many_trials_at_once_are_each_of_them_alone(points, rng):
    shot = shot_of(load('ur5'), rng, points)
    trials = [shot.mended(each.mend) for each in islice(suspicions(shot.robot), 0, None, 5)]
    assert len(trials) > TOGETHER
    for thorough in (False, True):
        together = rough_models(trials, thorough=thorough)
        for trial, model in zip(trials, together, strict=True):
            alone = rough_models([replace(trial)], thorough=thorough)[0]
            assert trial.gap(model) == pytest.approx(trial.gap(alone), rel=1e-6)
