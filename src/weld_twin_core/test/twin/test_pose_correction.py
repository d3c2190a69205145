# Copyright 2026 weld_twin contributors
# SPDX-License-Identifier: Apache-2.0
"""Poses corrected one after the other, judged on an arm whose own numbers were changed by hand."""

import numpy as np
import pytest

from weld_twin_core.arm.catalog import load
from weld_twin_core.arm.chain import forward
from weld_twin_core.arm.robot import Robot
from weld_twin_core.effects import effect_from_mapping
from weld_twin_core.errors import DataError
from weld_twin_core.motion.inverse.newton import polish
from weld_twin_core.motion.paths import default_seam
from weld_twin_core.motion.planned_motion import plan
from weld_twin_core.recording import JointMotion, Recording
from weld_twin_core.twin.compensation import compensate
from weld_twin_core.twin.pose_correction import PoseCorrection, moved
from weld_twin_core.twin.program_model import ProgramModel

UR5 = load('ur5')
CAUSES = (
    {'effect': 'joint_offset', 'joint': 'elbow_joint', 'offset': 6e-4},
    {'effect': 'link_twist', 'joint': 'shoulder_pan_joint', 'dalpha': 5e-4},
    {'effect': 'backlash', 'joint': 'elbow_joint', 'width': 5e-4},
)


def real_arm():
    data = UR5.to_mapping()
    data['joints'][2]['theta_offset'] += 6e-4
    data['joints'][0]['alpha'] += 5e-4
    return Robot.from_mapping(data)


def correction():
    model = ProgramModel(UR5, tuple(effect_from_mapping(cause) for cause in CAUSES))
    return PoseCorrection(model, UR5.T_flange_tool)


def test_a_pose_is_taken_to_where_the_real_tool_is_where_it_was_meant():
    q = np.array([0.1, -1.2, 1.5, -1.8, -1.5, 0.3])
    (meant,) = forward(UR5, q[None])
    looked = correction().first(meant, q + 0.05)
    (joints,), left = polish(UR5, q[None], moved(meant, looked.added)[None])
    assert np.abs(left).max() < 1e-12
    np.testing.assert_allclose(forward(real_arm(), joints[None])[0], meant, atol=1e-9)
    assert np.linalg.norm(looked.added[:3]) > 1e-4


def test_a_stream_adds_what_compensate_does_for_an_arm_that_sags_and_ripples():
    entries = (
        {'effect': 'joint_compliance', 'joint': 'shoulder_lift_joint', 'compliance': 8e-6},
        {'effect': 'transmission_ripple', 'joint': 'elbow_joint', 'amplitude': 4e-4, 'order': 3.0},
        {'effect': 'link_length', 'joint': 'elbow_joint', 'da': 3e-4},
    )
    model = ProgramModel(UR5, tuple(effect_from_mapping(entry) for entry in entries))
    whole = plan(UR5, default_seam(UR5, 'weave'), rate_hz=250.0).motion
    motion = JointMotion(whole.t[:600], whole.q[:600])
    meant = forward(UR5, motion.q)
    expected = forward(UR5, compensate(UR5, model.effects, Recording('weave', motion)).motion.q)
    found, waited = PoseCorrection(model, UR5.T_flange_tool), 0
    found.adopt(found.first(meant[0], motion.q[0]))
    for pose, wanted in zip(meant, expected, strict=True):
        added, far = found.added(pose)
        waited += far > 2.0
        np.testing.assert_allclose(moved(pose, added), wanted, rtol=0.0, atol=2e-9)
        if far > 0.7:
            found.adopt(found.exact(pose))
            looked = moved(pose, found.looked.added)
            np.testing.assert_allclose(looked, wanted, rtol=0.0, atol=1e-9)
    assert waited == 0
    assert np.abs(expected - meant)[:, :3, 3].max() > 1e-4


def test_play_is_told_as_left_and_a_pose_out_of_reach_is_said():
    found = correction()
    assert found.left_out == ['backlash']
    q = np.array([0.1, -1.2, 1.5, -1.8, -1.5, 0.3])
    far = forward(UR5, q[None])[0]
    far[0, 3] += 3.0
    with pytest.raises(DataError, match='cannot be reached'):
        found.first(far, q)
