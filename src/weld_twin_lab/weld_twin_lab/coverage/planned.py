# Copyright 2026 weld_twin contributors
# SPDX-License-Identifier: Apache-2.0
"""Plans of a measurement, carried out by the plant: is the arm as sure as the plan said?"""

from __future__ import annotations

from typing import Any

import numpy as np

from weld_twin_core.arm import catalog
from weld_twin_core.diagnosis import diagnose
from weld_twin_core.diagnosis.predicting.allowed import corrected_sigma
from weld_twin_core.diagnosis.predicting.planned import (
    JUDGED,
    SPREAD,
    clear_postures,
    plan_stations,
)
from weld_twin_core.recording import JointMotion, Recording
from weld_twin_core.twin.posterior import expected_poses, largest_sigma

from ..blind.blind_cell import at_stations
from ..blind.everywhere import small_errors
from ..plant.tracker import Tracker

ARMS = ('ur5', 'ur10', 'kuka_kr6_r900', 'abb_irb1600')
COUNTS = (16, 24, 40)
"""Stations of a plan."""
NOISE = 3e-5
"""Of every measured coordinate [m]."""
TOLERANCE = 2e-4
"""Of the tool [m]; plans are asked how probably it is kept."""
UNSEEN = 60
"""Other postures of the region, at which the corrected arm is judged."""
FRAMES = [
    {'effect': 'base_pose', 'xyz': [0.01, -0.02, 0.015], 'rotvec': [0.01, -0.008, 0.02]},
    {'effect': 'tool_pose', 'xyz': [0.004, 0.003, -0.006], 'rotvec': [0.0, 0.0, 0.0]},
]
"""Where instrument and reflector really are: not known to the diagnosis."""


def carried_out(seed: int) -> dict[str, Any]:
    """
    Return what a plan promised, what the diagnosis of its stations warns of, and what an arm keeps.

    The arm is corrected with the effects in the middle of the allowed models.

    seed: decides arm, its errors, the count and the noise.
    """
    rng = np.random.default_rng(seed)
    robot = catalog.load(ARMS[seed % len(ARMS)])
    count = COUNTS[seed // len(ARMS) % len(COUNTS)]
    plan = plan_stations(robot, count, TOLERANCE, NOISE)
    flaws = [*FRAMES, *small_errors(robot, rng)]
    noisy = Tracker(sigma=NOISE, orientation=False)
    seen = at_stations(robot, flaws, plan.q, noisy, rng)
    motion = JointMotion(seen.t, plan.q, static=True)
    found = diagnose(Recording('plan', motion, seen), robot, align='base,tool')
    others = clear_postures(robot, SPREAD)[-UNSEEN:]
    true = at_stations(robot, flaws, others, Tracker(orientation=False), rng).position
    assert found.posterior is not None
    still = Recording('others', JointMotion(np.arange(float(len(others))), others, static=True))
    middle, _ = expected_poses(found.posterior, found.model.twin(0), still, still.joints.t)
    off = true - middle.position
    length = np.linalg.norm(off, axis=1)
    judged = clear_postures(robot, SPREAD)[:JUDGED]
    return {
        'seed': seed,
        'robot': robot.name,
        'stations': count,
        'status': found.status,
        'promised_sigma_m': float(plan.sigma[-1]),
        'promised_elsewhere_m': float(plan.elsewhere[-1]),
        'warned_sigma_m': corrected_sigma(found.posterior, found.model, judged),
        'warned_elsewhere_m': found.posterior.anywhere_m,
        'promised_within': float(plan.within[-1]),
        'kept_sigma_m': float(largest_sigma(np.einsum('mi,mj->ij', off, off)[None] / len(off))[0]),
        'kept_within': float((length < TOLERANCE).mean()),
    }
