# Copyright 2026 weld_twin contributors
# SPDX-License-Identifier: Apache-2.0
"""How frames are found, and what efforts tell of the arm."""

from dataclasses import replace

import numpy as np
import pytest
from measured_cells import anywhere, asked, moving, recorded, remeasured, stations

from weld_twin_core import catalog, load
from weld_twin_core.arm.rotation import nearest_rotation, rotation_matrix
from weld_twin_core.diagnosis.frames.alignment import LEVER, Track, initial_frames
from weld_twin_core.diagnosis.soundness.efforts import _fitted, compared
from weld_twin_core.effects.curves import AT_REST
from weld_twin_core.twin.features import with_expected_effort


def worst_median(problem, model):
    return max(np.median(np.abs(part[:3])) for part in problem.residuals(model))


@pytest.mark.parametrize('points', [False, True])
@pytest.mark.parametrize('align', [('base',), ('tool',), ('base', 'tool')])
@pytest.mark.parametrize('name', ['ur5', 'kuka_kr6_r900', 'franka_panda'])
def test_frames_are_found_from_anywhere(name, align, points):
    rng = np.random.default_rng(len(name) + 2 * len(align) + points)
    robot = catalog.load(name)
    real = robot.with_frames(
        base=anywhere(rng, 3.0) if 'base' in align else None,
        tool=anywhere(rng, 0.3) if 'tool' in align else None,
    )
    recording = recorded(real, stations(robot, rng, 60), rng, sigma=0.0, points=points)
    problem, model = asked(robot, recording, align=align)
    found = initial_frames(problem, model)
    assert worst_median(problem, found) < 1e-9
    if 'base' in align:
        np.testing.assert_allclose(found.bases[0], real.T_world_base, atol=1e-6)
    if not points:
        np.testing.assert_allclose(found.robot.T_flange_tool, real.T_flange_tool, atol=1e-6)


def test_every_recording_has_its_own_base_and_all_have_one_tool(ur5, rng):
    tool = anywhere(rng, 0.2)
    reals = [ur5.with_frames(base=anywhere(rng, 3.0), tool=tool) for _ in range(3)]
    parts = [recorded(real, stations(ur5, rng, 40), rng, sigma=0.0) for real in reals]
    problem, model = asked(ur5, *parts)
    found = initial_frames(problem, model)
    for real, base in zip(reals, found.bases, strict=True):
        np.testing.assert_allclose(base, real.T_world_base, atol=1e-6)


@pytest.mark.parametrize('points', [False, True])
def test_one_gross_outlier_in_twenty_does_not_matter(ur5, rng, points):
    real = ur5.with_frames(base=anywhere(rng, 3.0), tool=anywhere(rng, 0.2))
    recording = recorded(real, stations(ur5, rng, 100), rng, sigma=0.0, points=points)
    position = recording.measured.position.copy()
    position[::20] += rng.normal(0.0, 0.5, (5, 3))
    problem, model = asked(ur5, remeasured(recording, position=position))
    found = initial_frames(problem, model)
    np.testing.assert_allclose(found.bases[0], real.T_world_base, atol=1e-6)


def test_frames_that_are_near_stay_as_given(ur5, rng):
    recording = recorded(ur5, stations(ur5, rng, 40), rng)
    problem, model = asked(ur5, recording)
    assert initial_frames(problem, model) is model


def test_what_a_constant_orientation_cannot_tell_is_left_as_given(ur5, rng):
    real = ur5.with_frames(base=anywhere(rng, 2.0))
    recording = recorded(real, moving(ur5, rng, size=0.002), rng)
    problem, model = asked(ur5, recording)
    found = initial_frames(problem, model)
    # Motion of a few millimetres says nothing of a tool; moving the base alone must do.
    assert np.abs(found.robot.T_flange_tool - np.eye(4)).max() < 5e-3
    assert worst_median(problem, found) < 5e-5


def test_the_nearest_rotation_of_a_rotation_is_itself_and_never_a_mirror(rng):
    turn = rotation_matrix(rng.normal(size=3))
    np.testing.assert_allclose(nearest_rotation(turn), turn, atol=1e-12)
    assert np.linalg.det(nearest_rotation(np.diag([1.0, 1.0, -1.0]))) == pytest.approx(1.0)


def test_a_gap_is_how_far_the_tool_is_from_where_it_was_seen_and_a_turn_by_its_lever(rng):
    base, tool = anywhere(rng, 2.0), anywhere(rng, 0.2)
    flange = [anywhere(rng, 1.0) for _ in range(5)]
    seen = np.array([base @ each @ tool for each in flange])
    turn = np.array([each[:3, :3] for each in flange])
    point = np.array([each[:3, 3] for each in flange])
    position = seen[:, :3, 3] + np.array([2e-3, -1e-3, 2e-3])
    points = Track(position, None, point, turn)
    np.testing.assert_allclose(points.gap(base, tool), 3e-3, rtol=1e-9)
    turned = rotation_matrix([0.0, 0.0, 0.01]) @ seen[:, :3, :3]
    both = Track(position, turned, point, turn)
    np.testing.assert_allclose(both.gap(base, tool), 3e-3 + 0.01 * LEVER, rtol=1e-4)


