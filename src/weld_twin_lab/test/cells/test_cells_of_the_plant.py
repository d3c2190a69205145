# Copyright 2026 weld_twin contributors
# SPDX-License-Identifier: Apache-2.0
"""Cells and cameras of the plant, against the twin's nominal chain and a pinhole written out here."""

import numpy as np
import pytest

from weld_twin_core import Robot, forward
from weld_twin_lab.cells.study import (
    KINDS,
    beyond_frames,
    cell,
    named_as_tracked,
    opened,
    page,
    postures,
    really,
)
from weld_twin_lab.plant.exponentials import Motion
from weld_twin_lab.plant.tracker import Eye, looking, seen

pytest.importorskip('mujoco')


@pytest.mark.parametrize('kind', KINDS)
def test_a_sound_cell_is_where_the_file_says_and_an_error_moves_it(kind):
    data = cell(kind, 1)
    robot = Robot.from_mapping(data)
    rng = np.random.default_rng(4)
    q = postures(robot, 12, rng)
    sound = really(data, robot.joint_names, [], q, rng)
    nominal = forward(robot, q)
    np.testing.assert_allclose(sound.position, nominal[:, :3, 3], atol=1e-9)
    np.testing.assert_allclose(sound.rotation, nominal[:, :3, :3], atol=1e-9)
    joint = robot.joint_names[1]
    wrong = [{'effect': 'joint_offset', 'joint': joint, 'offset': 1e-3}]
    off = really(data, robot.joint_names, wrong, q, rng).position
    moved = q.copy()
    moved[:, 1] += 1e-3
    np.testing.assert_allclose(off, forward(robot, moved)[:, :3, 3], atol=1e-9)


def test_frames_take_up_what_a_moved_base_and_tool_do_and_nothing_else():
    rng = np.random.default_rng(2)
    turns = np.linalg.qr(rng.normal(size=(30, 3, 3)))[0]
    tool = Motion(turns * np.linalg.det(turns)[:, None, None], rng.uniform(-1, 1, (30, 3)))
    base = 1e-3 * (np.cross([0.3, -0.2, 0.5], tool.position) + [1.0, 2.0, -1.0])
    rigid = base + 1e-3 * tool.rotation @ [0.5, -0.4, 0.2]
    assert np.abs(beyond_frames(tool, rigid)).max() < 1e-12
    assert np.abs(beyond_frames(tool, rng.normal(size=(30, 3)))).max() > 0.1


def test_a_camera_sees_a_point_where_a_pinhole_does_and_none_beside_its_image():
    eye = Eye(
        np.array([800.0, 810.0]),
        np.array([320.0, 240.0]),
        (0.0, 0.0, 0.0, 0.0),
        looking(np.array([0.0, -2.0, 0.0]), np.zeros(3)),
        (640, 480),
    )
    board = Motion(np.eye(3)[None], np.zeros((1, 3)))
    points = np.array([[0.1, 0.0, 0.05], [1.5, 0.0, 0.0]])
    found = seen(eye, board, points, 0.0, np.random.default_rng(0))[0]
    # To the right in the image is +x of the cell, up is +z, two metres away.
    np.testing.assert_allclose(found[0], [320.0 + 800.0 * 0.05, 240.0 - 810.0 * 0.025])
    assert np.isnan(found[1]).all()


def test_what_was_named_is_counted():
    class Found:
        status, sure, confidence = 'ambiguous', True, 0.97
        effects = ()

        class _At:
            def __init__(self, effect, joint):
                self.effect, self.joint = effect, joint

        indistinguishable = ((_At('joint_offset', 'tilt'), _At('root_pose', None)),)

    told = opened(Found(), ('joint_offset', 'tilt'))
    assert told['named'] and told['right']
    missed = opened(Found(), ('joint_offset', 'turn'))
    assert not missed['named']
    pixels = [{'tracker': told, 'pixels': told}, {'tracker': told, 'pixels': missed}]
    assert named_as_tracked([*pixels, {'tracker': missed, 'pixels': missed}]) == 0.5
    text = page([{'kind': 'two arms', **told}], pixels, [])
    assert '| two arms | 1 | 1 | 1 | 1 | 0 |' in text
    assert 'pixels name 50 %' in text
