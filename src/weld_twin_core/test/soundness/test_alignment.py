# Copyright 2026 weld_twin contributors
# SPDX-License-Identifier: Apache-2.0
"""Frames are found in closed form wherever an instrument stands."""

import numpy as np
import pytest
from measured_cells import anywhere, asked, moving, recorded, remeasured, stations

from weld_twin_core.arm import catalog
from weld_twin_core.arm.rotation import nearest_rotation, rotation_matrix
from weld_twin_core.diagnosis.frames.alignment import LEVER, Track, initial_frames


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
