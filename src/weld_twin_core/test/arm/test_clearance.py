# Copyright 2026 weld_twin contributors
# SPDX-License-Identifier: Apache-2.0
"""Postures in which an arm hits itself or its floor are told from those in which it does not."""

import numpy as np
import pytest

from weld_twin_core import Robot, catalog
from weld_twin_core.arm.clearance import Space, _clearances, body
from weld_twin_core.arm.rotation import transform

UPRIGHT = np.array([0.0, -1.4, 1.4, -1.6, -1.5, 0.0])
FOLDED = np.array([0.0, -1.4, 3.0, 0.0, 0.0, 0.0])
DOWN = np.array([0.0, 0.5, 0.2, -1.6, -1.5, 0.0])


def test_a_folded_arm_hits_itself_and_a_usual_posture_does_not(ur5):
    seen = UPRIGHT[None]
    assert Space(ur5, seen).free(UPRIGHT[None]).tolist() == [True]
    assert Space(ur5, seen).free(FOLDED[None]).tolist() == [False]


def test_an_upright_arm_stays_above_its_foot_and_within_a_box(ur5):
    seen = UPRIGHT[None]
    assert not Space(ur5, seen).free(DOWN[None])[0]
    everything = np.array([[-3.0] * 3, [3.0] * 3])
    assert Space(ur5, seen, everything).free(DOWN[None])[0]
    assert not Space(ur5, seen, np.array([[-0.1] * 3, [0.1] * 3])).free(UPRIGHT[None])[0]
    # An arm may stand outside, as on the floor below a cell's fence.
    assert Space(ur5, seen, np.array([[-3.0, -3.0, 0.02], [3.0] * 3])).free(UPRIGHT[None])[0]


def test_where_the_arm_was_is_no_collision(ur5):
    assert Space(ur5, FOLDED[None]).free(FOLDED[None])[0]


def test_an_axis_without_extent_is_free_anywhere():
    axis = Robot.from_mapping({'name': 'axis', 'joints': [{'name': 'x', 'type': 'prismatic'}]})
    assert Space(axis, np.zeros((1, 1))).free(np.zeros((2, 1))).all()
    assert Space(axis, np.zeros((1, 1))).free(np.array([[0.1]])).all()


def test_links_are_as_far_apart_as_points_on_them_are(ur5):
    shape = body(ur5, np.array([UPRIGHT, FOLDED]))
    share = np.linspace(0.0, 1.0, 200)[:, None]
    nearest = []
    for k in range(2):
        lines = [a + share * (b - a) for a, b in zip(shape.start[k], shape.end[k], strict=True)]
        gaps = [
            np.linalg.norm(lines[i][:, None] - lines[j][None], axis=2).min()
            - shape.radius[i]
            - shape.radius[j]
            for i in range(len(lines))
            for j in range(i + 1, len(lines))
            if abs(shape.link[i] - shape.link[j]) >= 2
        ]
        nearest.append(min(gaps))
    np.testing.assert_allclose(_clearances(shape).min(axis=1), nearest, atol=0.05)
    elsewhere = ur5.with_frames(base=transform(np.eye(3), np.array([5.0, -3.0, 2.0])))
    there = _clearances(body(elsewhere, np.array([UPRIGHT, FOLDED])))
    np.testing.assert_allclose(there, _clearances(shape), atol=1e-12)


@pytest.mark.parametrize('name', catalog.names())
def test_the_line_from_base_to_tool_is_the_arm_of_every_bundled_robot(name):
    robot = catalog.load(name)
    q = np.clip(0.3 * np.ones(robot.n), robot.lower, robot.upper)
    shape = body(robot, q)
    np.testing.assert_allclose(shape.start[1:], shape.end[:-1], atol=2e-3)
    torch = int(np.linalg.norm(robot.T_flange_tool[:3, 3]) > 1e-3)
    thick = [0.05 * (np.abs(robot.a) + np.abs(robot.d)).sum()] * (len(shape.radius) - torch)
    np.testing.assert_allclose(shape.radius, thick + [0.03] * torch)
    assert set(shape.link) <= set(range(robot.n + torch))
