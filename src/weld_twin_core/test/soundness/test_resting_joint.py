# SPDX-FileCopyrightText: weld_twin contributors
# SPDX-License-Identifier: Apache-2.0
"""A joint that moves in one recording and rests in another is no reason to stop."""

import numpy as np

import weld_twin_core as wt


def recorded(ur5, name, rests):
    t = np.arange(150) / 25.0
    q = np.array([0.3, -1.3, 1.5, -1.8, -1.5, 0.0])
    q = q + 0.3 * np.sin(t[:, None] * np.array([1.0, 1.3, 0.7, 0.9, 1.1, 1.7]))
    if rests:
        q[:, 5] = 0.0
    motion = wt.JointMotion(t, q)
    off = wt.effects.JointOffset('elbow_joint', offset=5e-4)
    real = wt.Twin(ur5, [off]).poses(wt.Recording(name, motion))
    noise = np.random.default_rng(0).normal(0.0, 3e-5, real.position.shape)
    return wt.Recording(name, motion, wt.Measurements(t, real.position + noise))


def test_a_joint_that_rests_in_one_of_two_recordings_is_examined_like_the_others(ur5):
    found = wt.diagnose([recorded(ur5, 'free', False), recorded(ur5, 'seam', True)], ur5)
    assert found.status != 'unsound'