ROBOT = load('ur10e')
ELBOW = np.arange(6) == 2
NOISE = 0.05
"""Of every effort [N m]: what torque sensors of an arm of this size are good for."""
MADE = {
    ('payload', None, 2.0): replace(ROBOT, payload_mass=ROBOT.payload_mass + 2.0),
    ('torque_constant', 'elbow_joint', 1.2): ROBOT,
    ('link_mass', 'elbow_joint', 1.3): replace(ROBOT, mass=ROBOT.mass * (1.0 + 0.3 * ELBOW)),
    ('link_masses', None, 1.1): replace(ROBOT, mass=1.1 * ROBOT.mass),
}


def reported(kind, real, factor, unit=1.0, seed=3):
    """Return a recording with efforts of a real arm, the elbow's times a factor, all in a unit."""
    rng = np.random.default_rng(seed)
    run = with_expected_effort(recorded(ROBOT, kind(ROBOT, rng), rng, points=True), real, 1.0)
    rubs = 0.0
    if kind is moving:
        speed = run.joints.velocity
        rubs = 3.0 * np.tanh(speed / AT_REST) + 2.0 * speed
    torque = run.effort.value * np.where(ELBOW, factor, 1.0) + rubs + 0.7
    torque = torque + NOISE * rng.normal(size=torque.shape)
    return replace(run, effort=replace(run.effort, value=unit * torque))


@pytest.mark.parametrize('kind', [stations, moving])
@pytest.mark.parametrize('cause', MADE, ids=lambda cause: cause[0])
def test_one_cause_of_a_difference_is_told_with_its_size_beside_friction_and_offsets(kind, cause):
    name, joint, value = cause
    factor = value if name == 'torque_constant' else 1.0
    found = compared([reported(kind, MADE[cause], factor)], ROBOT)
    first, *others = found.causes
    assert (first.name, first.joint) == (name, joint)
    assert abs(first.value - value) < 4.0 * first.std < 0.02 * value
    assert first.left < 0.1 and all(other.left > first.left for other in others)
    by_joint = {each.joint: each for each in found.joints}
    if name == 'torque_constant' and kind is stations:
        assert by_joint['elbow_joint'].factor == pytest.approx(value, rel=0.01)
        assert (
            by_joint['elbow_joint'].difference_rms > 5.0 * by_joint['wrist_1_joint'].difference_rms
        )


def test_joints_are_told_by_what_all_recordings_have():
    runs = [reported(stations, ROBOT, 1.2, seed=seed) for seed in (4, 5)]
    model = [with_expected_effort(run, ROBOT, 1.0).effort.value for run in runs]
    model, seen = (np.concatenate(v) for v in (model, [run.effort.value for run in runs]))
    found = compared(runs, ROBOT)
    about, gap = model - model.mean(axis=0), seen - model
    both = about.ravel(), (seen - seen.mean(axis=0)).ravel()
    assert found.correlation == pytest.approx(np.corrcoef(*both)[0, 1])
    assert found.difference == pytest.approx(np.sqrt((gap**2).mean() / (about**2).mean()))
    for i, told in enumerate(found.joints):
        sizes = model[:, i].std(), np.sqrt((gap[:, i] ** 2).mean())
        assert (told.model_rms, told.difference_rms) == pytest.approx(sizes)
        assert (told.factor is None) is bool(sizes[0] < 0.2 * model.std(axis=0).max())
        if told.factor is not None:
            slope, _ = np.polyfit(model[:, i], seen[:, i], 1)
            assert told.factor == pytest.approx(slope)


def test_in_another_unit_of_torque_the_same_is_told():
    """Newton metres or kilopond metres, where the masses are told in theirs."""
    cause, unit = ('link_mass', 'elbow_joint', 1.3), 1.0 / 9.80665
    lighter = replace(ROBOT, mass=unit * ROBOT.mass, payload_mass=unit * ROBOT.payload_mass)
    one = compared([reported(stations, MADE[cause], 1.0)], ROBOT)
    other = compared([reported(stations, MADE[cause], 1.0, unit)], lighter)
    assert other.correlation == pytest.approx(one.correlation, rel=1e-9)
    assert other.difference == pytest.approx(one.difference, rel=1e-9)
    for before, after in zip(one.joints, other.joints, strict=True):
        assert (after.model_rms, after.difference_rms) == pytest.approx(
            (unit * before.model_rms, unit * before.difference_rms)
        )
        assert after.factor == (None if before.factor is None else pytest.approx(before.factor))
    assert [(c.name, c.joint, c.value) for c in other.causes] == [
        (c.name, c.joint, pytest.approx(c.value)) for c in one.causes
    ]


def test_coefficients_are_as_sure_as_those_of_a_straight_line():
    x, noise = np.random.default_rng(4).normal(size=(2, 9))
    line, covariance = np.polyfit(x, 2.0 * x + noise, 1, cov=True)
    values, spread, left = _fitted(np.stack([x, np.ones(9)])[:, None], (2.0 * x + noise)[None])
    np.testing.assert_allclose(values, line)
    np.testing.assert_allclose(spread, np.sqrt(np.diag(covariance)))
    assert left == pytest.approx(((2.0 * x + noise - np.polyval(line, x)) ** 2).sum())
