# Copyright 2026 weld_twin contributors
# SPDX-License-Identifier: Apache-2.0
"""Poses and torques of an arm as Pinocchio finds them in its URDF."""

import numpy as np
import pytest


def by_pinocchio(path, names, q, base, tip):
    """Return the tip in a base, which may be None for the root, and what gravity does to joints."""
    pin = pytest.importorskip('pinocchio')
    model = pin.buildModelFromUrdf(str(path))
    model.gravity.linear = np.array([0.0, 0.0, -9.80665])
    data, poses, torques = model.createData(), [], []
    ends = [model.getFrameId(link) if link else 0 for link in (base, tip)]
    for row in q:
        there = pin.neutral(model)
        for name, value in zip(names, row, strict=True):
            joint = model.joints[model.getJointId(name)]
            # A continuous joint is held as cosine and sine.
            at = [np.cos(value), np.sin(value)] if joint.nq == 2 else [value]
            there[joint.idx_q : joint.idx_q + joint.nq] = at
        pin.framesForwardKinematics(model, data, there)
        first, last = (data.oMf[end] for end in ends)
        poses.append(first.actInv(last).homogeneous)
        weights = -pin.computeGeneralizedGravity(model, data, there)
        torques.append([weights[model.joints[model.getJointId(name)].idx_v] for name in names])
    return np.array(poses), np.array(torques)
