# Copyright 2026 weld_twin contributors
# SPDX-License-Identifier: Apache-2.0
"""The quick fit of a bare arm to stations is the fit that everything else goes through."""

from dataclasses import replace
from itertools import islice

import numpy as np
import pytest
from measured_cells import anywhere, recorded, stations

from weld_twin_core.arm import catalog
from weld_twin_core.arm.robot import Robot
from weld_twin_core.diagnosis.algebra.problem import Model, Problem
from weld_twin_core.diagnosis.frames.alignment import TOGETHER, rough_frames
from weld_twin_core.diagnosis.soundness.snapshot import FRAMES, rough_models, snapshot
from weld_twin_core.diagnosis.soundness.suspicions import suspicions
from weld_twin_core.effects import JointOffset

GANTRY = Robot.from_mapping(
    {
        'name': 'gantry',
        'joints': [
            {'name': 'way', 'type': 'prismatic', 'alpha': 1.2},
            {'name': 'one', 'a': 0.4, 'alpha': np.pi / 2},
            {'name': 'two', 'a': 0.3, 'd': 0.1, 'alpha': -1.0},
        ],
    }
)
ROBOTS = (catalog.load('ur5'), catalog.load('franka_panda'), GANTRY)
"""Rows of either convention, and a joint that slides."""


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


def generally(shot):
    """Return the snapshot with an error of nothing known, which only the general fit can take."""
    nothing = JointOffset(shot.robot.joint_names[0], 0.0)
    return replace(shot, model=replace(shot.model, known=(nothing,)))


@pytest.mark.parametrize('count', [1, 2])
@pytest.mark.parametrize('points', [False, True])
@pytest.mark.parametrize('robot', ROBOTS, ids=lambda robot: robot.name)
def test_an_arm_is_fitted_as_by_the_general_fit(robot, points, count, rng):
    shot = shot_of(robot, rng, points, count)
    other = generally(shot)
    assert shot.postures is not None and other.postures is None
    one, two = shot.arm(), other.arm()
    assert one.gap == pytest.approx(two.gap, rel=1e-6) and one.gap < 1e-4
    np.testing.assert_allclose(one.strain, two.strain, rtol=1e-5, atol=1e-7)
    for align in ({'base'}, {'tool'}):
        left = shot.gap_with(frozenset(align)), other.gap_with(frozenset(align))
        assert left[0] == pytest.approx(left[1], rel=1e-6)


@pytest.mark.parametrize('points', [False, True])
@pytest.mark.parametrize('robot', ROBOTS, ids=lambda robot: robot.name)
def test_columns_are_those_of_the_twin(robot, points, rng):
    shot = shot_of(robot, rng, points, 2)
    model, problem = shot.arm().model, shot.problem
    place, features = shot.postures.at(model), problem.features(model)
    frames, _ = problem.frame_columns(features)
    errors = [problem.effect_columns(features, each, atoms=False) for each in model.found]
    for k, part in enumerate(shot.postures.parts):
        wanted = np.concatenate([frames[k], *(each[k] for each in errors)])
        np.testing.assert_allclose(place.columns(FRAMES)[..., part], wanted, atol=1e-12)
        left = problem.residuals(model)[k]
        np.testing.assert_allclose(place.residuals[k], left, atol=1e-12)


@pytest.mark.parametrize('points', [False, True])
def test_many_trials_at_once_are_each_of_them_alone(points, rng):
    shot = shot_of(ROBOTS[0], rng, points)
    trials = [shot.mended(each.mend) for each in islice(suspicions(shot.robot), 0, None, 5)]
    assert len(trials) > TOGETHER
    for thorough in (False, True):
        together = rough_models(trials, thorough=thorough)
        for trial, model in zip(trials, together, strict=True):
            alone = rough_frames(trial.problem, trial.model, thorough=thorough)
            assert trial.gap(model) == pytest.approx(trial.gap(alone), rel=1e-6)
