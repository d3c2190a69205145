# Copyright 2026 weld_twin contributors
# SPDX-License-Identifier: Apache-2.0
"""No more is corrected outside what was recorded than is known there."""

from __future__ import annotations

import numpy as np

from weld_twin_core.arm.catalog import load
from weld_twin_core.effects import REGISTRY
from weld_twin_core.recording import JointMotion, Recording
from weld_twin_core.twin.compensation import compensate
from weld_twin_core.twin.domain import Domain
from weld_twin_core.twin.twin import Twin

UR5 = load('ur5')
DOMAIN = Domain(UR5.joint_names, tuple(((-1.0, 1.0),) for _ in range(6)), (0.02,) * 6, (True,) * 6)


def test_all_where_it_was_recorded_and_the_best_share_far_outside():
    q = np.zeros((3, 6))
    q[:, 2] = [1.0, 1.05, 2.0]
    correction = np.tile([3e-4, 0.0, 4e-4], (3, 1))  # half a millimetre
    covariance = np.tile(np.diag([4e-8, 2e-8, 2.5e-9]) * 4.0, (3, 1, 1))  # root of trace 0.5 mm
    share = DOMAIN.trust(q, correction, covariance)
    assert share[0] == 1.0
    assert 0.5 < share[1] < 1.0
    assert abs(share[2] - 0.5) < 1e-9


def test_the_share_goes_over_without_a_jump():
    q = np.zeros((2001, 6))
    q[:, 4] = np.linspace(0.9, 1.3, 2001)
    still = np.tile([1e-4, 0.0, 0.0], (2001, 1))
    share = DOMAIN.trust(q, still, np.tile(np.eye(3) * 1e-6, (2001, 1, 1)))
    assert np.abs(np.diff(share)).max() < 5e-3
    assert share[-1] < 0.01


def test_commands_take_off_their_share_and_no_more():
    effects = (REGISTRY['joint_offset']('elbow_joint', 2e-3),)
    q = np.tile([0.1, -1.2, 1.5, -1.8, -1.5, 0.3], (3, 1))
    recording = Recording('m', JointMotion(np.arange(3.0), q, None, True))
    result = compensate(UR5, effects, recording, trust=np.array([1.0, 0.25, 0.0]))
    nominal = Twin(UR5).poses(recording).position
    real = Twin(UR5, effects).poses(Recording('c', result.motion)).position
    off = np.linalg.norm(real - nominal, axis=1)
    whole = np.linalg.norm(Twin(UR5, effects).poses(recording).position - nominal, axis=1)
    assert whole.min() > 5e-4
    np.testing.assert_allclose(off / whole, [0.0, 0.75, 1.0], atol=1e-6)
