# Copyright 2026 weld_twin contributors
# SPDX-License-Identifier: Apache-2.0
"""An arm that is corrected keeps what the plan of its measurement promised."""

import numpy as np
from scipy.spatial.transform import Rotation

from weld_twin_core.arm import catalog
from weld_twin_core.diagnosis import diagnose
from weld_twin_core.diagnosis.predicting.planned import (
    JUDGED,
    SPREAD,
    clear_postures,
    plan_stations,
)
from weld_twin_core.effects.dated import of_the_robot
from weld_twin_core.recording import JointMotion, Measurements, Recording
from weld_twin_core.twin.compensation import compensate
from weld_twin_core.twin.posterior import largest_sigma
from weld_twin_core.twin.twin import Twin
from weld_twin_lab.blind.cause_sizes import small_errors
from weld_twin_lab.plant.exponentials import Command
from weld_twin_lab.plant.plant import run
from weld_twin_lab.plant.tracker import Tracker

NOISE, TOLERANCE, STATIONS = 3e-5, 2e-4, 16


def _with_middle_frames(robot, step):
    """Return a robot with the frames of the middle of the allowed models, base first (12,)."""
    base, tool = np.array(robot.T_world_base), np.array(robot.T_flange_tool)
    base[:3, :3] = Rotation.from_rotvec(step[3:6]).as_matrix() @ base[:3, :3]
    tool[:3, :3] = tool[:3, :3] @ Rotation.from_rotvec(step[9:12]).as_matrix()
    base[:3, 3] += step[:3]
    tool[:3, 3] += step[6:9]
    return robot.with_frames(base=base, tool=tool)


def test_a_corrected_arm_keeps_what_its_plan_promised():
    """Measured at the stations of the plan, corrected, and driven where it never was."""
    robot, rng = catalog.load('kuka_kr6_r900'), np.random.default_rng(12)
    flaws = small_errors(robot, rng)

    def driven(q, noise):
        t = 1.0 + np.arange(float(len(q)))
        tracker = Tracker(sigma=noise, orientation=False)
        seen = run(robot.to_mapping(), flaws, Command(t, q, static=True), tracker, rng)
        return JointMotion(t, q, static=True), Measurements(t, seen.position)

    plan = plan_stations(robot, STATIONS, TOLERANCE, NOISE)
    seen = Recording('plan', *driven(plan.q, NOISE))
    found = diagnose(seen, robot, align='base,tool', experiment=False)
    model, posterior = found.model, found.posterior
    effects, _ = posterior.centred(model.found)
    bare = _with_middle_frames(model.twin(0).robot, np.array(posterior.mean[:12]))
    others = clear_postures(robot, SPREAD)[JUDGED:]
    still = Recording('others', JointMotion(np.arange(float(len(others))), others, static=True))
    wanted = Twin(bare).poses(still).position
    commands = compensate(bare, of_the_robot(effects), still).motion.q

    def off(q):
        miss = driven(q, 0.0)[1].position - wanted
        return miss, float(largest_sigma(np.einsum('mi,mj->ij', miss, miss)[None] / len(q))[0])

    (_, before), (miss, kept) = off(others), off(commands)
    promised = float(plan.sigma[-1])
    assert kept < promised < 3.0 * kept, 'what is promised is kept, and no empty words'
    assert kept < 0.5 * before
    assert np.mean(np.linalg.norm(miss, axis=1) < TOLERANCE) >= plan.within[-1] - 0.05
